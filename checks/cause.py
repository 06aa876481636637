"""Causes why a quantity has no value or cannot pass, with their parameters and their sentences.

A cause is passed through the program unchanged: a check raises it, a finding carries it, the workflow picks its advice
by it, results.json holds it under `cause`. Only `str(reason)` is a sentence."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, unique
from typing import Any

from pydantic_core import CoreSchema
from pydantic_core.core_schema import no_info_plain_validator_function, plain_serializer_function_ser_schema

from checks.rounding import with_U
from specs.units import CHANNEL_LABELS, DIMENSIONLESS, model_label

_RECORDS: dict[str, str] = {}  # input of a check -> its label, as declared
_CHANNELS = frozenset({"channel", "other", "reference"})  # parameters that name a channel


@unique
class Cause(Enum):
    """Causes: the value is the sentence; its fields are the cause's parameters."""

    # Entries and records
    NOT_MEASURED = "not measured"
    ENTRY_MISSING = "{entry} is missing"
    ENTRY_IMPLAUSIBLE = "{entry} = {value:.6g} {unit} is not plausible; expected at most {most:g} {unit}"
    RECORD_NEEDED = "only a record shows it, and a value was typed in"
    CHANNEL_MISSING = "the record has no channel {channel}"
    NOT_IN_DATA = "the data do not contain it"
    NOT_FINITE = "the value is {value}"
    WRONG_UNIT = "the value is in {unit}, the limit in {expected}"
    PLUGIN_QUANTITIES = "check '{check}' of another package returned {found}; expected {expected}"
    IN_WORDS = "{detail}"  # if no cause is known: errors of a file's format, of another package
    # Files
    FILE_DAMAGED = "cannot be read, it is damaged or cut: {detail}"
    SAMPLES_NOT_FINITE = "{channel} holds {value} {where}; every sample must be a finite number"
    SAMPLES_TOO_LARGE = "{channel} holds {value:.3g} {where}; nothing here exceeds {most:.0e} in SI units"
    RECORD_SHORT = "lasts {seconds:.3g} s; at least {needed:g} s are needed"
    SAMPLING_RATE = "sampled at {rate:.6g} Hz, the bench at {expected} Hz (setting sampling_Hz): the time step is wrong"
    SAMPLING_RATES = (
        "sampled at {rate:.6g} Hz, but {other_record} ({other_file}) at {other_rate:.6g} Hz: one time step is wrong"
    )
    SAMPLING_SLOW = "sampled at {rate:.4g} Hz, too slowly for modes above {lowest:g} Hz"
    FEW_SAMPLES = "only {samples} samples {where}; at least {needed} are needed"
    # Channels
    OTHER_VARIANT = "{detail}; a {title} is of kind '{kind}'"
    CHANNEL_NOT_EXPECTED = "the file holds {channel}, but the unit is declared without ({why}): is an {part} fixed?"
    CHANNEL_EMPTY = "{channel} is empty or holds NaN or inf"
    CHANNEL_CONSTANT = "{channel} is constant at {value:.6g}{unit}: nothing was recorded"
    CHANNEL_DEAD = "{channel} is dead: only {levels} different values were recorded"
    CHANNEL_NOT_DRIVEN = "{channel} does not respond to {reference}: not connected, or from another record"
    CHANNEL_CLIPPED = "{channel} is clipped: {count} samples hold its {end} value {value:.4g}{where}"
    CHANNEL_REVERSED = "{channel} is reversed: below the resonance it moves {found} {reference}, not {expected} it"
    CHANNELS_EXCHANGED = "{channel} and {other} are exchanged: {evidence}"
    CHANNEL_SIZE = "{channel} moves by {value:.3g}; expected {lo:g} to {hi:g}"
    CHANNEL_UNIT = "{channel} moves by {value:.3g} {unit}; expected at most {hi:g} {unit}: did you mean {guess}?"
    CHANNEL_SCALED = "{channel} {how} by [channels] of unit.toml, and no bench file states it"
    INPUT_NOT_STATED = "{input} by {source}, but {against}"
    CHANNEL_STEP = "{channel} has steps of {value:.3g}; expected {expected:g}"
    CHANNEL_STUCK = "{channel} stays at one value from sample {sample} while {reference} changes by {span:.3g} V"
    CHANNEL_HELD = (
        "{channel} holds {value:.4g} over {count} samples from {at_s:.4g} s on while {reference} moves: its reading "
        "stood still"
    )
    CHANNEL_SLIPPED = (
        "{channel} is {samples} samples ({ms:.3g} ms) off from {at_s:.4g} s on: a block of it was lost or stored twice"
    )
    CHANNEL_DISTURBED = "{channel} does not go with {reference} at {at_s:.4g} s as it does elsewhere in the record"
    SAMPLES_LOST = "a block of samples was lost at {at_s:.4g} s: {channels} jump there at once"
    SAMPLING_JITTER = (
        "the times of the samples scatter by {jitter_us:.2g} us (standard deviation): errors go with the velocity of "
        "the channels"
    )
    CLOCKS_APART = (
        "{channel} and {reference} were sampled by clocks that run apart by {ppm:.2g} parts per million: the lag "
        "between them grows by {grows_us:.3g} us over the record"
    )
    CHANNEL_COPIED = "{other} is {channel} times a number at every sample: a channel was stored twice or looped back"
    CHANNEL_DELAYED = "{channel} is {samples:.2f} samples behind {reference}; expected 0 to {most:g} samples"
    CHANNEL_OFFSET = "{channel} is stored {samples:.2f} samples behind {other}; at most {most:g} are possible"
    CHANNEL_SCALE = (
        "{channel} moves {ratio:.3g} times as far as {other} below the resonance; expected 1 ± {within:g}: "
        "the scale of one of them is wrong"
    )
    CHANNEL_FOREIGN = (
        "{channel} does not show the resonance at {f_Hz:.4g} Hz (it is {ratio:.3g} times as large there as beyond it): "
        "it is not a signal of this structure"
    )
    CHANNEL_NOISELESS = "{channel} has neither noise nor steps: it was computed, not measured"
    WRONG_GAIN = (
        "{channel} moves {gain:.3g} um per volt of Va; expected {lo:g} to {hi:g}: a stack does not work, or the gain "
        "of the amplifier or the scale of the channel is wrong"
    )
    DRIVE_BEHIND_AMPLIFIER = (
        "Va reaches {value:.3g} V, a DAC at most {most:g} V: Va was measured at the output of the amplifier"
    )
    CONTRADICTION = (
        "{one_called} and {other_called} contradict each other: one of these measurements is wrong, or was made on "
        "another unit ({title}: {ratio:.3g} ± {U:.2g}, expected {lo:g} to {hi:g})"
    )
    SAMPLES_COPIED = (
        "holds the same data as {others}; it counts for none of them until it is decided whose it is "
        "(`accept store resolve`)"
    )
    # Flatness
    POINTS_MISSING = "{points} points on the interface at {side}; at least {needed} are needed"
    POINTS_IN_LINE = "no plane fits the points: {detail}"
    POINT_TWICE = "points {first} and {second} are the same position (x = {x_mm:g} mm, y = {y_mm:g} mm)"
    HEIGHTS_ALIKE = (
        "all heights lie within {span:.3g} um, but the probe resolves {floor:g} um: not measured, or not in um"
    )
    HEIGHTS_APART = "the heights spread over {span:.0f} um; expected at most {most:g} um: are they in nm?"
    HEIGHTS_COUNT = "{found} heights for {expected} positions of the spec"
    # Stroke and loops
    VOLTAGE_START = "V starts at {value:.2f} V; expected {expected:g} ± {within:g} V"
    VOLTAGE_TOP = "V reaches {value:.2f} V; expected {expected:g} ± {within:g} V"
    STROKE_AWAY = (
        "{channel} is largest at {value:.1f} V; expected near {expected:g} V: it does not follow the voltage or is "
        "reversed"
    )
    STROKE_IN_NOISE = "{channel} rises by only {value:.3g} um, with {noise:.2g} um of noise"
    STROKE_IMPLAUSIBLE = (
        "{channel} rises by {value:.4g} um; three stacks would move {total:.4g} um of at most {most:g} um: wrong unit, "
        "wrong gauge range, or other stacks were driven"
    )
    STACKS_DIFFER = (
        "one stack moves {one:.4g} um, the other two {other_um:.4g} um each: one stack is weak, or others were driven"
    )
    GAUGE_DRIFT = (
        "{channel} is off by {value:.4g} um when V returns to {voltage:.4g} V, after a stroke of {stroke:.4g} um: the "
        "gauge drifts or slipped"
    )
    NO_LOOP = "V does not return through {middle:g} V, so the record has no loop"
    LOOP_NARROW = (
        "hysteresis of {channel} over {reference} is {percent:.2g} %; a piezo stack shows at least {least:g} %: looped "
        "back, stored with an offset, or reversed in time"
    )
    NO_CURVATURE = (
        "{channel} rises along a straight line but for {percent:.2g} %; no piezo stack does: the drive was looped back"
    )
    NO_SINE = "Va holds no whole period of a steady sine"
    SINE_SMALL = "the largest sine in Va has {value:.3g} V; at least {needed:g} V are needed"
    RESPONSE_LEADS = (
        "{channel} leads Va by {percent:.3g} % at {amplitude:.3g} V: stored with an offset, reversed in time, or from "
        "another record"
    )
    NO_RESPONSE = "{channel} does not follow Va at {amplitude:.3g} V"
    ONE_AMPLITUDE = "only one amplitude was recorded; two or more are needed"
    # Stiffness
    STEP_COUNT = "{found} mass steps found{where}; expected two: mass added and removed"
    STEPS_SAME_WAY = "both steps, at {first:.2f} s and {second:.2f} s, have the same direction; expected add and remove"
    STEP_PLATEAU = "only {seconds:.2g} s without disturbance {where} the steps; at least {needed:g} s are needed"
    STEP_NOT_SETTLED = "{channel} does not settle within {needed:g} s after the step at {at:.2f} s"
    STEPS_DIFFER = "the two steps differ: {first:.4g} um and {second:.4g} um; the mass slipped or was not the same"
    CREEP_MISFIT = "two steps with creep do not fit the record: {percent:.2g} % of the deflection remains"
    STEP_WINDOWS = "the windows {before} s and {loaded} s about the first step do not fit into the record"
    CIRCUITS_EXCHANGED = (
        "open-circuit over closed-circuit stiffness is {ratio:.3g}; it cannot be below 1: the two records are exchanged"
    )
    # High-pass of the sensor stack
    HIGHPASS_MISFIT = "a first-order high-pass leaves {percent:.2g} % of Vs unexplained"
    NO_CORNER = "no corner found ({f_Hz:.3g} Hz with a standard uncertainty of {u_Hz:.2g} Hz)"
    NO_CORNER_WITHOUT = "no corner above {f_Hz:.2g} Hz without the resistor"
    CORNERS_ORDER = "the corner without the resistor, {f_Hz:.3g} Hz, is not below that with it"
    CORNER_RESISTOR = (
        "{whose} and a sound sensor stack have their corner at {lo:.3g} to {hi:.3g} Hz; this corner shows another "
        "capacitance"
    )
    # Hammer tests
    NO_IMPACT = "no impact found in the force"
    IMPACTS_BAD = "{tally}; at least {needed} good impacts are needed"
    NO_MODE = "no mode found between {lo:.4g} and {hi:.4g} Hz"
    TORSION_WITHOUT_TOP = (
        "without the top impact torsion cannot be told from bending (the left impact shows {modes} Hz)"
    )
    TORSION_ONE_MODE = "the left impact shows one mode only ({modes} Hz): without bending beside it torsion is not told"
    TORSION_OTHER_UNIT = (
        "the top impact ({others} Hz) shows no mode of the left impact ({modes} Hz); bending must show in both: they "
        "are of two actuators, or one time step is wrong"
    )
    TORSION_NO_CONTRAST = "no mode of the left impact ({modes} Hz) is {needed:g} times weaker from the top"
    NO_HARMONIC = "no mode within {within:.0%} of {f_Hz:.4g} Hz"
    # Frequency responses
    COHERENCE_LOW = "coherence is below {needed:g}: {bands}"
    NOT_COHERENT = "{channel} is not coherent from {f_Hz:g} Hz on"
    BAND_NOT_MEASURED = "{channel} has no data from {lo:g} to {hi:g} Hz"
    NO_RESONANCE = "no resonance found near {f_Hz:.4g} Hz"
    NO_ZERO = "{channel} has no zero near {f_Hz:.4g} Hz"
    NO_SECOND_POLE = "two poles do not fit better than one (F test, false alarms below 1 in 1000)"
    REPEAT_CONTRADICTS = "{detail}, where low has the axial resonance"
    RECORDS_DISAGREE = (
        "{channel} is {ratio:.3g} times as large in {this} as in {that}, where both are coherent: they are of two "
        "units or benches, or one time step or gain is wrong"
    )
    SEARCH_NOT_SET = "the spec names no frequency to search near (setting spurious_Hz)"
    MODEL_NOT_SET = "the spec names no model"
    MODEL_WITHOUT_CONSTANT = "model {model} has another sensor constant"
    PAYLOAD_WRONG = "{value:.4g} Hz was measured with {mass} kg {how} on the bench than stated"
    PAYLOAD_DIFFERS = "the limits are for a payload of {expected:g} kg, but it is {value:g} kg"
    PAYLOAD_MOVES_IT = (
        "with the payload of the limits, {expected:g} kg instead of {value:g} kg, it would be {f_Hz:.4g} Hz: outside"
    )
    # Misalignment
    MODEL_UNUSABLE = "model {model}: {detail}"
    MODEL_MISFIT = (
        "the model does not explain encoder de or interferometer da (which of them, their ratio cannot say) from "
        "{lo:.0f} to {hi:.0f} Hz: G = {G:.3g} on {data} ({chance}); run "
        "`accept gap` to find the cause"
    )
    RATIO_UNKNOWN = "the ratio de / da is not known from {bands}"
    DRIVE_REVERSED = "de and da move against the model below the resonance: is the drive reversed?"
    SEARCH_FAILED = "the parameters of {model} left the range of a strut during the search"
    NOT_CONVERGED = "the fit did not converge ({detail})"
    PRIOR_EXCEEDED = (
        "the responses do not fit this model: it allows {expected:.4g} ± {sd:.2g}{in_unit} as {parameter}, and they "
        "need {value:.4g}{in_unit} ({z:.1f} standard deviations off)"
    )
    PRIORS_EXCEEDED = (
        "the responses do not fit this model: they need parameters that together lie off what it allows (chi-square "
        "{chi2:.0f} for the {told:.0f} that the data determine)"
    )
    AXIAL_STIFFNESS = (
        "the data fit only with an APA {percent:.1f} % {how} along its axis than the model's, which is "
        "{tolerance:.2g} % uncertain: is the payload {payload_kg:.2f} kg?"
    )
    TABLE_EDGE = "{parameter} = {value:.0f} ± {U:.0f} um reaches the edge of the table, {most:.0f} um"
    TWO_PLACES = "two misalignments explain the data equally: {places}"
    # Verdicts
    OUTSIDE_LIMITS = "{shown}{in_unit} is {side} limit {limit:g}{in_unit}"
    U_UNKNOWN = "inside the limits, but the uncertainty is unknown"
    U_INVALID = "the uncertainty is {U}"
    U_INCLUDES_LIMIT = "the uncertainty interval includes a limit ({value_and_U}{in_unit})"
    RISK_ABOVE_HALF = (
        "the value is inside the limits, but with its U the true value is more likely outside ({value_and_U}{in_unit})"
    )
    U_TOO_LARGE = "U = {U:.3g}{in_unit} is above the {most:g}{in_unit} that shared risk allows"
    U_BESIDE_ZONE = (
        "U = {U:.3g}{in_unit} is too large beside the limits: their decision rule allows at most {most:.3g}{in_unit}"
    )
    CALIBRATION = "no valid calibration: {detail}"
    LEARNED_BENCH = "model {model}: {detail}; learn the bench again (`accept model learn`)"
    FOLDER_NAME = "its folder is called {name}, which is the serial of another unit: which of the two was measured?"
    READ_OTHERWISE = "the same recording, read otherwise: {detail}"
    SERIAL_ALIKE = "its serial looks like {name}, which the store knows: which of the two was measured?"
    PART_DOUBTED = "each part is accepted before it is built in, and stands in one strut: {detail}"
    NONCONFORMANCE = "held: {detail}. Quality assurance decides"
    SUPERSEDED = "an earlier attempt is against it: {detail}. Quality assurance decides"
    MEMORY_LIMIT = "the records are too large: judging them takes more memory than a worker has ({most:g} GB)"
    INTERNAL_ERROR = "the check stopped on an internal error: {detail}"
    CANNOT_ESTIMATE = "no estimate: {detail}"

    @property
    def code(self) -> str:
        """Return the name of this cause in results.json."""
        return self.name.lower()


