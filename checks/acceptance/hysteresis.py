"""Hysteresis loops under slow sines of growing amplitude ([STB] 3.1.6).

A strut without encoder (`strut-plates`) gives da in the place of de."""

import math
from dataclasses import dataclass

import numpy as np

from checks.acceptance.common.piezo_lag import vet_lag, vet_noise
from checks.acceptance.common.typed_value import stated_contribution
from checks.arrays import Array
from checks.cause import Cause, NoResult, because
from checks.declare import Check, Form, Guide, Series, Setting, Values
from checks.picture import Band, Line, Panel, PanelKind
from checks.quantity import COVERAGE_FACTOR, Contribution, Outcome, Quantity
from checks.record import Record, motion_of
from checks.signals.slow.loops import Cycle, ScalarEstimate, last_cycles, longest_stand, thin
from checks.signals.slow.regression import least_squares
from specs.bench import GAIN_UM_PER_V, RECORDED_V
from specs.spec import CheckSpec
from specs.units import CHANNEL_LABELS

UM = 1e-6
CENTRE_LINE_DEGREE = 5  # of the polynomial in V through the middle of the loop
MAX_MISFIT = 0.02  # at the largest amplitude; at small ones it is the noise, and U says so
MIN_AMPLITUDE_V = 0.0  # a spec may require more
LOOP_PERCENT = 0.0  # a spec may require more: see piezo_lag.py
USUAL_PERCENT = 1.0  # loss of soft PZT at small signals ([DAMJANOVIC98])
STUCK = 0.1  # of the drive's peak to peak: no actuator stands still over so much of it, not even after a turn


@dataclass(frozen=True, eq=False)
class Loop:
    """The loop at one amplitude. width : opening at mid-voltage relative to the peak to peak of the response, positive
    if the response lags; misfit : rms of the residual of the loop's shape, relative to half the peak to peak; drive,
    response : (n,) samples of its period, centred; one_sample : of that period [rad]."""

    amplitude: float
    width: ScalarEstimate
    misfit: float
    drive: Array
    response: Array
    one_sample: float


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return the loop width of the displacement [percent] at largest and smallest amplitude; also of Vs if recorded.

    The width is the opening at mid-voltage relative to the peak to peak of the displacement, of the last period of each
    amplitude. A high-pass turns the loop of Vs into the same ellipse at every amplitude, so its hysteresis is the width
    at the largest amplitude minus that at the smallest."""
    if "record" not in values:
        raise NoResult(Cause.NOT_MEASURED, record="record")
    record: Record = values["record"]
    cycles = _cycles(record, float(spec.settings.get("min_amplitude_V", MIN_AMPLITUDE_V)))
    motion = motion_of(record.channels)
    loops = _loops(record, motion, cycles)
    levels, centre = ", ".join(f"{loop.amplitude:.3g}" for loop in loops), round(cycles[-1].centre, 6) + 0.0
    notes = [f"loops at {levels} V about {centre:.3g} V of Va"]
    _check_loop(loops[-1], motion, spec)
    if float(loops[-1].drive @ loops[-1].response) < 0.0:
        notes.append(f"{motion} falls while Va rises: the {CHANNEL_LABELS[motion].split()[0]} counts the other way")
    width = _check_gain(_width("hysteresis_percent", loops[-1], motion, spec), loops[-1], motion, spec)
    notes += _note_of_no_hysteresis(width)
    largest = loops[-1]
    gain = float(np.ptp(largest.response)) / (2 * largest.amplitude) / UM  # tip to tip
    quantities = [
        width,
        _small_signal_width(loops, motion, spec),
        Quantity("hysteresis_amplitude_V", largest.amplitude),
        Quantity("hysteresis_gain_um_per_V", gain),  # as accurate as the motion, which this check does not state
    ]
    panels = _panels("displacement", "displacement [um]", 1 / UM, loops)
    if "Vs" in record.channels:
        sensor = _loops(record, "Vs", cycles)
        quantities.append(_sensor(sensor))
        panels |= _panels("sensor", "Vs [V]", 1.0, sensor)
    else:
        quantities.append(Quantity.missing("sensor_hysteresis_percent", because(Cause.CHANNEL_MISSING, channel="Vs")))
    return Outcome(tuple(quantities), tuple(notes), panels)


def _cycles(record: Record, at_least: float) -> list[Cycle]:
    largest = float(np.abs(record["Va"]).max())
    if largest > RECORDED_V:
        raise NoResult(Cause.DRIVE_BEHIND_AMPLIFIER, value=largest, most=RECORDED_V)
    cycles = last_cycles(record["Va"])
    if not cycles:
        raise NoResult(Cause.NO_SINE)
    if cycles[-1].amplitude < 0.98 * at_least:
        raise NoResult(Cause.SINE_SMALL, value=cycles[-1].amplitude, needed=at_least)
    return cycles


def _check_loop(loop: Loop, motion: str, spec: CheckSpec) -> None:
    """Raise NoResult for a loop that no piezo actuator makes: too exact, too narrow, or the motion ahead of Va by more
    than the one sample of a shift in storing."""
    ahead = -loop.width.value
    if ahead > loop.one_sample + 3 * loop.width.u:
        raise NoResult(Cause.RESPONSE_LEADS, channel=motion, percent=100 * ahead, amplitude=loop.amplitude)

    vet_noise(motion, loop.misfit)
    least = float(spec.settings.get("loop_min_percent", LOOP_PERCENT))
    if least > 0.0:
        vet_lag(motion, "Va", loop.width, 1.0, least)


def _check_gain(width: Quantity, loop: Loop, motion: str, spec: CheckSpec) -> Quantity:
    """Return the width. Its uncertainty is unknown, so that it cannot pass, if the motion per volt is not an
    actuator's: a width is a ratio, whatever its scale. A width above its limit still fails."""
    lo, hi = (float(g) for g in spec.settings.get("gain_um_per_V", GAIN_UM_PER_V))
    gain = float(np.ptp(loop.response)) / (2 * loop.amplitude) / UM
    return width if lo <= gain <= hi else width.doubted(Cause.WRONG_GAIN, channel=motion, gain=gain, lo=lo, hi=hi)


