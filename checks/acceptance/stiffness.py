"""Axial stiffness from the deflection under an added mass, circuit closed and open ([STB] 3.1.7, 3.1.8, 3.2.1)."""

import math
from dataclasses import dataclass, replace

import numpy as np

from checks.acceptance.common.typed_value import of_record, stated_contribution, typed_quantity
from checks.arrays import Array
from checks.cause import Cause, NoResult, Reason, because, record_label
from checks.declare import Check, Form, Guide, Measured, Scalar, Series, Setting, Values
from checks.picture import Line, Mark, Panel, PanelKind
from checks.quantity import COVERAGE_FACTOR, Contribution, Outcome, Quantity
from checks.record import Record
from checks.signals.slow.creep import CreepFit, fit_creep
from checks.signals.slow.loops import ScalarEstimate, thin
from checks.signals.slow.regression import colour
from checks.signals.slow.steps import REACH_S, SignalStep, find_steps
from specs.spec import CheckSpec

UM = 1e-6
N_PER_UM = 1e6
GRAVITY, GRAVITY_U = 9.80665, 0.027  # m/s2: from 9.780 at the equator to 9.832 at the poles
MASS_KG = 6.4  # added by [STB] 3.1.7
MIN_PLATEAU_S = 2.0  # a shorter one does not separate creep from the step
MAX_DISAGREEMENT = 0.1  # of the deflection, between adding and removing: beyond it something slipped
SLOW_S = 1.0  # creep over a decade of seconds is determined by means over so long
MAX_MISFIT = 0.02  # of the deflection: rms of the residual of the creep law
# The windows of [STB] 3.1.7 (12-12.5 s and 20-20.5 s by its clock) relative to its mass step at about 15 s.
BEFORE_S = (-3.0, -2.5)
LOADED_S = (5.0, 5.5)
RECORDS = {"closed_circuit": "k_closed_N_per_um", "open_circuit": "k_open_N_per_um"}


