"""LCR meters that speak SCPI, by VISA (LAN, USB, GPIB, serial): C and D at 1 kHz.

Known from public drivers of the E4980A and the 4284A, which have the same commands: `*IDN?` gives maker, model, serial
number, firmware; `FUNC:IMP`, `FUNC:DEV<n>:MODE`, `FREQ`, `VOLT`, `BIAS:STAT`, `APER`, `TRIG:SOUR`, `CORR:LENG`,
`CORR:OPEN:STAT`, `CORR:SHOR:STAT`, each with its question; `FETC?` -> primary, secondary, status, where only status 0
is a measurement. A 4284A gives no serial number (0).
Assumed: everything of the profiles `hioki` (IM35xx) and `gwinstek` (LCR-6000, LCR-8000), written from their command
lists without a page at hand. A command that is none shows at once: what is set is asked before and after every reading.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from hw.errors import Garbled, Implausible, InstrumentRefused, OverRange, SettingsError
from hw.instruments.driver import Ask, Driver, Instrument, Trial, settings_of
from hw.instruments.reading import Identity, Reading
from hw.instruments.serial_instrument import Seconds, SerialInstrument, SerialSettings, text_of
from hw.link import Deadline, Link
from hw.network_port import Address, visa_opener
from specs.bench import InstrumentEntry
from specs.strict import Positive

END = b"\n"
OVER = 9e37  # what SCPI writes for "no number"
NUMBER = re.compile(r"[+-]?\d+(\.\d*)?(E[+-]?\d+)?", re.IGNORECASE)


@dataclass(frozen=True)
class MeterSetting:
    """What is set by `command` ("" : only asked) and read back by `question`; wanted may hold {volt}, {average},
    {cable}."""

    command: str
    question: str
    wanted: str


@dataclass(frozen=True)
class Profile:
    """models: of `*IDN?`. settings: by name, in their order. measure: its answer is C, D and, with a status, 0."""

    models: str
    settings: Mapping[str, MeterSetting]
    measure: str
    status: bool


PROFILES = {
    "keysight": Profile(
        "E4980AL?|4284A",
        {
            "function": MeterSetting("FUNC:IMP CSD", "FUNC:IMP?", "CSD"),
            "range": MeterSetting("FUNC:IMP:RANG:AUTO ON", "FUNC:IMP:RANG:AUTO?", "1"),
            "deviation of C": MeterSetting("FUNC:DEV1:MODE OFF", "FUNC:DEV1:MODE?", "OFF"),
            "deviation of D": MeterSetting("FUNC:DEV2:MODE OFF", "FUNC:DEV2:MODE?", "OFF"),
            "bias": MeterSetting("BIAS:STAT OFF", "BIAS:STAT?", "0"),
            "frequency": MeterSetting("FREQ 1000", "FREQ?", "1000"),
            "level": MeterSetting("VOLT {volt:g}", "VOLT?", "{volt:g}"),
            "averaging": MeterSetting("APER LONG,{average}", "APER?", "LONG,{average}"),
            "cable": MeterSetting("CORR:LENG {cable:g}", "CORR:LENG?", "{cable:g}"),
            "open correction": MeterSetting("", "CORR:OPEN:STAT?", "1"),
            "short correction": MeterSetting("", "CORR:SHOR:STAT?", "1"),
            "load correction": MeterSetting("", "CORR:LOAD:STAT?", "0"),
            "trigger": MeterSetting("TRIG:SOUR BUS", "TRIG:SOUR?", "BUS"),
        },
        "TRIG:IMM;:FETC?",
        True,
    ),
    "hioki": Profile(
        r"IM35\d\d.*",
        {
            "header": MeterSetting(":HEAD OFF", ":HEAD?", "OFF"),
            "first value": MeterSetting(":PAR1 CS", ":PAR1?", "CS"),
            "second value": MeterSetting(":PAR2 OFF", ":PAR2?", "OFF"),
            "third value": MeterSetting(":PAR3 D", ":PAR3?", "D"),
            "fourth value": MeterSetting(":PAR4 OFF", ":PAR4?", "OFF"),
            "range": MeterSetting(":RANG:AUTO ON", ":RANG:AUTO?", "ON"),
            "bias": MeterSetting(":DCB OFF", ":DCB?", "OFF"),
            "frequency": MeterSetting(":FREQ 1000", ":FREQ?", "1000"),
            "level mode": MeterSetting(":LEV V", ":LEV?", "V"),
            "level": MeterSetting(":LEV:VOLT {volt:g}", ":LEV:VOLT?", "{volt:g}"),
            "speed": MeterSetting(":SPEE SLOW", ":SPEE?", "SLOW"),
            "averaging": MeterSetting(":AVER {average}", ":AVER?", "{average}"),
            "cable": MeterSetting(":CABL {cable:g}", ":CABL?", "{cable:g}"),
            "open correction": MeterSetting("", ":CORR:OPEN?", "ON"),
            "short correction": MeterSetting("", ":CORR:SHOR?", "ON"),
            "scaling": MeterSetting(":SCAL OFF", ":SCAL?", "OFF"),
            "trigger": MeterSetting(":TRIG EXT", ":TRIG?", "EXT"),
        },
        "*TRG;:MEAS?",
        False,
    ),
    "gwinstek": Profile(
        r"LCR-?[68]\d\d\d.*",
        {
            "function": MeterSetting("FUNC Cs-D", "FUNC?", "CS-D"),
            "range": MeterSetting("FUNC:RANG:AUTO ON", "FUNC:RANG:AUTO?", "ON"),
            "bias": MeterSetting("BIAS OFF", "BIAS?", "OFF"),
            "frequency": MeterSetting("FREQ 1000", "FREQ?", "1000"),
            "level": MeterSetting("LEV:VOLT {volt:g}", "LEV:VOLT?", "{volt:g}"),
            "averaging": MeterSetting("APER SLOW,{average}", "APER?", "SLOW,{average}"),
            "open correction": MeterSetting("", "CORR:OPEN:STAT?", "ON"),
            "short correction": MeterSetting("", "CORR:SHOR:STAT?", "ON"),
            "trigger": MeterSetting("TRIG:SOUR BUS", "TRIG:SOUR?", "BUS"),
        },
        "TRIG;:FETC?",
        False,
    ),
}


class ScpiLcrSettings(SerialSettings):
    """Settings of a SCPI meter. average : measurements in one value. cable_m : length of the test leads, as the meter
    corrects for it. corrections : "require" refuses to measure without open and short correction. library : of VISA."""

    profile: Literal["keysight", "hioki", "gwinstek"]
    voltage_V: Annotated[float, Field(gt=0, le=2)] = 1.0
    average: Annotated[int, Field(ge=1, le=128)] = 4
    cable_m: Literal[0, 1, 2, 4] = 1
    corrections: Literal["require", "allow"] = "require"
    agreement_percent: Positive = 0.1
    agreement_D: Positive = 0.002
    range_uF: Annotated[list[float], Field(min_length=2, max_length=2)] = Field(default_factory=lambda: [0.01, 100.0])
    max_D: Positive = 0.2
    library: str = "@py"
    timeout_s: Seconds = 5.0
    deadline_s: Seconds = 40.0


class ScpiLcr(SerialInstrument[ScpiLcrSettings]):
    """Capacitance [F] and dissipation of a stack at 1 kHz, small signal."""

    unit = "F"
    reminders: tuple[str, ...] = (
        "The stack is electrically poled: discharge it before connecting; never bias it against its poling.",
    )

    @property
    def _profile(self) -> Profile:
        return PROFILES[self.settings.profile]

    def _within(self, first: Reading) -> float:
        return first.value * self.settings.agreement_percent / 100.0

    @property
    def _more_within(self) -> float:
        return self.settings.agreement_D

    def _start(self, deadline: Deadline) -> None:
        """On a connection of its own: what was asked before an error answers nothing after it."""
        self.link.close()
        super()._start(deadline)

    def _set_up(self, _: Deadline) -> None:
        for setting in self._profile.settings.values():
            if setting.command:
                self._say(self._filled(setting.command).encode("ascii") + END)

    def _identify(self, deadline: Deadline) -> Identity:
        said = self._question("*IDN?", deadline)
        fields = [field.strip() for field in said.split(",")]
        if len(fields) < 3 or not re.fullmatch(self._profile.models, fields[1]):
            raise Garbled(f"{self.name}: *IDN? gave {said!r}, expected maker, {self._profile.models}, serial number")
        serial = re.sub(r"^SN:?\s*", "", fields[2]).strip()
        return Identity(fields[1], None if serial in ("", "0") else serial, ",".join(fields[3:]) or None)

    def _ask_settings(self, deadline: Deadline) -> Mapping[str, str]:
        """All settings, as they must be. Raises InstrumentRefused with a bias on or without corrections,
        Implausible."""
        found = {}
        for name, setting in self._profile.settings.items():
            wanted, said = self._filled(setting.wanted), self._question(setting.question, deadline)
            found[name] = said
            if _same(said, wanted) or ("correction" in name and self.settings.corrections == "allow"):
                continue
            if "correction" in name or name == "bias":
                raise InstrumentRefused(
                    f"{self.name}: {name} is {said!r}, expected {wanted!r}: correct it at the meter"
                )
            raise Implausible(f"{self.name}: {name} is {said!r}, expected {wanted!r}; was it changed at the meter?")
        return found

    def _filled(self, words: str) -> str:
        settings = self.settings
        return words.format(volt=settings.voltage_V, average=settings.average, cable=settings.cable_m)

    def _question(self, message: str, deadline: Deadline) -> str:
        return text_of(self.name, self._ask(message.encode("ascii") + END, END, deadline).rstrip(b"\r\n")).strip()

    def _measure(self, deadline: Deadline) -> Reading:
        said = self._question(self._profile.measure, deadline)
        C, D = parse_measured(self.name, said, self._profile.status)
        lo, hi = self.settings.range_uF
        if not lo <= C * 1e6 <= hi:
            raise Implausible(
                f"{self.name}: C = {C * 1e6:g} uF is outside {lo:g} to {hi:g} uF, as the bench file has it"
            )
        if not 0.0 <= D <= self.settings.max_D:
            raise Implausible(f"{self.name}: D = {D:g} is outside 0 to {self.settings.max_D:g}")
        return Reading(C, self.unit, self._now(), (said.encode("ascii"),), {"D": D})


def parse_measured(who: str, said: str, status: bool) -> tuple[float, float]:
    """C [F] and D of `C,D` or `C,D,status`. Raises Garbled, OverRange, InstrumentRefused."""
    fields = [field.strip() for field in said.split(",")]
    expected = (3, 4) if status else (2,)
    if len(fields) not in expected or not all(NUMBER.fullmatch(field) for field in fields):
        raise Garbled(f"{who}: {said!r}, expected C, D{' and the status' if status else ''}")
    C, D = float(fields[0]), float(fields[1])
    if max(abs(C), abs(D)) >= OVER or (status and float(fields[2]) == 1):
        raise OverRange(f"{who}: {said!r}: over range; is the stack connected, and discharged?")
    if status and float(fields[2]) != 0:
        raise InstrumentRefused(f"{who}: {said!r}: status {fields[2]} is no measurement")
    return C, D


def _same(said: str, wanted: str) -> bool:
    """As numbers where they are numbers, field by field."""
    one, other = ([field.strip().upper() for field in words.split(",")] for words in (said, wanted))
    if len(one) != len(other):
        return False
    numbers = [NUMBER.fullmatch(a) and NUMBER.fullmatch(b) for a, b in zip(one, other, strict=True)]
    return all(
        abs(float(a) - float(b)) <= 1e-3 * abs(float(b)) if number else a == b
        for a, b, number in zip(one, other, numbers, strict=True)
    )


def _open(name: str, entry: InstrumentEntry, _: Ask) -> Instrument:
    settings = settings_of(name, ScpiLcrSettings, entry)
    if entry.resource is None:
        raise SettingsError(f"{name}: resource is missing: the meter's VISA name, such as TCPIP::192.168.1.7::INSTR")
    link = Link(Address(entry.resource), visa_opener(settings.library, settings.timeout_s))
    return ScpiLcr(name, link, settings, entry.model, entry.serial)


TRIALS = tuple(
    Trial(f"At the meter, {words}")
    for words in (
        "set the function to Cp-D",
        "set the deviation display to ABS or %",
        "set the frequency to 120 Hz",
        "set the level to its smallest",
        "switch the open correction off",
        "set the cable length to another value",
        "switch the meter off and on again",
    )
)
DRIVER = Driver(("scpi_lcr",), _open, TRIALS)
