"""Frequency responses from the drive to sensor stack, encoder and interferometer ([STB] 3.1, 3.2, 4.1, 5.1).

Curves come from H1 on short segments, as in [STB]; resonances and the zero from the leakage-free estimator and local
fits. Data that fail a gate (too short, dead, reversed, exchanged, offset, incoherent) give no result at all.

A strut without encoder (`strut-plates`, [STB] 5.1.1) has Vs and da alone, and no gain and no coherence of de. A record
of it with a signal in de is asked about: its findings are conditional at best."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from checks.acceptance.common.sampling_rate import remarks, vet_rates
from checks.acceptance.responses import gains as gains
from checks.acceptance.responses import panels as draw
from checks.acceptance.responses.consistency import check_against_gain, vet_bands, vet_copies, vet_pole, vet_repeat
from checks.acceptance.responses.modes import (
    SPURIOUS,
    axial,
    axial_damping,
    axial_resonance,
    main_mode,
    peak_Hz,
    resonance_quantity,
    second_resonance,
    spurious,
    vs_zero,
    zero_quantity,
)
from checks.acceptance.responses.notes import BARE, difference_without_encoder, first_record
from checks.acceptance.responses.rules import (
    SETTINGS,
    ResponseSettings,
    outputs_of,
    rules_of,
    vet_coherence,
    vet_delays,
    vet_records,
    vet_responses,
    vet_scales,
    vet_signs,
)
from checks.cause import Cause, NoResult, Reason, because
from checks.declare import Check, Form, Guide, Measured, Scalar, Series, Values
from checks.errors import RecordError
from checks.quantity import Outcome, Quantity
from checks.record import MOTIONS, Record, motion_of
from checks.signals.record_checks import ChannelDelay
from checks.signals.spectral.frf import Frf, h1_record
from checks.signals.spectral.merge import merge
from checks.signals.spectral.poles import Transforms
from checks.signals.spectral.resonance import Resonance
from checks.signals.spectral.zeros import Zero
from specs.spec import CheckSpec

BANDS = ("low", "high", "low_repeat", "high_repeat")
MERGE_HZ = 350.0  # both records have drive there: the low one to 400 Hz, the high one from 290 Hz


@dataclass(frozen=True, eq=False)
class Curves:
    """H1 responses of both records, and merged."""

    low: Frf
    high: Frf
    whole: Frf
    merge_Hz: float


@dataclass(frozen=True, eq=False)
class ResponseFits:
    """Results of the local fits. axial: the resonance, beside: a second pole if two fit better than one, repeat: the
    resonance of the second realisation; zero: the zero of Vs, or why none was found."""

    axial: Resonance
    beside: Resonance | None
    repeat: Resonance | None
    zero: Zero | Reason
    spurious: Mapping[str, Resonance | Reason]


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return the quantities of both records: see CHECK.quantities. Raises NoResult if the data fail a gate, with the
    measured responses if there are any, because they show the fault."""
    rules = rules_of(spec)
    records = _records(values)
    vet_rates(records, spec)
    vet_records(records, rules)
    vet_copies(records)
    given: Measured | None = values.get("merge_Hz")
    merge_Hz = MERGE_HZ if given is None else given.value
    outputs = outputs_of(records[key] for key in BANDS if key in records)
    low, high = (_estimate(records[band], outputs, rules) for band in ("low", "high"))
    curves = Curves(low, high, _merge(low, high, merge_Hz), merge_Hz)
    try:
        return _evaluate(values, spec, rules, records, curves)
    except NoResult as e:
        e.panels = draw.curves(curves.whole, curves.merge_Hz)
        raise


