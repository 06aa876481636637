"""A model whose APA is known only roughly: the stiffness of its own elastic modes becomes uncertain.

A tolerance of the response cannot say that a model's resonances lie elsewhere: near a mode of damping ratio z a shift
by more than z changes the response by its whole size. So a model with a tolerance above its damping ratio has the
stiffness of its APA's free-free modes set free, each by twice the tolerance (frequencies go with the root).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from checks.model.apa import ELASTIC_FROM, ApaBody
from checks.model.model import Model
from checks.model.superelement import Array

Values = Mapping[str, float]

MODES = 5  # those below 4 kHz of an APA300ML; data below 1 kHz leave the next at their priors


@dataclass(frozen=True, eq=False)
class Softened:
    """values -> body whose first elastic modes have their stiffness times `apa.mode_1` ...; parts (m, n, n)."""

    body: ApaBody
    parts: Array

    def __call__(self, values: Values) -> ApaBody:
        more = np.array([values[name] - 1.0 for name in names(len(self.parts))])
        return replace(self.body, K=self.body.K + np.tensordot(more, self.parts, 1))


def names(modes: int = MODES) -> tuple[str, ...]:
    """Flat names of the factors."""
    return tuple(f"apa.mode_{i + 1}" for i in range(modes))


def is_rough(model: Model) -> bool:
    """Whether the model's tolerance is wider than its modes."""
    return model.tolerance > model.values.get("apa.damping_ratio", np.inf)


def softened(model: Model) -> Model:
    """The model with its APA's modes uncertain where it is rough, as it is where it is not."""
    if not is_rough(model):
        return model
    body = model.apa(model.values)
    w2, shapes = linalg.eigh(body.K, body.M)
    momenta = (body.M @ shapes[:, ELASTIC_FROM : ELASTIC_FROM + MODES]).T
    parts = w2[ELASTIC_FROM : ELASTIC_FROM + MODES, None, None] * momenta[:, :, None] * momenta[:, None, :]
    factors = dict.fromkeys(names(len(parts)), 1.0)
    sds = dict.fromkeys(factors, 2.0 * model.tolerance)
    return replace(model, apa=Softened(body, parts), values={**model.values, **factors}, sds={**model.sds, **sds})
