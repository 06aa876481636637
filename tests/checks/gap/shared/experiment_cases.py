"""Units whose responses alone do not say what is missing, drawn at random, and the experiments they are asked for."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from accept.models.model_file import open_model
from checks.gap.conditions.kinds import EXPERIMENT_KINDS
from checks.gap.conditions.trial import ConditionTrial, under_experiment
from checks.gap.decision.result import Result
from checks.gap.effects import with_effects
from checks.gap.workflow import Inputs, run
from checks.model import Model
from tests.checks.gap.shared.gap_cases import FS, TOLERANCE, recorded

BINS = 150
ENTRY = re.compile(r'kind = "(\w+)"(?:, \w+ = ([\d.]+))?')


@cache
def known(*pairs: tuple[str, float]) -> Model:
    """The 2-DoF APA with some of its uncertain values better known: it has exact aliases ([GAP] 6)."""
    model = replace(open_model("apa-2dof"), tolerance=TOLERANCE)
    return replace(model, sds={**model.sds, **dict(pairs)})


SPRINGS = (
    ("constants.ga_N_per_V", 0.3),
    ("apa.k_N_per_um", 0.004),
    ("apa.ke_N_per_um", 0.01),
    ("apa.ka_N_per_um", 0.3),
)
DAMPERS = (("apa.c_N_s_per_m", 0.3), ("apa.ce_N_s_per_m", 0.2), ("apa.ca_N_s_per_m", 0.2))
SENSOR = (("constants.gs_V_per_N", 5e-4), ("apa.ka_N_per_um", 0.3), ("constants.ga_N_per_V", 0.3))


@dataclass(frozen=True, eq=False)
class Case:
    """model: to start from; truth: of the unit; effect: what is in it, "" where only its values are others."""

    model: Model
    truth: Model
    effect: str
    seed: int

    def told(self, *trials: ConditionTrial) -> Result:
        A, B = (recorded(self.truth, 10 * self.seed + k).thinned(BINS) for k in (1, 2))
        return run(Inputs(self.model, A, B, FS, trials=trials), lambda _: None)

    def trial(self, kind: str, value: float | None, truth: Model | None = None) -> ConditionTrial:
        model = under_experiment(truth or self.truth, EXPERIMENT_KINDS[kind], value)
        A, B = (recorded(model, 10 * self.seed + k).thinned(BINS) for k in (3, 4))
        return ConditionTrial(kind, EXPERIMENT_KINDS[kind], value, A, B)

    def asked(self, result: Result) -> ConditionTrial | None:
        """The experiment that the answer asks for, where it can be given."""
        found = ENTRY.search(result.ambiguous[0].experiment)
        return None if found is None else self.trial(found[1], float(found[2]) if found[2] else None)


def with_effect(model: Model, seed: int, effect: str, values: Mapping[str, float]) -> Case:
    return Case(model, with_effects(_drawn(model, seed), [(effect, values)]), effect, seed)


def scaled(model: Model, seed: int, factor: float) -> Case:
    """Force, stiffness and damping alike by a factor: what a payload would be that is heavier by one over it."""
    names = [n for n, _ in (*SPRINGS, *DAMPERS)]
    return Case(model, model.with_values({n: factor * model.values[n] for n in names}), "", seed)


def _drawn(model: Model, seed: int) -> Model:
    rng, c = np.random.default_rng([seed, 5]), model.calibrated
    away = np.clip(rng.standard_normal(len(c.names)), -1.5, 1.5)
    return model.with_values(dict(zip(c.names, (c.values + away * c.sds).tolist(), strict=True)))


def random_case(seed: int) -> Case:
    """One of several pairs that responses alone do not tell apart."""
    rng = np.random.default_rng([seed, 11])
    sign = float(rng.choice([-1.0, 1.0]))
    which = seed % 4
    if which == 0:
        return with_effect(known(*SPRINGS, *DAMPERS), seed, "payload_mass", {"kg": sign * rng.uniform(0.5, 1.2)})
    if which == 1:
        return scaled(known(*SPRINGS, *DAMPERS), seed, float(1.0 + sign * rng.uniform(0.10, 0.2)))
    if which == 2:
        return with_effect(known(*SENSOR), seed, "crosstalk", {"V_per_V": sign * rng.uniform(0.01, 0.03)})
    stiff = (("apa.ke_N_per_um", 0.02), ("constants.ga_N_per_V", 0.5))
    return with_effect(known(*stiff), seed, "open_circuit_stiffening", {"ratio": rng.uniform(0.3, 1.0)})
