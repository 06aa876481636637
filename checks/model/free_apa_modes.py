"""A model whose APA is known only roughly: the stiffness of its own elastic modes becomes uncertain.

A tolerance of the response cannot say that a model's resonances lie elsewhere: near a mode of damping ratio z a shift
by more than z changes the response by its whole size. So a model with a tolerance above its damping ratio has the
stiffness of its APA's free-free modes set free, each by twice the tolerance (frequencies go with the root). Once they
are calibrated a model file holds them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError
from checks.model.model import Model
from checks.model.structure.apa import ELASTIC_FROM, ApaBody

Values = Mapping[str, float]

WIDER = 2.0  # a fit moves the damping ratio by half, and a fine model must not become rough by that
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
    """Whether the model's tolerance is much wider than its modes, so that it does not know where they lie."""
    has_factors = names()[0] in model.values
    return has_factors or model.tolerance > WIDER * model.values.get("apa.damping_ratio", np.inf)


def softened(model: Model) -> Model:
    """The model with its APA's modes uncertain where it is rough, as it is where it is not."""
    if not is_rough(model) or names()[0] in model.values:
        return model
    apa = _softened(model)
    factors = dict.fromkeys(names(len(apa.parts)), 1.0)
    sds = dict.fromkeys(factors, 2.0 * model.tolerance)
    return replace(model, apa=apa, values={**model.values, **factors}, sds={**model.sds, **sds})


def with_modes(model: Model) -> Model:
    """The model with the factors that its values name built in. Raises ModelError where only some are named."""
    given = [name for name in names() if name in model.values]
    if not given:
        return model
    apa = _softened(model)
    needed = names(len(apa.parts))
    if set(given) != set(needed):
        raise ModelError(f"model {model.name}: has {', '.join(given)}, expected all of {', '.join(needed)} or none")
    return replace(model, apa=apa)


def _softened(model: Model) -> Softened:
    body = model.apa(model.values)
    w2, shapes = linalg.eigh(body.K, body.M)
    momenta = (body.M @ shapes[:, ELASTIC_FROM : ELASTIC_FROM + MODES]).T
    parts = w2[ELASTIC_FROM : ELASTIC_FROM + MODES, None, None] * momenta[:, :, None] * momenta[:, None, :]
    return Softened(body, parts)