def _loops(record: Record, channel: str, cycles: list[Cycle]) -> list[Loop]:
    cycle = cycles[-1]
    at, passed = longest_stand(record["Va"][cycle.samples], record[channel][cycle.samples])
    if passed > STUCK * 2 * cycle.amplitude:
        raise NoResult(Cause.CHANNEL_STUCK, channel=channel, reference="Va", sample=cycle.start + at, span=passed)
    loops = [loop_of(record["Va"][c.samples], record[channel][c.samples], c, channel) for c in cycles]
    if not loops[-1].misfit <= MAX_MISFIT:
        raise NoResult(Cause.NO_RESPONSE, channel=channel, amplitude=cycles[-1].amplitude)
    return loops


def loop_of(drive: Array, response: Array, cycle: Cycle, name: str = "response") -> Loop:
    """Return the loop of a period, drive and response (n,).

    response = centre line (a polynomial of the drive) + drift - opening/2 on the way up, + opening/2 on the way down.
    The opening closes at both ends: cos for a phase shift (an ellipse), cos |cos| for Rayleigh's parabolas, the latter
    also skewed and bulged. All is linear, so the width has its uncertainty from the scatter. Rayleigh's law:
    [BERTOTTI98] 2.3. Raises NoResult if the response stands still or the samples show no loop."""
    v, angle = (drive - cycle.centre) / cycle.amplitude, cycle.angle
    up, sine = np.cos(angle), np.sin(angle)
    rayleigh = up * np.abs(up)
    opening = [up, rayleigh, up * sine, rayleigh * sine, rayleigh * sine**2]
    drift = np.linspace(-0.5, 0.5, v.size)
    line = [v**k for k in range(CENTRE_LINE_DEGREE + 1)]
    design = np.column_stack([*line, *opening, drift])
    try:
        fit = least_squares(design, response)
    except ValueError as e:  # noise whose crossings were taken for periods of a few samples
        raise NoResult(Cause.NO_SINE) from e
    to_width = np.zeros(fit.x.size)
    to_width[len(line) : len(line) + 2] = -2.0  # down minus up, at sine = 0 and |cos| = 1
    # Peak to peak of the fitted loop without its drift; positive where the response rises with the drive.
    design[:, -1] = 0.0
    fitted = design @ fit.x
    top, bottom = int(np.argmax(fitted)), int(np.argmin(fitted))
    to_span = (design[top] - design[bottom]) * (1.0 if v[top] > v[bottom] else -1.0)
    span = float(to_span @ fit.x)
    if span == 0.0:
        raise NoResult(Cause.NO_RESPONSE, channel=name, amplitude=cycle.amplitude)
    ratio = float(to_width @ fit.x) / span
    width = ScalarEstimate(ratio, fit.u(to_width - ratio * to_span) / abs(span))
    centred = response - (response.max() + response.min()) / 2
    misfit, one_sample = fit.scatter / abs(span / 2), 2 * math.pi / (cycle.stop - cycle.start)
    return Loop(cycle.amplitude, width, misfit, drive - cycle.centre, centred, one_sample)