def _evaluate(
    values: Values, spec: CheckSpec, rules: ResponseSettings, records: Mapping[str, Record], curves: Curves
) -> Outcome:
    """Return the quantities of responses that pass the gates for dead, reversed, late and offset channels."""
    delays = _vet_curves(records, curves, rules)
    _vet_repeats(records, curves, rules)
    found = _fit_responses(records, curves, rules)
    resonance_Hz = found.axial.f_Hz
    vet_pole(curves.low, resonance_Hz)
    zero_Hz = found.zero.f_Hz if isinstance(found.zero, Zero) else dip_Hz(curves.low, rules)
    resonances_Hz = [r.f_Hz for r in (found.axial, found.beside) if r is not None]
    allowed = gains.excused_bands(resonances_Hz, zero_Hz)
    vet_coherence(curves.whole, allowed, rules)
    resonance = gains.check_against_payload(
        check_against_gain(axial_resonance(found.axial, found.repeat, spec), curves.low, rules),
        values.get("payload_kg"),
        rules,
        spec,
    )
    quantities = [resonance, *_modal_quantities(found, spec)]
    mass, u_mass, words = gains.payload(values.get("payload_kg"), rules, spec)
    quantities += gains.gain_quantities(curves.whole, resonances_Hz, spec)
    quantities.append(gains.stiffness(resonance, mass, u_mass, words))
    quantities += gains.mass_line(curves.whole, resonances_Hz, mass, u_mass, spec)
    quantities += gains.coherence_quantities(curves.whole, allowed, rules)
    quantities += gains.constants(curves.whole, mass, rules, spec)
    without = _without_encoder(records, curves, rules)
    panels = draw.curves(curves.whole, curves.merge_Hz) | draw.zoom(records["low"], found.axial, found.beside)
    if isinstance(found.zero, Zero):
        panels |= draw.zero(records["low"], found.zero)
    if isinstance(without, Frf):
        panels |= draw.without_encoder(curves.whole, without)
    notes = [
        *(d.words for d in delays if abs(d.samples) > 0.5),
        *_notes(values, found, curves, without),
        *remarks(records, spec),
    ]
    return Outcome(tuple(quantities), tuple(notes), panels)


def _records(values: Values) -> dict[str, Record]:
    """Return every given record. Raises NoResult if one of the two bands is missing."""
    records: dict[str, Record] = {k: v for k, v in values.items() if isinstance(v, Record)}
    missing = [key for key in ("low", "high") if key not in records]
    if missing:
        raise NoResult(Cause.NOT_MEASURED, record=" and ".join(missing))
    return records


def _estimate(record: Record, outputs: tuple[str, ...], rules: ResponseSettings) -> Frf:
    try:
        return h1_record(record, "Va", outputs, rules.segment_s)
    except ValueError as e:
        raise NoResult(Cause.CANNOT_ESTIMATE, file=record.name, detail=str(e)) from e


def _merge(low: Frf, high: Frf, merge_Hz: float) -> Frf:
    try:
        return merge(low, high, merge_Hz)
    except ValueError as e:
        raise NoResult(Cause.CANNOT_ESTIMATE, record="low and high", detail=str(e)) from e


def _vet_curves(records: Mapping[str, Record], curves: Curves, rules: ResponseSettings) -> Sequence[ChannelDelay]:
    """Return the delays behind the drive. Raises NoResult for a dead, reversed, late or scaled channel."""
    low, high, merge_Hz = records["low"], records["high"], curves.merge_Hz
    vet_responses("low", low.name, curves.low.band(1.0, merge_Hz))
    vet_responses("high", high.name, curves.high.band(merge_Hz, 0.4 * high.fs))
    vet_signs(curves.low, rules)
    vet_scales(curves.low, rules)
    vet_bands(curves.low, curves.high, merge_Hz, rules)
    return vet_delays(curves.high, high.fs, rules)


def _vet_repeats(records: Mapping[str, Record], curves: Curves, rules: ResponseSettings) -> None:
    """Raise NoResult if a second realisation is not of the same unit as the first."""
    for band, first in (("low", curves.low), ("high", curves.high)):
        key = f"{band}_repeat"
        if key in records:
            vet_repeat(key, first, _estimate(records[key], first.channels, rules), rules)


def _fit_responses(records: Mapping[str, Record], curves: Curves, rules: ResponseSettings) -> ResponseFits:
    outputs = curves.low.channels
    low = Transforms.of(records["low"], "Va", outputs)
    near_Hz = peak_Hz(curves.low, motion_of(outputs), *rules.resonance_Hz)
    first, beside = axial(low, near_Hz, rules)
    modes: dict[str, Resonance | Reason] = {}
    if rules.spurious_Hz:
        high = Transforms.of(records["high"], "Va", outputs)
        for name, f in zip(SPURIOUS, rules.spurious_Hz, strict=True):
            modes[name] = spurious(low if f < curves.merge_Hz else high, f, rules.spurious_within)
        _refuse_exchanged(modes, outputs)
    zero = vs_zero(low, dip_Hz(curves.low, rules))
    return ResponseFits(first, beside, _repeat(records, outputs, first.f_Hz), zero, modes)