@dataclass(frozen=True, eq=False)
class Deflection:
    """Deflection in one record: deflection [m] 0.1 s after the step, mean of adding and removing, with its scatter; its
    uncertainty from the moments of the steps [m]; the windowed deflection of [STB] 3.1.7 [m] or the reason why it is
    missing; steps, whose u_t holds how long the mass took to come down; the fit."""

    value: ScalarEstimate
    u_moment: float
    windowed: ScalarEstimate | Reason
    steps: tuple[SignalStep, SignalStep]
    creep: CreepFit
    t: Array
    de: Array


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return the stiffness k = m g / deflection 0.1 s after the step [N/um], circuit closed and open, and their ratio.

    Beside it the windowed value of [STB] 3.1.7, taken seconds later and so softer by the creep. A piezo with open
    circuit is stiffer than with closed circuit, whatever its stiffness: a ratio below 1 by three standard uncertainties
    shows that the records are exchanged."""
    if "k_N_per_um" in values:
        typed = typed_quantity(values, spec, "k_N_per_um", "k_closed_N_per_um")
        missing = (Quantity.missing(other, Cause.RECORD_NEEDED) for other in CHECK.quantities if other != typed.name)
        return Outcome((typed, *missing))
    if "mass_kg" not in values:
        raise NoResult(Cause.ENTRY_MISSING, entry="added mass (mass_kg)")
    found = {key: of_record(values, key, deflection_of) for key in RECORDS}
    closed, opened = found["closed_circuit"], found["open_circuit"]
    good = {key: f for key, f in found.items() if isinstance(f, Deflection)}
    panels = {name: panel for key, f in good.items() for name, panel in _panels(key, f).items()}
    ratio = _ratio(closed, opened)
    if ratio.reason is None and ratio.value + 1.5 * (ratio.U or 0.0) < 1.0:
        exchanged = because(Cause.CIRCUITS_EXCHANGED, ratio=ratio.value)
        return Outcome(tuple(Quantity.missing(name, exchanged) for name in CHECK.quantities), panels=panels)
    quantities = (
        _stiffness("k_closed_N_per_um", closed, values["mass_kg"], spec),
        _stiffness("k_open_N_per_um", opened, values["mass_kg"], spec),
        ratio,
        _windowed_stiffness("k_closed_windowed_N_per_um", closed, values["mass_kg"], spec),
        _creep_rate("creep_per_decade_percent", closed),
    )
    return Outcome(quantities, tuple(_direction_notes(good)), panels)


def deflection_of(record: Record) -> Deflection:
    """Return the deflection in a record with channel de [m] in which a mass is added once and removed once (or the
    other way round). Raises NoResult if it does not hold two such steps with enough record about them."""
    t, de = record.t, record["de"]
    steps = _two_steps(t, find_steps(t, de))
    creep = fit_creep(t, de, steps)
    first, second = (float(d) for d in creep.deflections)
    # The two steps are all the repeats there are: half of their difference is the scatter of their mean.
    value, half = abs(first - second) / 2, abs(first + second) / 2
    if creep.fit.scatter > MAX_MISFIT * value:
        raise NoResult(Cause.CREEP_MISFIT, percent=100 * creep.fit.scatter / value)
    if half > MAX_DISAGREEMENT / 2 * value:
        raise NoResult(Cause.STEPS_DIFFER, first=abs(first) / UM, second=abs(second) / UM)
    mean = ScalarEstimate(value, math.hypot(creep.u_of((0.5, -0.5)) * _slower(creep, t), half))
    # A load that comes down within 50 ms has no one moment: anywhere in its passage is as good.
    on, away = (replace(s, u_t=math.hypot(s.u_t, _step_duration(t, de, s) / math.sqrt(12.0))) for s in steps)
    u_moment, windowed = creep.u_moment((0.5, -0.5), (on, away)), _windowed_deflection(t, de, steps)
    return Deflection(value=mean, u_moment=u_moment, windowed=windowed, steps=(on, away), creep=creep, t=t, de=de)


def _two_steps(t: Array, steps: list[SignalStep]) -> tuple[SignalStep, SignalStep]:
    if len(steps) != 2:
        where = f" at {', '.join(f'{s.t:.2f}' for s in steps)} s" if steps else ""
        raise NoResult(Cause.STEP_COUNT, found=len(steps), where=where)
    first, second = steps
    if first.height * second.height > 0:
        raise NoResult(Cause.STEPS_SAME_WAY, first=first.t, second=second.t)
    edges = [t[0], first.quiet_to, first.quiet_from, second.quiet_to, second.quiet_from, t[-1]]
    for lo, hi, name in zip(edges[::2], edges[1::2], ("before", "between", "after"), strict=True):
        if hi - lo < MIN_PLATEAU_S:
            raise NoResult(Cause.STEP_PLATEAU, seconds=hi - lo, where=name, needed=MIN_PLATEAU_S)
    for s in steps:
        if s.quiet_from - s.t > 1.4 * REACH_S:
            raise NoResult(Cause.STEP_NOT_SETTLED, channel="de", at=s.t, needed=REACH_S)
    return first, second


def _windowed_deflection(t: Array, de: Array, steps: tuple[SignalStep, SignalStep]) -> ScalarEstimate | Reason:
    """Return the deflection as in [STB] 3.1.7: of means over half a second, before the first step and under load."""
    origin = steps[0].t
    if origin + LOADED_S[1] > steps[1].quiet_to or origin + BEFORE_S[0] < t[0]:
        return because(Cause.STEP_WINDOWS, before=_span(BEFORE_S), loaded=_span(LOADED_S))
    before, loaded = (_window_mean(t, de, origin + lo, origin + hi) for lo, hi in (BEFORE_S, LOADED_S))
    return ScalarEstimate(abs(before.value - loaded.value), math.hypot(before.u, loaded.u))


def _span(window: tuple[float, float]) -> str:
    return f"{window[0]:g} to {window[1]:g}"


def _window_mean(t: Array, de: Array, lo: float, hi: float) -> ScalarEstimate:
    inside = de[(t > lo) & (t < hi)]
    residual = inside - inside.mean()
    return ScalarEstimate(float(inside.mean()), math.sqrt(inside.var(ddof=1) * colour(residual) / inside.size))


def _stiffness(name: str, found: Deflection | Reason, mass: Measured, spec: CheckSpec) -> Quantity:
    if isinstance(found, Reason):
        return Quantity.missing(name, found)
    moment = Contribution("moment of the steps", found.u_moment / found.value.value, "A")
    return _load_over(name, found.value, [moment], mass, spec)


def _windowed_stiffness(name: str, found: Deflection | Reason, mass: Measured, spec: CheckSpec) -> Quantity:
    windowed = found if isinstance(found, Reason) else found.windowed
    if isinstance(windowed, Reason):
        return Quantity.missing(name, windowed)
    return _load_over(name, windowed, [], mass, spec)


def _load_over(
    name: str, deflection: ScalarEstimate, relative: list[Contribution], mass: Measured, spec: CheckSpec
) -> Quantity:
    """Return k = m g / deflection with its budget; `relative`: further contributions, relative to the value."""
    gravity = float(spec.settings.get("gravity", GRAVITY))
    gravity_U = float(spec.settings.get("gravity_U", GRAVITY_U))
    k = mass.value * gravity / deflection.value / N_PER_UM
    shares = [Contribution("scatter of the record", deflection.u / deflection.value, "A"), *relative]
    shares.append(Contribution("local gravity", gravity_U / COVERAGE_FACTOR / gravity))
    budget = [Contribution(c.source, k * c.u, c.kind) for c in shares if c.u > 0]
    systematic = _systematic(k, deflection.value, mass, spec)
    if not systematic:
        return Quantity(name, k, None, tuple(budget), note="accuracy of the mass and the encoder not stated")
    return Quantity.of(name, k, *budget, *systematic)


def _systematic(k: float, deflection: float, mass: Measured, spec: CheckSpec) -> list[Contribution]:
    """Return the contributions of mass and encoder as stated, else the spec's one figure for both, else nothing."""
    if mass.U is not None:
        weight: Contribution | None = Contribution("added mass, stated with it", mass.U / COVERAGE_FACTOR)
    else:
        weight = stated_contribution(spec, mass.value, "mass_kg")
    encoder = stated_contribution(spec, deflection / UM, "de_um")
    if weight is not None and encoder is not None:
        return [
            Contribution(weight.source, k * weight.u / mass.value),
            Contribution(encoder.source, k * encoder.u * UM / deflection),
        ]
    whole = stated_contribution(spec, k, "k_N_per_um")
    return [] if whole is None else [whole]