def _width(name: str, loop: Loop, motion: str, spec: CheckSpec) -> Quantity:
    """Return the width with its budget. A response stored a sample beside its drive opens or closes the loop by that
    sample's angle; the record does not show by which part of a sample the two are apart, so every part is equally
    likely ([JCGM100] 4.3.7)."""
    percent = 100 * abs(loop.width.value)
    budget = [
        Contribution("scatter of the record", 100 * loop.width.u, "A"),
        Contribution(f"{motion} stored up to one sample beside Va", 100 * loop.one_sample / math.sqrt(3.0)),
        stated_contribution(spec, percent, "hysteresis_percent"),
    ]
    return Quantity.of(name, percent, *budget)


def _note_of_no_hysteresis(width: Quantity) -> list[str]:
    """Return a note if no hysteresis is seen: a width of 0.0004 percent is not a property of a piezo actuator."""
    if width.U is None or not width.value < width.U < USUAL_PERCENT:
        return []
    return [f"no hysteresis is seen beyond the uncertainty; piezo stacks usually show {USUAL_PERCENT:g} % or more"]


def _small_signal_width(loops: list[Loop], motion: str, spec: CheckSpec) -> Quantity:
    name = "hysteresis_small_signal_percent"
    if len(loops) < 2:
        return Quantity.missing(name, Cause.ONE_AMPLITUDE)
    return _width(name, loops[0], motion, spec)


def _sensor(loops: list[Loop]) -> Quantity:
    name = "sensor_hysteresis_percent"
    if len(loops) < 2:
        return Quantity.missing(name, Cause.ONE_AMPLITUDE)
    small, large = loops[0].width, loops[-1].width
    own = abs(large.value - small.value)
    # The ellipse of the high-pass adds to a loop of Rayleigh's shape, and makes it taller by pi/4 of both widths.
    taller = math.pi / 4 * abs(small.value) * own**2
    budget = [
        Contribution("scatter at the largest amplitude", 100 * large.u, "A"),
        Contribution("scatter at the smallest amplitude", 100 * small.u, "A"),
        Contribution("ellipse of the high-pass in the height of the loop", 100 * taller),
    ]
    return Quantity.of(name, 100 * own, *budget)


def _panels(key: str, label: str, scale: float, loops: list[Loop]) -> dict[str, Panel]:
    curves = tuple(Line(thin(p.drive), thin(p.response) * scale, f"{p.amplitude:.3g} V") for p in loops)
    amplitude = np.array([p.amplitude for p in loops])
    width = 100 * np.array([p.width.value for p in loops])
    U = 100 * COVERAGE_FACTOR * np.array([p.width.u for p in loops])
    growth = (Band(amplitude, width - U, width + U), Line(amplitude, width, "width", role="data"))
    return {
        f"{key}_loops": Panel(f"Loops of the {key}", "Va about its mean [V]", label, curves, kind=PanelKind.CURVE),
        f"{key}_width": Panel(
            f"Loop width of the {key}",
            "amplitude of Va [V]",
            "width [% of peak to peak]",
            growth,
            x_log=True,
            kind=PanelKind.CURVE,
        ),
    }


PICTURE = """\
  Va      ╱╲        ╱╲
     ╱╲  ╱  ╲  ╱╲  ╱  ╲
  ──╱──╲╱────╲╱──╲╱────╲── t
   slow sines, growing amplitude
   record t, Va, de (and Vs)"""

CHECK = Check(
    name="hysteresis",
    title="Hysteresis under slow sines",
    short="Hysteresis",
    kinds=("apa", "strut", "strut-plates"),
    forms=(
        Form(
            "record",
            (
                Series(
                    "record",
                    "slow sines of growing amplitude",
                    {"t": "s", "Va": "V", "de": "m"},
                    optional_channels={"Vs": "V"},
                    instead={"de": "da"},
                ),
            ),
        ),
    ),
    quantities={
        "hysteresis_percent": "Hysteresis",
        "hysteresis_small_signal_percent": "Hysteresis, smallest sine",
        "hysteresis_amplitude_V": "Largest sine at the DAC",
        "hysteresis_gain_um_per_V": "Gain under slow sines",
        "sensor_hysteresis_percent": "Hysteresis of the sensor",
    },
    measure=measure,
    settings=(
        Setting("min_amplitude_V", MIN_AMPLITUDE_V, "amplitude of Va that the largest sine must reach"),
        Setting("loop_min_percent", LOOP_PERCENT, "smallest loop at that amplitude; 0: not checked"),
        Setting("gain_um_per_V", GAIN_UM_PER_V, "what a volt of Va may move de, or da without encoder"),
    ),
    stated=("hysteresis_percent",),
    failed="let the amplifier warm up and repeat; if it stays, the stacks are lossy",
    guide=Guide(
        "Drive the unit with slow sines of increasing amplitude and record voltage and displacement. "
        "Do not touch the bench during the record.",
        PICTURE,
        drive="start sines of 0.1 Hz at the DAC: amplitude 0.1 V rising to 4 V, offset 3.25 V (accept excite sine)",
        pictures_without={"de": PICTURE.replace("de", "da")},
    ),
)
