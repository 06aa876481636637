"""LCR meters that speak SCPI, by VISA (LAN, USB, GPIB, serial): C and D at 1 kHz.

Known from public drivers of the E4980A and the 4284A, which have the same commands: `*IDN?` gives maker, model, serial
number, firmware; `FUNC:IMP`, `FUNC:DEV<n>:MODE`, `FREQ`, `VOLT`, `BIAS:STAT`, `APER`, `TRIG:SOUR`, `CORR:LENG`,
`CORR:OPEN:STAT`, `CORR:SHOR:STAT`, `DISP:PAGE`, `INIT:CONT`, `FORM`, `AMPL:ALC`, `COMP`, each with its question;
`SYST:ERR?` gives number and words of the oldest error, number 0 for none, and `*CLS` empties the queue. `FETC?` ->
primary, secondary, status, where only status 0 is a measurement; a comparator that is on adds the bin, the list sweep
adds in or out: a fourth field is refused, and both are switched off. Without `INIT:CONT ON` the meter ignores the
trigger (-211) and `FETC?` repeats the measurement before. A 4284A gives no serial number (0). Assumed: everything of
the profiles `hioki` (IM35xx) and `gwinstek` (LCR-6000, LCR-8000), written from their command lists without a manual's
page at hand. A command that does not exist shows at once, because every setting is asked before and after every
reading."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

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
OVER = 9e37  # "no number" in SCPI
REMINDER = "The stack is electrically poled: discharge it before connecting; never bias it against its poling."
BLIND = "The profile {!r} was written without the meter's manual: compare its display with what is read here."
NUMBER = re.compile(r"[+-]?\d+(\.\d*)?(E[+-]?\d+)?", re.IGNORECASE)
ERROR = re.compile(r'([+-]?\d+),"?.*')  # an entry of the error queue


@dataclass(frozen=True)
class MeterSetting:
    """A setting: `header` and `wanted` set it, `header` and ? ask for it. sets: False for a setting that is only asked.
    wanted may hold {volt}, {average}, {cable}, {level_control}."""

    header: str
    wanted: str
    sets: bool = True


@dataclass(frozen=True)
class Profile:
    """The dialect of a family of meters. models: of `*IDN?`. settings: by name, in their order. measure: its answer is
    C, D and, with a status, 0. errors: whether `SYST:ERR?` is asked. blind: no page of a manual was at hand."""

    models: str
    settings: Mapping[str, MeterSetting]
    measure: str
    status: bool
    errors: bool = False
    blind: bool = False


PROFILES = {
    "keysight": Profile(
        "E4980AL?|4284A",
        {
            "page": MeterSetting("DISP:PAGE", "MEAS"),
            "format": MeterSetting("FORM", "ASC"),
            "function": MeterSetting("FUNC:IMP", "CSD"),
            "range": MeterSetting("FUNC:IMP:RANG:AUTO", "1"),
            "deviation of C": MeterSetting("FUNC:DEV1:MODE", "OFF"),
            "deviation of D": MeterSetting("FUNC:DEV2:MODE", "OFF"),
            "bias": MeterSetting("BIAS:STAT", "0"),
            "frequency": MeterSetting("FREQ", "1000"),
            "level": MeterSetting("VOLT", "{volt:g}"),
            "level control": MeterSetting("AMPL:ALC", "{level_control}"),
            "averaging": MeterSetting("APER", "LONG,{average}"),
            "comparator": MeterSetting("COMP", "0"),
            "cable": MeterSetting("CORR:LENG", "{cable:g}"),
            "open correction": MeterSetting("CORR:OPEN:STAT", "1", sets=False),
            "short correction": MeterSetting("CORR:SHOR:STAT", "1", sets=False),
            "load correction": MeterSetting("CORR:LOAD:STAT", "0", sets=False),
            "trigger": MeterSetting("TRIG:SOUR", "BUS"),
            "continuous initiation": MeterSetting("INIT:CONT", "1"),
        },
        "TRIG:IMM;:FETC?",
        status=True,
        errors=True,
    ),
    "hioki": Profile(
        r"IM35\d\d.*",
        {
            "header": MeterSetting(":HEAD", "OFF"),
            "first value": MeterSetting(":PAR1", "CS"),
            "second value": MeterSetting(":PAR2", "OFF"),
            "third value": MeterSetting(":PAR3", "D"),
            "fourth value": MeterSetting(":PAR4", "OFF"),
            "range": MeterSetting(":RANG:AUTO", "ON"),
            "bias": MeterSetting(":DCB", "OFF"),
            "frequency": MeterSetting(":FREQ", "1000"),
            "level mode": MeterSetting(":LEV", "V"),
            "level": MeterSetting(":LEV:VOLT", "{volt:g}"),
            "speed": MeterSetting(":SPEE", "SLOW"),
            "averaging": MeterSetting(":AVER", "{average}"),
            "cable": MeterSetting(":CABL", "{cable:g}"),
            "open correction": MeterSetting(":CORR:OPEN", "ON", sets=False),
            "short correction": MeterSetting(":CORR:SHOR", "ON", sets=False),
            "scaling": MeterSetting(":SCAL", "OFF"),
            "trigger": MeterSetting(":TRIG", "EXT"),
        },
        "*TRG;:MEAS?",
        status=False,
        blind=True,
    ),
    "gwinstek": Profile(
        r"LCR-?[68]\d\d\d.*",
        {
            "function": MeterSetting("FUNC", "Cs-D"),
            "range": MeterSetting("FUNC:RANG:AUTO", "ON"),
            "bias": MeterSetting("BIAS", "OFF"),
            "frequency": MeterSetting("FREQ", "1000"),
            "level": MeterSetting("LEV:VOLT", "{volt:g}"),
            "averaging": MeterSetting("APER", "SLOW,{average}"),
            "open correction": MeterSetting("CORR:OPEN:STAT", "ON", sets=False),
            "short correction": MeterSetting("CORR:SHOR:STAT", "ON", sets=False),
            "trigger": MeterSetting("TRIG:SOUR", "BUS"),
        },
        "TRIG;:FETC?",
        status=False,
        blind=True,
    ),
}


class ScpiLcrSettings(SerialSettings):
    """Settings of a SCPI meter. average : measurements in one value. cable_m : length of the test leads, as the meter
    corrects for it. level_control : whether the meter holds the level at the stack (ALC). corrections : "require"
    refuses to measure without open and short correction. library : of VISA."""

    profile: Literal["keysight", "hioki", "gwinstek"]
    voltage_V: Annotated[float, Field(gt=0, le=2)] = 1.0
    average: Annotated[int, Field(ge=1, le=128)] = 4
    cable_m: Literal[0, 1, 2, 4] = 1
    level_control: Literal["off", "on"] = "off"
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

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.reminders = (REMINDER, BLIND.format(self.settings.profile)) if self._profile.blind else (REMINDER,)

    @property
    def _profile(self) -> Profile:
        return PROFILES[self.settings.profile]

    def _within(self, first: Reading) -> float:
        return first.value * self.settings.agreement_percent / 100.0

    @property
    def _more_within(self) -> float:
        return self.settings.agreement_D

    def _start(self, deadline: Deadline) -> None:
        """Connect again after an error, so that no late answer is taken for another."""
        self.link.close()
        super()._start(deadline)

    def _settings_found(self, deadline: Deadline) -> Mapping[str, str]:
        """Return the meter's settings by header, without the bias, which the program never switches on."""
        return {
            setting.header: self._question(f"{setting.header}?", deadline)
            for name, setting in self._profile.settings.items()
            if setting.sets and name != "bias"
        }

    def _set_up(self, _: Deadline) -> None:
        if self._profile.errors:
            self._say(b"*CLS" + END)
        for setting in self._profile.settings.values():
            if setting.sets:
                self._say(f"{setting.header} {self._wanted(setting)}".encode("ascii") + END)

    def _give_back(self, found: Mapping[str, str], deadline: Deadline) -> None:
        ours = {setting.header: self._wanted(setting) for setting in self._profile.settings.values()}
        for header, value in reversed(list(found.items())):
            if not _same(value, ours[header]):
                self._say(f"{header} {value}".encode("ascii") + END)
        self._question("*OPC?", deadline)  # it has heard all of it before the line is closed

    def _identify(self, deadline: Deadline) -> Identity:
        reply = self._question("*IDN?", deadline)
        fields = [field.strip() for field in reply.split(",")]
        if len(fields) < 3 or not re.fullmatch(self._profile.models, fields[1]):
            raise Garbled(f"{self.name}: *IDN? gave {reply!r}, expected maker, {self._profile.models}, serial number")
        serial = re.sub(r"^SN:?\s*", "", fields[2]).strip()
        return Identity(fields[1], None if serial in ("", "0") else serial, ",".join(fields[3:]) or None)

    def _ask_settings(self, deadline: Deadline) -> Mapping[str, str]:
        """Return all settings, if they are as required and the meter reports no error. Raises InstrumentRefused if the
        bias is on, a correction is missing or the error queue is not empty, Implausible."""
        found = {}
        for name, setting in self._profile.settings.items():
            wanted, reply = self._wanted(setting), self._question(f"{setting.header}?", deadline)
            found[name] = reply
            if _same(reply, wanted) or ("correction" in name and self.settings.corrections == "allow"):
                continue
            if "correction" in name or name == "bias":
                raise InstrumentRefused(
                    f"{self.name}: {name} is {reply!r}, expected {wanted!r}: correct it at the meter"
                )
            raise Implausible(f"{self.name}: {name} is {reply!r}, expected {wanted!r}; was it changed at the meter?")
        if self._profile.errors:
            self._check_error_queue(deadline)
        return found

    def _check_error_queue(self, deadline: Deadline) -> None:
        """Raise InstrumentRefused if the meter could not execute a command, such as -211, trigger ignored."""
        reply = self._question("SYST:ERR?", deadline)
        number = ERROR.fullmatch(reply)
        if number is None:
            raise Garbled(f"{self.name}: SYST:ERR? gave {reply!r}, expected a number and words")
        if int(number[1]) != 0:
            raise InstrumentRefused(f"{self.name}: the meter reports the error {reply}; what it shows is not measured")

    def _wanted(self, setting: MeterSetting) -> str:
        settings = self.settings
        return setting.wanted.format(
            volt=settings.voltage_V,
            average=settings.average,
            cable=settings.cable_m,
            level_control=int(settings.level_control == "on"),
        )

    def _question(self, message: str, deadline: Deadline) -> str:
        return text_of(self.name, self._ask(message.encode("ascii") + END, END, deadline).rstrip(b"\r\n")).strip()

    def _measure(self, deadline: Deadline) -> Reading:
        reply = self._question(self._profile.measure, deadline)
        C, D = parse_measured(self.name, reply, self._profile.status)
        lo, hi = self.settings.range_uF
        if not lo <= C * 1e6 <= hi:
            raise Implausible(
                f"{self.name}: C = {C * 1e6:g} uF is outside {lo:g} to {hi:g} uF, as the bench file has it"
            )
        if not 0.0 <= D <= self.settings.max_D:
            raise Implausible(f"{self.name}: D = {D:g} is outside 0 to {self.settings.max_D:g}")
        return Reading(C, self.unit, self._now(), (reply.encode("ascii"),), {"D": D})


