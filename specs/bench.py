"""The bench file: its instruments, their connection, accuracy and calibration; and how the rig writes its records."""

import datetime
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from pydantic import Field, ValidationError, field_validator, model_validator

from specs.spec import StatedU
from specs.strict import Finite, Positive, Strict, Words, file_bytes, parse_as, problem_line

# Voltages, frequency bands and gains of the bench.
STACK_V = (-20.0, 150.0)  # of the stacks ([STB] 2.3)
AMPLIFIER_GAIN = 20.0  # from the DAC to the stacks ([STB] 2.3, 3.1)
DAC_V = (-10.0, 10.0)  # of the converters
RECORDED_V = 10.5  # largest voltage that a converter of +-10 V records, with overrange
STATIC_HZ = (10.0, 20.0)  # [STB] 4.2.3: below the resonance, the gain is the static one
# um per volt at the DAC. Two stacks move 1.43 um per volt over their whole range ([STB] 2.3), 28.6 behind the amplifier
# of 20; small signals move less, by up to a third ([STB] 4.2: 17.5); one stack alone half of that.
GAIN_UM_PER_V = [15.0, 40.0]

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,40}$")]
OFFLINE = "offline"  # no wire to it: the file has it for its calibration
SIMULATED = "simulated"  # the recorder that plays the simulated unit


class LineEntry(Strict):
    """Settings of the serial line; every key is required, for no value can be assumed."""

    port: Words
    baud: Annotated[int, Field(ge=50, le=921_600)]
    data_bits: Annotated[int, Field(ge=7, le=8)]
    parity: Words
    stop_bits: Annotated[int, Field(ge=1, le=2)]
    handshake: Words


class CalibrationEntry(Strict):
    """certificate: its number; issuer: the laboratory, with its accreditation. calibrated: first day, due: last day."""

    certificate: Words
    issuer: Words | None = None
    calibrated: datetime.date | None = None
    due: datetime.date

    @field_validator("calibrated", "due", mode="before")
    @classmethod
    def _a_day(cls, day: object) -> object:
        if isinstance(day, datetime.datetime) or not isinstance(day, datetime.date):
            raise ValueError(f"expected a date such as 2027-05-01, got {day!r}")
        return day

    @model_validator(mode="after")
    def _in_order(self) -> "CalibrationEntry":
        if self.calibrated is not None and self.calibrated > self.due:
            raise ValueError(f"calibrated = {self.calibrated} is after due = {self.due}")
        return self


class ReferenceEntry(Strict):
    """A reference artefact: a step block, a capacitance standard, a mass. value, U: of its certificate, in `unit`, that
    of the instrument's accuracy; due: the last day of the certificate."""

    what: Words
    value: Finite
    unit: Words
    U: Positive
    certificate: Words
    due: datetime.date | None = None


class InstrumentEntry(Strict):
    """One instrument. driver: its driver, `offline` if it is read by hand. measures: its checks. link: its serial line;
    resource: instead, a VISA name or host:number. settings: the driver's own. accuracy: expanded uncertainty (k = 2) of
    its readings, by the check's input. reference: the artefact of its daily comparison."""

    driver: Words
    measures: list[Words]
    model: Words | None = None
    serial: Words | None = None
    link: LineEntry | None = None
    resource: Words | None = None
    settings: dict[str, Any] = Field(default_factory=dict)
    accuracy: StatedU | None = None
    calibration: CalibrationEntry | None = None
    reference: ReferenceEntry | None = None


class RecorderChannel(Strict):
    """One input of a recorder. physical: its name there, as `Dev1/ai0`, or `2`, the second input of an audio interface;
    `drive`: the played signal, if one clock plays and records. gain: the channel is the voltage there (of an audio
    interface the part of full scale) times `gain`, in `unit`. range: end of the converter's range, in the same number.
    iepe_mA: current that feeds the sensor. integrations: 2 for an accelerometer whose channel is a displacement or an
    angle. calibration: of the sensor."""

    physical: Words
    gain: Finite = 1.0
    unit: Words
    range: Positive | None = None
    iepe_mA: Positive | None = None
    integrations: Annotated[int, Field(ge=0, le=2)] = 0
    calibration: CalibrationEntry | None = None

    @model_validator(mode="after")
    def _a_gain(self) -> "RecorderChannel":
        if self.gain == 0.0:
            raise ValueError("gain = 0, expected the factor from the converter's number to the channel")
        return self


class DriveOutput(Strict):
    """The output that plays the drive. gain: voltage at the amplifier's input for 1 at the output, which is a volt, or
    full scale of an audio interface. range: end of the output's range, in the same number."""

    physical: Words
    gain: Positive = 1.0
    range: Positive | None = None


class RecorderEntry(Strict):
    """One recorder: inputs, and usually an output, on one clock. driver: its back end; measures: the checks of its
    records. channels: name in the records -> input; drive: its output, None without one. rate_Hz: its rate, if it
    cannot run at the step's. response_s: length of a frequency response's record."""

    driver: Words
    measures: list[Words]
    model: Words | None = None
    serial: Words | None = None
    settings: dict[str, Any] = Field(default_factory=dict)
    channels: Annotated[dict[Words, RecorderChannel], Field(min_length=1)]
    drive: DriveOutput | None = None
    rate_Hz: Positive | None = None
    response_s: Annotated[float, Field(ge=2.0, le=600.0)] = 100.0
    calibration: CalibrationEntry | None = None


TIME = "t"


