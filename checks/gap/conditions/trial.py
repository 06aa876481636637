"""Responses of a unit under one condition, what that condition is to an explanation or to a simulated unit, and
explanations fitted to all conditions together, compared on realisations that none of them has seen.

Turned: the strut goes round by 180 degrees about its axis, with its APA, joints and encoder. In the bench's frame what
lies across the axis changes its sign (where the APA sits and pushes, where head and ruler are and are read) and the
matrices of the APA turn; what lies along z stays. The bench knows no x and y: granite that does not move, a payload
guided along z, a mode of the bench along z ([STB] 3.1, 6.1). Seen from the strut nothing has changed, so every response
stays what it was, whatever is wrong with the strut: what changes is the bench's, or the mounting's.

Another resistor across the sensor stack: its corner goes with one over it ([STB] 3.1.9). A stack that is stiffer
without a path for its charge ([IEEE176] 2) is open if the corner lies below the band, and closed far above it.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, FitPoint, coarse_fits, finish
from checks.fitting.prior import off_priors
from checks.gap.conditions.kinds import ADDED_MASS, OTHER_RESISTOR, OWN_RETURN, REMOVED, SIDE_MASSES, ExperimentKind
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.condition import Together, marked
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.shift import OwnValue, Shift
from checks.model.electrical import highpass_corner
from checks.model.model import Model
from checks.model.parameters import is_mode_factor
from checks.model.structure.attached import ELEMENT, TILT, quantities_of
from specs.errors import AcceptError

PAYLOAD, CORNER, STIFFENING = "bench.payload_kg", "sensor.highpass_Hz", "apa.sensor_stiffening"
BY_CABLE = ("sensor.crosstalk_V_per_V", "sensor.pickup_us")  # what couples into the sensor's cable
OPEN_HZ, CLOSED_HZ = 2.0, 20_000.0  # corners of a stack that is open, closed, at 5 Hz to 2 kHz
SENSOR_F = 5.1e-6  # of the sensor stack, the default ([STB] 3.1.9)
HIGHEST_HZ = 1e6  # of the sensor's corner
GONE = 1e-6  # of an element that was removed: what hangs with no mass at all has no motion
WIDER = 10.0  # a prior that says next to nothing, and still keeps a search from walking off for ever


class GapRefused(AcceptError, ValueError):
    """Records or a model that the workflow refuses; the text gives the reason."""


def check_same_unit(A: Dataset, B: Dataset) -> None:
    """Raise GapRefused if the two realisations differ by more than noise and tolerance: not the same thing twice."""
    both = A.noise + B.noise + 2.0 * (max(A.tolerance, 1e-3) * np.abs(A.H)) ** 2 if A.H.shape == B.H.shape else None
    if both is None:
        raise GapRefused(f"the two realisations have {A.f.size} and {B.f.size} bins; expected records of equal length")
    G = np.median(np.abs(A.H - B.H) ** 2 / both, axis=0)
    for channel, g in zip(A.channels, G, strict=True):
        if g > 4.0:
            raise GapRefused(
                f"{channel} of the two realisations differs by {np.sqrt(g):.1f} times noise and tolerance in half of "
                "the bins: these are not records of one unit on one bench"
            )


@dataclass(frozen=True, eq=False)
class ConditionTrial:
    """Responses under another condition. name: of its own among a unit's; value: in the unit of its kind; own_ohm: the
    unit's own resistor, where its folder states one. A: to fit; B: to judge with."""

    name: str
    kind: ExperimentKind
    value: float | None
    A: Dataset
    B: Dataset
    own_ohm: float | None = None

    @classmethod
    def of_records(
        cls, name: str, kind: ExperimentKind, value: float | None, A: Dataset, B: Dataset, own_ohm: float | None
    ) -> "ConditionTrial":
        """Return the trial of two measured realisations. Raises GapRefused if they are not of one unit."""
        check_same_unit(A, B)
        return cls(name, kind, value, A, B, own_ohm)

    @property
    def words(self) -> str:
        return self.kind.said(self.value)


def shift_of(
    name: str,
    kind: ExperimentKind,
    value: float | None,
    response: Augmented,
    own_ohm: float | None = None,
    sensor_F: float = SENSOR_F,
) -> Shift:
    """Return the shift that a condition makes in a response: of a mass on the payload or beside the strut's axis, of
    elements that are removed, of another cable. The sensor's corner goes with one over the resistor ([STB] 3.1.9) if
    the unit's own is known and the explanation has a corner; else it has a value of its own. Another level of drive
    changes nothing in a linear model, nor does a turn. Raises ModelError if the model cannot hold it."""
    if kind.value is not None and value is None:
        raise ModelError(f"experiment '{kind.name}' is given without its value")
    values = response.model.values
    needed = {ADDED_MASS: PAYLOAD, OTHER_RESISTOR: CORNER}.get(kind)
    if needed is not None and needed not in values:
        raise ModelError(f"{kind.said(value)}: model '{response.model.name}' has no {needed} that could change")
    if kind is ADDED_MASS:
        return Shift(name, adds=((PAYLOAD, value or 0.0),))
    if kind in SIDE_MASSES:
        return Shift(name, adds=tuple((f"{ELEMENT}{kind.place}.{d}.added_kg", value or 0.0) for d in "xyz"))
    if kind in REMOVED:
        at = [n for n in values if n.startswith(f"{ELEMENT}{kind.place}.") and not n.startswith(TILT)]
        sizes = [n for n in at if n.rpartition(".")[2] in quantities_of(n.split(".")[2]).values()]
        return Shift(name, times=tuple((n, GONE) for n in sizes))
    if kind is OWN_RETURN:
        return Shift(name, times=tuple((n, 0.0) for n in BY_CABLE if n in values))
    if kind is not OTHER_RESISTOR or value is None:
        return Shift(name)
    corner = highpass_corner(value, sensor_F)
    set_here = {t for e in response.effects for t in e.stands_for(response.model)} | set(response.model.sds)
    times: tuple[tuple[str, float], ...] = ()
    if STIFFENING in set_here or values.get(STIFFENING):
        times = ((STIFFENING, share_open(corner)),)
    if own_ohm and (CORNER in set_here or values[CORNER] > 0.0):
        return Shift(name, times=(*times, (CORNER, own_ohm / value)))
    free = Free(f"{name}.highpass_Hz", prior=0.0, lo=0.0, hi=HIGHEST_HZ, start=corner, scale=0.1 * corner)
    return Shift(name, times=times, own=(OwnValue(CORNER, free),))