def parse_measured(who: str, said: str, status: bool) -> tuple[float, float]:
    """Return C [F] and D of `C,D` or `C,D,status`. Raises Garbled, OverRange, InstrumentRefused."""
    fields = [field.strip() for field in said.split(",")]
    if len(fields) != (3 if status else 2) or not all(NUMBER.fullmatch(field) for field in fields):
        raise Garbled(f"{who}: {said!r}, expected C, D{' and the status' if status else ''}")
    C, D = float(fields[0]), float(fields[1])
    if max(abs(C), abs(D)) >= OVER or (status and float(fields[2]) == 1):
        raise OverRange(f"{who}: {said!r}: over range; is the stack connected, and discharged?")
    if status and float(fields[2]) != 0:
        raise InstrumentRefused(f"{who}: {said!r}: status {fields[2]} is no measurement")
    return C, D


def _same(stated: str, wanted: str) -> bool:
    """Compare field by field, as numbers if both are numbers."""
    one, other = ([field.strip().upper() for field in words.split(",")] for words in (stated, wanted))
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


TRIALS = (
    *(
        Trial(f"At the meter, {words}")
        for words in (
            "set the function to Cp-D",
            "set the deviation display to ABS or %",
            "set the frequency to 120 Hz",
            "set the level to its smallest",
            "switch the open correction off",
            "change to the page LIST SWEEP, with one point at 120 Hz",
            "by another program or the panel, stop the trigger (INIT:CONT OFF)",
            "set the cable length to another value",
        )
    ),
    Trial("Switch the meter off and on again", asked=False),
)
DRIVER = Driver(("scpi_lcr",), _open, TRIALS)