class ChannelSource(Strict):
    """The source of a channel in the records. name: in the file, of a structure `outer.inner` or its last part; None:
    the same as here. gain, unit: the channel is the number there times `gain`, in `unit`; without a unit in the one
    that the check declares. sampling_time_s: of the time alone, for records without a time vector."""

    name: Words | None = None
    gain: Finite = 1.0
    unit: Words | None = None
    sampling_time_s: Positive | None = None

    @model_validator(mode="after")
    def _one_or_the_other(self) -> "ChannelSource":
        if self.gain == 0.0:
            raise ValueError("gain = 0, expected the factor from the number in the file to the channel")
        if self.sampling_time_s is not None and (self.name, self.gain, self.unit) != (None, 1.0, None):
            raise ValueError("sampling_time_s stands alone: there is no time vector then")
        return self

    def to_toml(self) -> str | dict[str, Any]:
        """Return the shortest form that is read back as this."""
        given = self.model_dump(exclude_defaults=True)
        return str(given["name"]) if set(given) == {"name"} else given


Channels = Mapping[str, ChannelSource]
NO_CHANNELS: Channels = MappingProxyType({})


def channel_source(given: Any) -> ChannelSource:
    """Return the source that a text (the name) or a table states. Raises ValueError with every problem in one line."""
    try:
        if isinstance(given, ChannelSource):
            return given
        return ChannelSource(name=given) if isinstance(given, str) else ChannelSource.model_validate(given)
    except ValidationError as e:
        raise ValueError("; ".join(problem_line(problem) for problem in e.errors())) from e


def channel_map(given: Mapping[str, Any]) -> dict[str, ChannelSource]:
    """Return the sources of a section [channels]. Raises ValueError naming the channel."""
    found = {}
    for name, value in given.items():
        try:
            found[name] = channel_source(value)
        except ValueError as e:
            raise ValueError(f"{name} = {value!r}: {e}") from e
    check_time_alone(found)
    return found


def check_time_alone(channels: Channels) -> None:
    """Raise ValueError if another channel than the time has a sampling time."""
    if wrong := [name for name, source in channels.items() if source.sampling_time_s is not None and name != TIME]:
        raise ValueError(f"{wrong[0]}: sampling_time_s belongs to '{TIME}'")


class RecordPattern(Strict):
    """pattern: of file names, as `*_low*.mat`. section, name: the input of a check that such a file is."""

    pattern: Words
    section: Words
    name: Words

    def fits(self, file: str) -> bool:
        return fnmatchcase(file, self.pattern)


class RigEntry(Strict):
    """The real-time rig. folder: of its files. records: patterns of file names; the first match counts. channels: name
    here -> name in the records, a name alone or with gain and unit."""

    folder: Words
    records: Annotated[list[RecordPattern], Field(default_factory=list)]
    channels: dict[Words, ChannelSource] = Field(default_factory=dict)

    @field_validator("channels", mode="before")
    @classmethod
    def _names_alone(cls, given: Any) -> Any:
        return channel_map(given) if isinstance(given, dict) else given

    @model_validator(mode="after")
    def _time_alone(self) -> "RigEntry":
        check_time_alone(self.channels)
        return self


class BenchDocument(Strict):
    """The TOML document. stage: file of a simulated bench with the technician's actions. rig: form of the real-time
    rig's records. values: section -> numbers beside a unit's records. recorders: those that this program controls."""

    name: Words
    stage: Words | None = None
    rig: RigEntry | None = None
    values: dict[Words, dict[Words, Finite]] = Field(default_factory=dict)
    instruments: dict[Name, InstrumentEntry] = Field(default_factory=dict)
    recorders: dict[Name, RecorderEntry] = Field(default_factory=dict)

    @property
    def equipment(self) -> dict[str, InstrumentEntry | RecorderEntry]:
        """Return instruments and recorders by name: everything that is calibrated."""
        return {**self.instruments, **self.recorders}

    @property
    def simulated(self) -> bool:
        """Return whether it is a simulated bench, whose readings are no measurements."""
        return self.stage is not None or any(entry.driver == SIMULATED for entry in self.recorders.values())

    @model_validator(mode="after")
    def _names_once(self) -> "BenchDocument":
        if not self.equipment:
            raise ValueError("has neither [instruments.NAME] nor [recorders.NAME]: nothing could be measured")
        if both := sorted(self.instruments.keys() & self.recorders.keys()):
            raise ValueError(f"{', '.join(both)}: the name of an instrument and of a recorder")
        return self

    @model_validator(mode="after")
    def _no_port_twice(self) -> "BenchDocument":
        ports = [entry.link.port for entry in self.instruments.values() if entry.link is not None]
        ports += [entry.resource for entry in self.instruments.values() if entry.resource is not None]
        twice = sorted({port for port in ports if ports.count(port) > 1})
        if twice:
            raise ValueError(f"port {', '.join(twice)} is given to two instruments")
        return self


class BenchFile(BenchDocument):
    """A bench file together with the bytes it was read from."""

    sha256: str
    text: str
    path: str


def load_bench(path: Path) -> BenchFile:
    """Return bench of a TOML file. Raises SpecError listing every problem with its key path."""
    return parse_bench(file_bytes(path), str(path))


def parse_bench(raw: bytes, path: str) -> BenchFile:
    """Return bench from the bytes of a TOML file; `path` is for messages. Raises SpecError."""
    return parse_as(BenchFile, BenchDocument, raw, path, path=path)