def dip_Hz(frf: Frf, rules: ResponseSettings) -> float:
    """Return the frequency of the smallest |Vs| in the band in which its zero is searched."""
    part = frf.select("Vs").band(*rules.zero_Hz)
    if part.f.size == 0:
        raise NoResult(Cause.BAND_NOT_MEASURED, channel="Vs", lo=rules.zero_Hz[0], hi=rules.zero_Hz[1])
    return float(part.f[np.argmin(np.where(part.usable, np.abs(part.H[:, 0]), np.inf))])


def _repeat(records: Mapping[str, Record], outputs: tuple[str, ...], near_Hz: float) -> Resonance | None:
    """Return the axial resonance of the second realisation, None without one. Raises NoResult if it shows no resonance:
    two records of one unit that contradict each other determine nothing."""
    if "low_repeat" not in records:
        return None
    try:
        return main_mode(Transforms.of(records["low_repeat"], "Va", outputs), near_Hz)
    except (NoResult, ValueError) as e:
        raise NoResult(Cause.REPEAT_CONTRADICTS, record="low_repeat", detail=str(e)) from e


def _refuse_exchanged(modes: Mapping[str, Resonance | Reason], outputs: Sequence[str]) -> None:
    """Raise NoResult if da shows the bending modes more than de: they turn the encoder, not the payload."""
    resonances = [m for m in modes.values() if isinstance(m, Resonance)]
    if not set(MOTIONS) <= set(outputs):
        return
    de, da = (outputs.index(c) for c in MOTIONS)
    if resonances and all(m.amplitude[da] > m.amplitude[de] for m in resonances):
        evidence = "the strut's own modes show on da more than on de"
        raise NoResult(Cause.CHANNELS_EXCHANGED, channel="de", other="da", evidence=evidence)


def _modal_quantities(found: ResponseFits, spec: CheckSpec) -> list[Quantity]:
    """Return the quantities of the local fits, except for the axial resonance itself."""
    quantities = [axial_damping(found.axial, found.repeat, spec), second_resonance(found.beside, spec)]
    if isinstance(found.zero, Zero):
        quantities.append(zero_quantity(found.zero, spec))
    else:
        quantities.append(Quantity.missing("vs_zero_Hz", found.zero))
    for name in SPURIOUS:
        mode = found.spurious.get(name, because(Cause.SEARCH_NOT_SET))
        quantities.append(
            Quantity.missing(name, mode) if isinstance(mode, Reason) else resonance_quantity(name, mode, spec)
        )
    return quantities


def _without_encoder(records: Mapping[str, Record], curves: Curves, rules: ResponseSettings) -> Frf | str | None:
    """Return Vs and da without the encoder, merged likewise, or why they are not used; None if not recorded."""
    keys = [f"without_encoder_{band}" for band in ("low", "high")]
    given = [key for key in keys if key in records]
    if len(given) < 2:
        return f"only {given[0]} was recorded: nothing to compare" if given else None
    try:
        low, high = (_estimate(records[key], BARE, rules) for key in keys)
        return _merge(low, high, curves.merge_Hz)
    except (NoResult, RecordError) as e:
        return f"without encoder: {e}"


def _notes(values: Values, found: ResponseFits, curves: Curves, without: Frf | str | None) -> list[str]:
    notes = []
    if found.beside is not None:
        one, two = found.axial, found.beside
        notes.append(f"double resonance: {one.f_Hz:.4g} and {two.f_Hz:.4g} Hz (two poles fit better, p = {two.p:.1g})")
    if found.repeat is not None:
        notes.append(f"second realisation: axial resonance {found.repeat.f_Hz:.5g} Hz")
    if "first" in values:
        notes.append(first_record(values["first"], found.axial.f_Hz))
    if isinstance(without, str):
        notes.append(without)
    if isinstance(without, Frf):
        notes.append(difference_without_encoder(curves.whole, without))
    return notes