def _ratio(closed: Deflection | Reason, opened: Deflection | Reason) -> Quantity:
    """Return k_open / k_closed: mass, gravity and encoder are the same in both and cancel."""
    if isinstance(closed, Reason):
        return Quantity.missing("k_ratio", closed)
    if isinstance(opened, Reason):
        return Quantity.missing("k_ratio", opened)
    ratio = closed.value.value / opened.value.value
    budget = [
        Contribution(f"{words}, {name}", ratio * u / f.value.value, "A")
        for name, f in (("closed", closed), ("open", opened))
        for words, u in (("scatter", f.value.u), ("moment of the steps", f.u_moment))
    ]
    return Quantity.of("k_ratio", ratio, *budget)


def _creep_rate(name: str, found: Deflection | Reason) -> Quantity:
    """Return the creep per decade of time [percent of the deflection], mean of the two steps."""
    if isinstance(found, Reason):
        return Quantity.missing(name, found)
    creep = found.creep
    weights = np.zeros(creep.fit.x.size)
    weights[3::2] = 0.5 / creep.deflections
    # A mass that settles makes both moments late: they add.
    moments = np.abs(0.5 * creep.gamma_per_moment.sum(axis=0) * [s.u_t for s in found.steps])
    settling = creep.gamma.mean() - creep.later.mean()
    apart = 0.5 * abs(creep.gamma[0] - creep.gamma[1])  # two repeats are all there are
    budget = [
        Contribution("scatter of the record", 100 * creep.fit.u(weights) * _slower(creep, found.t), "A"),
        Contribution("moment of the steps", 100 * float(moments.sum()), "A"),
        Contribution("settling of the mass: creep from 0.3 s on", 100 * abs(float(settling)), "A"),
        Contribution("adding against removing", 100 * float(apart), "A"),
    ]
    return Quantity.of(name, 100 * float(creep.gamma.mean()), *(c for c in budget if np.isfinite(c.u)))


def _step_duration(t: Array, de: Array, step: SignalStep) -> float:
    """Return the duration [s] of a step from a tenth to nine tenths of its height."""
    near = np.abs(t - step.t) < 0.3
    before = de[(t > step.t - 0.6) & (t < step.t - 0.1)]
    if not before.size:
        return 0.0
    risen = (de[near] - np.median(before)) / step.height
    return float(np.count_nonzero((risen > 0.1) & (risen < 0.9)) * (t[-1] - t[0]) / (t.size - 1))