def share_open(corner_Hz: float) -> float:
    """Return the share of the open circuit's stiffening that remains at a corner [Hz]: 0 or 1. Raises ModelError in
    between, if the stack is neither open nor closed over the band."""
    if OPEN_HZ < corner_Hz < CLOSED_HZ:
        raise ModelError(
            f"a resistor that puts the sensor stack's corner at {corner_Hz:.3g} Hz leaves a stack that is stiffer when "
            f"open neither open nor closed; expected a corner up to {OPEN_HZ:g} Hz, or from {CLOSED_HZ:g} Hz on"
        )
    return 1.0 if corner_Hz <= OPEN_HZ else 0.0


def under_experiment(model: Model, kind: ExperimentKind, value: float | None, sensor_F: float | None = None) -> Model:
    """Return a model of a unit as it is under an experiment; the drive's level is not a parameter of it. sensor_F: of
    the sensor stack, if it was measured. Raises ModelError."""
    known = Augmented(replace(model, sds={}))  # a simulated unit has no uncertain values
    shift = shift_of(kind.name, kind, value, known, sensor_F=SENSOR_F if sensor_F is None else sensor_F)
    changes = shift.applied({}, {p.name: p.begin for p in shift.free}, model.values)
    return _with_room(model, (shift,)).with_values(changes) if changes else model


def together(response: Augmented, trials: Sequence[ConditionTrial]) -> Together:
    """Return a response under all conditions. Raises ModelError."""
    shifts = tuple(shift_of(t.name, t.kind, t.value, response, t.own_ohm) for t in trials)
    return Together(replace(response, model=_with_room(response.model, shifts)), shifts)


@lru_cache(maxsize=64)
def _with_room(model: Model, shifts: tuple[Shift, ...]) -> Model:
    """Return the model with elements of no mass where a condition attaches one. Cached, as its matrices are by the
    model."""
    more = {n: 0.0 for s in shifts for n, _ in s.adds if n not in model.values}
    return model.with_elements({**model.elements, **more}) if more else model


def to_fit(A: Dataset, trials: Sequence[ConditionTrial]) -> list[Dataset]:
    """Return the realisations to fit, of the unit as it is and under every condition."""
    return [A, *(marked(t.A, t.name) for t in trials)]


@dataclass(frozen=True, eq=False)
class JointFit:
    """An explanation fitted to A of all conditions. lnL: the log-likelihood of B of all at these values, priors
    included, but for a constant."""

    response: Augmented
    fit: Fit
    lnL: float


@dataclass(frozen=True, eq=False)
class Conditions:
    """The data that explanations are fitted to: A and B of the unit as it is, and every condition."""

    A: Dataset
    B: Dataset
    trials: tuple[ConditionTrial, ...]

    def thinned(self, bins: int) -> "Conditions":
        trials = tuple(replace(t, A=t.A.thinned(bins), B=t.B.thinned(bins)) for t in self.trials)
        return Conditions(self.A.thinned(bins), self.B.thinned(bins), trials)

    def explained(self, response: Augmented, at: Mapping[str, float], far: bool = False) -> JointFit:
        """Return a response fitted to all conditions from values nearby; far: also over wide tolerances, because
        they may lie elsewhere. Raises ModelError."""
        every, sets = together(response, self.trials), to_fit(self.A, self.trials)
        joint, free = response.model.joint, tuple(every.free(at))
        ways = [FitPoint(free, 0.0), *(coarse_fits(every, sets, free, joint=joint)[:1] if far else ())]
        fits = []
        for way in ways:
            with suppress(ModelError):
                fits.append(finish(every, sets, way, joint=joint))
        if not fits:
            raise ModelError("no values of the explanation come near these responses")
        best = min(fits, key=lambda f: f.cost)
        unseen = (self.B, *(marked(t.B, t.name) for t in self.trials))
        rows = [d.whitener(d.H - every.frf(d.f, best.at, d.channels)) for d in unseen]
        off = off_priors(best.free, best.at, best.joint)
        return JointFit(response, best, -0.5 * float(sum(r @ r for r in rows) + off @ off))


def by_data_alone(response: Augmented, effect: Effect) -> Augmented:
    """Return the same with very wide priors of its calibrated values. The modes of an APA, which would fit anything if
    they were free, and the parameters of the effect itself keep their priors."""
    return replace(response, model=_hardly_known(response.model, effect.stands_for(response.model)))


@lru_cache(maxsize=8)
def _hardly_known(model: Model, kept: tuple[str, ...]) -> Model:
    wider = {n: 1.0 if is_mode_factor(n) or n in kept else WIDER for n in model.sds}
    joint = model.joint
    if joint is not None:
        by = np.diag([wider.get(n, 1.0) for n in joint.names])
        joint = replace(joint, covariance=by @ joint.covariance @ by)
    return replace(model, sds={n: wider[n] * sd for n, sd in model.sds.items()}, joint=joint)