def declare_record(name: str, label: str) -> None:
    """Name an input of a check as sentences do: `torsion_left` is "torsion, hit at the left"."""
    _RECORDS[name] = label


def record_label(name: str) -> str:
    """Return the label of an input of a check, or its name if its declaration has no label."""
    return _RECORDS.get(name, name)


@dataclass(frozen=True)
class Reason:
    """A cause with its parameters. record: the input that it is about; file: of that record; also: further causes."""

    cause: Cause
    parameters: Mapping[str, Any] = field(default_factory=dict)
    record: str = ""
    file: str = ""
    also: tuple["Reason", ...] = ()

    def __post_init__(self) -> None:
        self.sentence()  # a parameter that is missing shows where the reason is made

    def __str__(self) -> str:
        return "; ".join(reason.sentence() for reason in self.all())

    def sentence(self) -> str:
        """Return the sentence of this cause, without the others."""
        shown = {k: CHANNEL_LABELS.get(v, v) if k in _CHANNELS else v for k, v in self.parameters.items()}
        if "parameter" in shown:
            shown["parameter"] = model_label(shown["parameter"])
        shown["in_unit"] = "" if shown.get("unit", DIMENSIONLESS) == DIMENSIONLESS else f" {shown['unit']}"
        if isinstance(U := shown.get("U"), int | float):
            shown["value_and_U"] = with_U(shown["value"], U) if U > 0 and "value" in shown else ""
        shown.setdefault("shown", shown.get("value"))  # of a value, as it stands beside its U
        for key in ("one", "other"):  # stored before quantities were called by their labels: by their names
            shown.setdefault(f"{key}_called", shown.get(key))
        if "other_record" in shown:
            shown["other_record"] = record_label(shown["other_record"])
        record = record_label(self.record)
        where = f"{record} ({self.file})" if record and self.file else record or self.file
        words = self.cause.value.format(**shown)
        return f"{where}: {words}" if where else words

    def all(self) -> Iterator["Reason"]:
        """Yield this reason by itself, then the others that it carries."""
        yield replace(self, also=())
        for reason in self.also:
            yield from reason.all()

    def within(self, record: str, file: str = "") -> "Reason":
        """Return the same reason for a record of the check."""
        return replace(self, record=self.record or record, file=self.file or file)

    def to_json(self) -> dict[str, Any]:
        about = {"record": self.record, "file": self.file, "also": [r.to_json() for r in self.also]}
        return {"code": self.cause.code, **self.parameters} | {k: v for k, v in about.items() if v}

    @classmethod
    def from_json(cls, entry: Mapping[str, Any]) -> "Reason":
        """Return the reason of a JSON object. Raises KeyError if its code or a parameter is unknown here."""
        about = {key: entry.get(key, "") for key in ("record", "file")}
        parameters = {k: v for k, v in entry.items() if k not in ("code", "record", "file", "also")}
        return cls(
            Cause[str(entry["code"]).upper()],
            parameters,
            **about,
            also=tuple(cls.from_json(r) for r in entry.get("also", ())),
        )

    @classmethod
    def __get_pydantic_core_schema__(cls, *_: Any) -> CoreSchema:
        """Let typed documents hold reasons. An unknown code, of another version of the program, is kept as text."""
        return no_info_plain_validator_function(
            cls.read, serialization=plain_serializer_function_ser_schema(cls.to_json)
        )

    @classmethod
    def read(cls, entry: Any) -> "Reason":
        """Return the reason of a JSON object; an unknown code, of another version, is kept as text. Raises ValueError
        if it is not such an object."""
        try:
            return cls.from_json(entry)
        except KeyError as e:
            return because(Cause.IN_WORDS, detail=f"{entry.get('code', 'a cause')} of another version ({e} is unknown)")
        except (TypeError, AttributeError) as e:
            raise ValueError("a cause is an object with its code") from e


def because(cause: Cause, *, record: str = "", file: str = "", **parameters: Any) -> Reason:
    """Return the reason with this cause and these parameters, numbers as plain Python numbers."""
    return Reason(cause, {k: v.item() if hasattr(v, "item") else v for k, v in parameters.items()}, record, file)


def together(reasons: Sequence[Reason]) -> Reason:
    """Return several reasons as one, the first in front, without duplicates."""
    flat = [r for reason in reasons for r in reason.all()]
    first, *rest = (r for i, r in enumerate(flat) if r not in flat[:i])
    return replace(first, also=tuple(rest))


class NoResult(Exception):
    """Error for data that do not carry an answer. Made from a reason, or from a cause and its parameters. panels: what
    can be seen of the data all the same (checks.picture), by name."""

    def __init__(self, reason: Reason | Cause, *, record: str = "", file: str = "", **parameters: Any) -> None:
        self.reason = reason if isinstance(reason, Reason) else because(reason, record=record, file=file, **parameters)
        super().__init__(self.reason)
        self.panels: Mapping[str, Any] = {}
