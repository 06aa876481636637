"""Corner of the high-pass that the resistor across the sensor stack makes with its capacitance ([STB] 3.1.9)."""

import math
from dataclasses import replace

import numpy as np

from checks.acceptance.common.sampling_rate import SAMPLING, remarks, vet_rates
from checks.acceptance.common.typed_value import stated_contribution
from checks.acceptance.responses.rules import LOOKS
from checks.arrays import Array
from checks.cause import Cause, NoResult, because, together
from checks.declare import Check, Form, Guide, Measured, Scalar, Series, Setting, Values
from checks.picture import Line, Mark, Panel, PanelKind
from checks.quantity import COVERAGE_FACTOR, Contribution, Outcome, Quantity
from checks.record import Record
from checks.signals.record_checks import mismatches, overload
from checks.signals.slow.highpass import HighPass, fit_highpass
from checks.signals.spectral.segments import spectra
from specs.spec import CheckSpec

UF = 1e-6
TOP_HZ = 5.0  # well below the first zero of Vs near 40 Hz, which the circuit does not have
CAPACITANCE_UF = [4.4, 5.5]  # of one stack ([STB] 2.2)
MAX_UNEXPLAINED = 0.02  # of the variance: a circuit of first order leaves noise alone
MAX_RELATIVE_U = 0.1  # a corner known to no better than a tenth does not determine a capacitor
RESISTOR_OHM = 80600.0  # [STB] 3.1.9
SHOWN_SEGMENTS = 4  # of the picture's FRF; the corner does not come from it


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return the corner with the resistor [Hz], corner without it, and the capacitance [uF] that the first one implies.

    The corner comes from a time-domain fit of s/(s + w) between Va and Vs below `top_Hz`, not from an FRF: with few
    periods of the lowest frequencies every window leaks."""
    if "with_resistor" not in values:
        raise NoResult(Cause.NOT_MEASURED, record="with_resistor")
    vet_rates(values, spec)
    top_Hz = float(spec.settings.get("top_Hz", TOP_HZ))
    fitted = _fit(values["with_resistor"], "with_resistor", top_Hz)
    corner = _corner(fitted, spec)
    without = _corner_without(values, top_Hz)
    implied = _capacitance(corner, without, values, spec)
    quantities = (
        _check_resistor(corner, values, spec),
        without,
        implied,
        Quantity.of("sensor_gain_V_per_V", fitted.terms[0]),
    )
    notes = *_notes(corner, values, spec), *remarks(values, spec)
    return Outcome(quantities, notes, _panels(values, fitted, top_Hz))


def _fit(record: Record, name: str, top_Hz: float) -> HighPass:
    """Return the fit of a high-pass to a record. Raises NoResult if it does not describe the record."""
    wrong = mismatches(record.channels, LOOKS) or overload("Vs", record["Vs"])
    if wrong:
        raise NoResult(together(wrong).within(name, record.name))
    try:
        fitted = fit_highpass(record.t, record["Va"], record["Vs"], top_Hz)
    except ValueError as e:
        raise NoResult(Cause.CANNOT_ESTIMATE, record=name, file=record.name, detail=str(e)) from e
    if not fitted.unexplained <= MAX_UNEXPLAINED:
        raise NoResult(Cause.HIGHPASS_MISFIT, record=name, file=record.name, percent=100 * fitted.unexplained)
    return fitted


def _corner(fitted: HighPass, spec: CheckSpec) -> Quantity:
    """Return the corner of a fit [Hz]. Raises NoResult if the record does not show one."""
    f, u = fitted.corner.value, fitted.corner.u
    if fitted.at_edge or not u <= MAX_RELATIVE_U * f:
        raise NoResult(Cause.NO_CORNER, record="with_resistor", f_Hz=f, u_Hz=u)
    scatter = Contribution("scatter of the record", u, "A")
    return Quantity.of("sensor_highpass_Hz", f, scatter, stated_contribution(spec, f, "sensor_highpass_Hz"))


def _corner_without(values: Values, top_Hz: float) -> Quantity:
    """Return the corner without the resistor, of the input's own resistance; mostly below the record's lowest
    frequency."""
    name = "sensor_highpass_without_Hz"
    if "without_resistor" not in values:
        return Quantity.missing(name, because(Cause.NOT_MEASURED, record="without_resistor"))
    try:
        fitted = _fit(values["without_resistor"], "without_resistor", top_Hz)
    except NoResult as e:
        return Quantity.missing(name, e.reason)
    f, u = fitted.corner.value, fitted.corner.u
    if fitted.at_edge or not u <= MAX_RELATIVE_U * f:
        return Quantity.missing(name, because(Cause.NO_CORNER_WITHOUT, f_Hz=f + 2 * u))
    return Quantity.of(name, f, Contribution("scatter of the record", u, "A"))


def _capacitance(corner: Quantity, without: Quantity, values: Values, spec: CheckSpec) -> Quantity:
    """Return C = 1/(2 pi R (f - f0)): the leakage of the input without the resistor (f0) is in parallel with it."""
    name = "sensor_capacitance_implied_uF"
    R: Measured | None = values.get("resistor_ohm")
    if R is None:
        return Quantity.missing(name, because(Cause.ENTRY_MISSING, entry="resistor (resistor_ohm)"))
    leak = 0.0 if without.reason else without.value
    f = corner.value - leak
    if not f > 0:
        return Quantity.missing(name, because(Cause.CORNERS_ORDER, f_Hz=leak))
    C = 1 / (2 * math.pi * R.value * f) / UF
    u_f = math.hypot(corner.budget[0].u, without.budget[0].u if leak else 0.0)
    budget = [Contribution("corner", C * u_f / f, "A")]
    if R.U is not None:
        budget.append(Contribution("resistor, stated with it", C * R.U / COVERAGE_FACTOR / R.value))
    elif (tolerance := stated_contribution(spec, R.value, "resistor_ohm")) is not None:
        budget.append(Contribution(tolerance.source, C * tolerance.u / R.value))
    else:
        return Quantity(name, C, None, tuple(budget), note="tolerance of the resistor not stated")
    return Quantity.of(name, C, *budget)


def _check_resistor(corner: Quantity, values: Values, spec: CheckSpec) -> Quantity:
    """Return the corner. Its uncertainty is unknown, so that it cannot pass, if the resistor is not the limits': a
    corner inside them then means another capacitance. A corner outside them still fails. Without a resistor of the unit
    the spec's is used, with a note."""
    lo, hi = _expected_corner(values, spec)
    ohm, stated_ohm = _resistor(values, spec)
    if not lo <= corner.value <= hi:
        whose = f"the stated {ohm:g} ohm" if stated_ohm else f"the {ohm:g} ohm that the spec assumes"
        return corner.doubted(Cause.CORNER_RESISTOR, whose=whose, lo=lo, hi=hi)
    if stated_ohm:
        return corner
    return replace(corner, note=f"the resistor is not stated: {ohm:g} ohm assumed, as the spec says")


