"""Responses of a unit under one condition, and what that condition is to an explanation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.gap.conditions.kinds import ADDED_MASS, OTHER_RESISTOR, ExperimentKind
from checks.gap.conditions.simulated import CORNER, PAYLOAD, SENSOR_F, STIFFENING, share_open
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.condition import Together, marked
from checks.gap.modelling.shift import OwnValue, Shift
from checks.model.electrical import highpass_corner

HIGHEST_HZ = 1e6  # of the sensor's corner


@dataclass(frozen=True, eq=False)
class ConditionTrial:
    """name: of its own among a unit's; value: in the unit of its kind; own_ohm: the unit's own resistor, where its
    folder states one. A: to fit; B: to judge with."""

    name: str
    kind: ExperimentKind
    value: float | None
    A: Dataset
    B: Dataset
    own_ohm: float | None = None

    @property
    def words(self) -> str:
        return self.kind.said(self.value)

    def select(self, channels: Sequence[str], bins: int | None = None) -> "ConditionTrial":
        """Return the trial with some of its channels, thinned to at most so many bins."""
        A, B = (d.select(channels) for d in (self.A, self.B))
        return replace(self, A=A, B=B) if bins is None else replace(self, A=A.thinned(bins), B=B.thinned(bins))


def shift_of(trial: ConditionTrial, response: Augmented) -> Shift:
    """Return the shift that a condition makes in an explanation. Raises ModelError if the model cannot hold it.

    A mass is added to the payload. The sensor's corner goes with one over the resistor ([STB] 3.1.9) if the unit's own
    is known and the explanation has a corner; else it has a value of its own. Another level of drive changes nothing in
    a linear model, nor does a turn (see `simulated`)."""
    if trial.kind is ADDED_MASS and trial.value is not None:
        _held(PAYLOAD, trial, response)
        return Shift(trial.name, adds=((PAYLOAD, trial.value),))
    if trial.kind is OTHER_RESISTOR and trial.value is not None:
        _held(CORNER, trial, response)
        corner, values = highpass_corner(trial.value, SENSOR_F), response.model.values
        set_here = {t for e in response.effects for t in e.stands_for(response.model)} | set(response.model.sds)
        times: tuple[tuple[str, float], ...] = ()
        if STIFFENING in set_here or values.get(STIFFENING):
            times = ((STIFFENING, share_open(corner)),)
        if trial.own_ohm and (CORNER in set_here or values[CORNER] > 0.0):
            return Shift(trial.name, times=(*times, (CORNER, trial.own_ohm / trial.value)))
        name = f"{trial.name}.highpass_Hz"
        free = Free(name, prior=0.0, lo=0.0, hi=HIGHEST_HZ, start=corner, scale=0.1 * corner)
        return Shift(trial.name, times=times, own=(OwnValue(CORNER, free),))
    return Shift(trial.name)


def _held(parameter: str, trial: ConditionTrial, response: Augmented) -> None:
    if parameter not in response.model.values:
        raise ModelError(f"{trial.words}: model '{response.model.name}' has no {parameter} that could change")


def together(response: Augmented, trials: Sequence[ConditionTrial]) -> Together:
    """Return a response under all conditions. Raises ModelError."""
    return Together(response, tuple(shift_of(t, response) for t in trials))


def to_fit(A: Dataset, trials: Sequence[ConditionTrial]) -> list[Dataset]:
    """Return the realisations to fit, of the unit as it is and under every condition."""
    return [A, *(marked(t.A, t.name) for t in trials)]


def to_judge(B: Dataset, trials: Sequence[ConditionTrial]) -> list[Dataset]:
    """Return the realisations to judge with."""
    return [B, *(marked(t.B, t.name) for t in trials)]