_ALL = {"t": "s", "Va": "V", "Vs": "V", "de": "m", "da": "m"}
_BARE = {"t": "s", "Va": "V", "Vs": "V", "da": "m"}
PICTURE = """\
        da interferometer
             ▼
         ┌───────┐ payload
         └─┬───┬─┘
     de ─▶ │   │ ── Vs sensor stack
   encoder │   │ ◀─ Va x 20 drive
         ──┴───┴──
    low record    | high record
    ... 350 Hz    | 350 Hz ..."""
PICTURE_WITHOUT_ENCODER = """\
        da interferometer
             ▼
         ┌───────┐ payload
         └─┬───┬─┘
           │   │ ── Vs sensor stack
           │   │ ◀─ Va x 20 drive
         ──┴───┴──
    low record    | high record
    ... 350 Hz    | 350 Hz ..."""

CHECK = Check(
    name="frf",
    title="Frequency responses",
    short="Responses",
    kinds=("apa", "strut", "strut-plates"),
    forms=(
        Form(
            "records",
            (
                Series("low", "low record (sweep or noise)", _ALL, called="low record", named=("lf", "sweep")),
                Series("high", "high record (noise)", _ALL, called="high record", named=("hf",)),
                Scalar("merge_Hz", "crossover from low to high record", lo=1.0, hi=5000.0, default=MERGE_HZ),
                Series(
                    "low_repeat",
                    "second realisation of the low record",
                    _ALL,
                    optional=True,
                    called="second low record",
                    named=("lf", "2"),
                ),
                Series(
                    "high_repeat",
                    "second realisation of the high record",
                    _ALL,
                    optional=True,
                    called="second high record",
                    named=("hf", "2"),
                ),
                Series("first", "first record, small noise", _ALL, optional=True),
                Series(
                    "without_encoder_low",
                    "low record before the encoder is fixed",
                    _BARE,
                    optional=True,
                    called="low record without encoder",
                    beside="de",
                ),
                Series(
                    "without_encoder_high",
                    "high record before the encoder is fixed",
                    _BARE,
                    optional=True,
                    called="high record without encoder",
                    beside="de",
                ),
                Scalar("payload_kg", "payload on the bench", lo=0.01, hi=1000.0, optional=True, usual=(1.0, 20.0)),
            ),
        ),
    ),
    quantities={
        "axial_resonance_Hz": "Axial resonance",
        "axial_damping_percent": "Axial damping",
        "second_resonance_Hz": "Second resonance",
        "vs_zero_Hz": "Zero of sensor Vs",
        "x_bending_Hz": "Bending in x",
        "y_bending_Hz": "Bending in y",
        "z_torsion_Hz": "Torsion about z",
        "gain_de_um_per_V": "Gain of encoder de",
        "gain_da_um_per_V": "Gain of interferometer da",
        "gain_Vs_V_per_V": "Gain of sensor Vs",
        "k_resonance_N_per_um": "Stiffness, from the resonance",
        "mass_line_um_per_V": "Mass line",
        "mass_line_kg": "Moved mass",
        "coherent_Vs_Hz": "Vs coherent up to",
        "coherent_de_Hz": "de coherent up to",
        "coherent_da_Hz": "da coherent up to",
        "ga_N_per_V": "Actuator constant",
        "gs_V_per_m": "Sensor constant",
    },
    measure=measure,
    settings=SETTINGS,
    stated=(
        "f_Hz",
        "axial_resonance_Hz",
        "axial_damping_percent",
        "second_resonance_Hz",
        "vs_zero_Hz",
        *SPURIOUS,
        *gains.GAINS,
        "mass_line_um_per_V",
        "payload_kg",
        *gains.CONSTANTS,
    ),
    failed="check the payload on the bench; the gap analysis tells a wrong payload from a bad part",
    guide=Guide(
        "Mount the payload. Record the low excitation up to 350 Hz, then the high excitation above it. "
        "Do not touch the bench. Load a second realisation if you have one.",
        PICTURE,
        drive="start it at the DAC: sweep, amplitude 1 V, or noise, 0.3 V RMS; offset 3.25 V (accept excite)",
        pictures_without={"de": PICTURE_WITHOUT_ENCODER},
    ),
)