def _resistor(values: Values, spec: CheckSpec) -> tuple[float, bool]:
    """Return the resistor [ohm], and whether the unit states it."""
    given: Measured | None = values.get("resistor_ohm")
    if given is not None:
        return given.value, True
    return float(spec.settings.get("resistor_ohm", RESISTOR_OHM)), False


def _expected_corner(values: Values, spec: CheckSpec) -> tuple[float, float]:
    """Return the corner [Hz] that the resistor makes with the largest and the smallest capacitance of a sound stack."""
    ohm, _ = _resistor(values, spec)
    lo, hi = sorted(float(c) for c in spec.settings.get("capacitance_uF", CAPACITANCE_UF))
    return 1 / (2 * math.pi * ohm * hi * UF), 1 / (2 * math.pi * ohm * lo * UF)


def _notes(corner: Quantity, values: Values, spec: CheckSpec) -> tuple[str, ...]:
    expected = _expected_corner(values, spec)
    inside = expected[0] <= corner.value <= expected[1]
    words = "inside" if inside else "outside"
    ohm, stated_ohm = _resistor(values, spec)
    assumed = "" if stated_ohm else f"; R is not stated, {ohm:g} ohm is assumed"
    span = f"{expected[0]:.3g} to {expected[1]:.3g} Hz"
    return (f"corner {corner.value:.3g} Hz, {words} the {span} that R and C give{assumed}",)