def _slower(creep: CreepFit, t: Array) -> float:
    """Return the factor by which the residual scatters more over seconds, the time scale of creep, than its `colour`
    over some hundredths of a second implies: the noise of a floor grows towards low frequencies."""
    residual = creep.fit.residual
    n = max(1, round(SLOW_S * (t.size - 1) / (t[-1] - t[0])))
    parts = residual[: residual.size // n * n].reshape(-1, n)
    if len(parts) < 4:
        return 1.0
    over = n * float(np.var(parts.mean(axis=1), ddof=1)) / max(float(np.var(residual)), 1e-300)
    return math.sqrt(max(1.0, over / colour(residual)))


def _direction_notes(found: dict[str, Deflection]) -> list[str]:
    return [
        f"{record_label(key)}: de rises at the first step; either the mass was removed first or the encoder counts the "
        "other way"
        for key, f in found.items()
        if f.steps[0].height > 0
    ]


def _panels(key: str, f: Deflection) -> dict[str, Panel]:
    name = key.replace("_", " ")
    t, zero = f.t - f.t[0], f.creep.model[0]
    curve = Line(thin(t), thin(f.de - zero) / UM, "encoder", role="data")
    model = Line(thin(t), thin(f.creep.model - zero) / UM, "steps with creep", "dashed", "model")
    marks = tuple(Mark(s.t - f.t[0], label="step", role="quiet") for s in f.steps)
    left = Line(thin(t[f.creep.used]), thin(f.creep.fit.residual) / UM, "residual", "points", "data")
    return {
        key: Panel(
            f"Mass added and removed, {name}",
            "time [s]",
            "deflection [um]",
            (curve, model, *marks),
            kind=PanelKind.CURVE,
        ),
        f"{key}_residual": Panel(
            f"What the fit leaves, {name}", "time [s]", "residual [um]", (left,), kind=PanelKind.CURVE
        ),
    }


_CHANNELS = {"t": "s", "de": "m"}
PICTURE = """\
      6.4 kg  ┌───┐  on at 15 s
              │ m │  off at 22 s
            ┌─┴───┴─┐
            │payload│
            └─┬───┬─┘
   encoder ─▶ │APA│
            ──┴───┴──  granite"""

CHECK = Check(
    name="stiffness",
    title="Axial stiffness from an added mass",
    short="Stiffness",
    kinds=("apa",),
    forms=(
        Form("values", (Scalar("k_N_per_um", "axial stiffness, circuit closed", lo=0.01, hi=1000.0),)),
        Form(
            "records",
            (
                Series(
                    "closed_circuit",
                    "mass added and removed, stacks on the amplifier",
                    _CHANNELS,
                    called="closed circuit",
                ),
                Series(
                    "open_circuit",
                    "mass added and removed, stacks open",
                    _CHANNELS,
                    optional=True,
                    called="open circuit",
                ),
                Scalar("mass_kg", "added mass", lo=0.01, hi=1000.0, usual=(2.0, 15.0)),
            ),
        ),
    ),
    quantities={
        "k_closed_N_per_um": "Stiffness, closed circuit",
        "k_open_N_per_um": "Stiffness, open circuit",
        "k_ratio": "Stiffness, open over closed",
        "k_closed_windowed_N_per_um": "Stiffness, by time windows",
        "creep_per_decade_percent": "Creep per decade",
    },
    measure=measure,
    settings=(
        Setting("mass_kg", MASS_KG, "added mass; by another one, only the bench file's, nothing is accepted"),
        Setting("gravity", GRAVITY, "acceleration of gravity on the bench [m/s2]", positive=True),
        Setting(
            "gravity_U", GRAVITY_U, "its expanded uncertainty [m/s2]; where it is not known, that of the whole globe"
        ),
    ),
    stated=("k_N_per_um", "mass_kg", "de_um"),
    failed="weigh the added mass and repeat; if it stays, the shell is too soft or too stiff",
    guide=Guide(
        "Weigh the mass. Connect the amplifier and record the encoder: add the mass at 15 s, remove it at 22 s. "
        "Disconnect the stacks and repeat.",
        PICTURE,
        drive="none; the amplifier holds 0 V, then the stacks are open",
    ),
)