def _panels(values: Values, fitted: HighPass, top_Hz: float) -> dict[str, Panel]:
    size: list[Line] = []
    phase: list[Line] = []
    for key, words, role in (("with_resistor", "with R", "data"), ("without_resistor", "without R", "quiet")):
        if key in values:
            f, H = _frf(values[key], top_Hz)
            size.append(Line(f, np.abs(H), words, role=role))
            phase.append(Line(f, np.degrees(np.angle(H)), words, role=role))
    model = fitted.response(f)
    size.append(Line(f, np.abs(model), "fit", "dashed", "model"))
    phase.append(Line(f, np.degrees(np.angle(model)), "fit", "dashed", "model"))
    mark = Mark(fitted.corner.value, label="corner", role="model")
    label = "frequency [Hz]"
    return {
        "magnitude": Panel("Sensor stack, Va to Vs", label, "magnitude [V/V]", (*size, mark), x_log=True, y_log=True),
        "phase": Panel("Sensor stack, phase", label, "phase [deg]", (*phase, mark), x_log=True, kind=PanelKind.PHASE),
    }


def _frf(record: Record, top_Hz: float) -> tuple[Array, Array]:
    """Return the H1 of Vs over Va for the picture: f (F,) [Hz] and complex H (F,), long Hann windows."""
    n = record.t.size // SHOWN_SEGMENTS
    averaged = spectra([record["Va"], record["Vs"]], record.fs, n)
    f, power = averaged.f, averaged.S[:, 0, 0].real
    shown = (f >= 2 * f[1]) & (f <= top_Hz) & (power > 0)
    return f[shown], averaged.S[shown, 1, 0] / power[shown]


_CHANNELS = {"t": "s", "Va": "V", "Vs": "V"}
PICTURE = """\
   sensor stack
     ├───┬──────── ADC (Vs)
    ═╪═ ┌┴┐
     │  │R│ 80.6 kΩ
     │  └┬┘ 1 with R
     └───┴── 0 V   2 without"""

CHECK = Check(
    name="sensor_highpass",
    title="High-pass of the sensor stack",
    short="High-pass",
    kinds=("apa",),
    forms=(
        Form(
            "records",
            (
                Series(
                    "with_resistor",
                    "slow sweep with the resistor across the sensor stack",
                    _CHANNELS,
                    called="with the resistor",
                    named=("r", "sweep"),
                ),
                Series(
                    "without_resistor",
                    "the same sweep without it",
                    _CHANNELS,
                    optional=True,
                    called="without the resistor",
                    named=("lf", "sweep"),
                ),
                Scalar("resistor_ohm", "resistor", lo=1.0, hi=1e12, optional=True),
            ),
        ),
    ),
    quantities={
        "sensor_highpass_Hz": "High-pass, with resistor",
        "sensor_highpass_without_Hz": "High-pass, without resistor",
        "sensor_capacitance_implied_uF": "Sensor stack, from the corner",
        "sensor_gain_V_per_V": "Sensor gain",
    },
    measure=measure,
    settings=(
        Setting("top_Hz", TOP_HZ, "highest frequency used, well below the first zero of Vs"),
        Setting("resistor_ohm", RESISTOR_OHM, "resistor where the unit does not state its own"),
        SAMPLING,
        Setting("capacitance_uF", CAPACITANCE_UF, "capacitance of a sound sensor stack, from and to", positive=True),
    ),
    stated=("sensor_highpass_Hz", "resistor_ohm"),
    failed="check the resistor and its contacts, and the capacitance of the sensor stack",
    guide=Guide(
        "Record the slow sweep with the resistor across the sensor stack, then without the resistor. "
        "Enter the resistance from the label or measure it.",
        PICTURE,
        drive="start the slow sweep from 0.1 Hz at the DAC: amplitude 1 V, offset 3.25 V (accept excite sweep)",
    ),
)
