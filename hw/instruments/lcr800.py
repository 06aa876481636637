"""GW Instek LCR-800 series: C and D at 1 kHz.

Known from [LCR800] (pages 87-90, 107-110): messages end LF CR in that order, replies LF; `COMU:OVER`; the result
messages `MAIN:PRIM`, `MAIN:SECO`, `PRIM:OV01`, `PRIM:OVER`, `SECO:OVER`, their fixed widths (7 and 6 characters, the
sign's place blank when positive), a blank before positive numbers, and that the unit of the primary value comes with
the secondary.
Known from drivers (three that agree): `COMU?` -> `COMU:ON..`; every setting is echoed as its acknowledgement;
`MAIN:STAR` is not echoed; kHz with 5 decimals, V with 3; 38400 8N1; the displays VALU, DELT and DELP; no `*IDN?`, so
the serial number cannot be read.
Assumed, so set in the bench file or on the list of the commissioning: five digits of C with at most four before the
point and four of D; a question is answered by its header and the value; series circuit; a new session after a change of
the voltage is not needed (`reopen_after_voltage`, one driver does it); how long a measurement takes (`result_s`)."""

import re
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange
from hw.instruments.driver import Trial, serial_driver
from hw.instruments.reading import Reading, no_value
from hw.instruments.serial_instrument import Seconds, SerialInstrument, SerialSettings, text_of
from hw.link import Deadline
from specs.strict import Positive

END = b"\n"
FARADS = {"pF": 1e-12, "nF": 1e-9, "uF": 1e-6}
PRIMARY = re.compile(r"MAIN:PRIM (?P<field> *-?\d{0,4}\.\d+)")
SECONDARY = re.compile(r"MAIN:SECO (?P<field> *-?\d*\.\d+)(?P<unit>[pnu]F)")
RESULT = re.compile(rb"(MAIN:PRIM|MAIN:SECO|PRIM:OV01|PRIM:OVER|SECO:OVER)")
PRIMARY_WIDTH, SECONDARY_WIDTH = 7, 6
FREQUENCY_KHZ = 1.0  # of the measurement; the limits of a stack are for 1 kHz ([STB] 2.2)
STREAMED = 20  # result lines that may precede an echo while the meter triggers itself
REMINDER = (
    "The stack is electrically poled: discharge it before connecting, keep the meter's internal and external bias off, "
    "and never bias it against its poling."
)


class Lcr800Settings(SerialSettings):
    """Settings of an LCR-800.

    agreement_percent, agreement_D : how far two answers in a row may differ. range_uF : plausible capacitances. max_D :
    largest plausible dissipation of a stack. bias : "refuse" stops if the meter's is on, "allow" does not ask."""

    speed: Literal["SLOW", "MEDI", "FAST"] = "SLOW"
    circuit: Literal["SERI", "PARA"] = "SERI"
    voltage_V: Annotated[float, Field(ge=0.005, le=1.275)] = 1.0
    agreement_percent: Positive = 0.1
    agreement_D: Positive = 0.002
    range_uF: Annotated[list[float], Field(min_length=2, max_length=2)] = Field(default_factory=lambda: [0.01, 100.0])
    max_D: Positive = 0.2
    bias: Literal["refuse", "allow"] = "refuse"
    reopen_after_voltage: bool = False
    primary_digits: Annotated[int, Field(ge=3, le=6)] = 5
    secondary_digits: Annotated[int, Field(ge=2, le=5)] = 4
    result_s: Seconds = 2.5
    deadline_s: Seconds = 20.0


class Lcr800(SerialInstrument[Lcr800Settings]):
    """Capacitance [F] and dissipation of a stack at 1 kHz, small signal."""

    unit = "F"
    reminders: tuple[str, ...] = (REMINDER,)

    def _within(self, first: Reading) -> float:
        return first.value * self.settings.agreement_percent / 100.0

    @property
    def _choices(self) -> dict[str, str]:
        """The settings in the order in which they are set, without frequency and voltage."""
        held = {"TRIG": "MANU", "DISP": "VALU", "MODE": "CD", "R.H.": "OFF."}
        return held | {"CIRC": self.settings.circuit, "SPEE": self.settings.speed}

    @property
    def _numbers(self) -> dict[str, tuple[float, str]]:
        return {"FREQ": (FREQUENCY_KHZ, ".5f"), "VOLT": (self.settings.voltage_V, ".3f")}

    def _open(self, deadline: Deadline) -> None:
        reply = self._command("COMU?", deadline, STREAMED)
        if not re.fullmatch(r"COMU:ON(\.\.)?", reply):
            raise Garbled(f"{self.name}: COMU? gave {reply!r}, expected 'COMU:ON..'; is it an LCR-800?")
        self._set("COMU:OVER", deadline, STREAMED)

    def _settings_found(self, deadline: Deadline) -> Mapping[str, str]:
        """Return the meter's settings, after stopping the trigger: results would come before the answers."""
        found = {"TRIG": self._setting_value("TRIG", deadline, STREAMED)}
        self._set("MAIN:TRIG:MANU", deadline, STREAMED)
        others = [header for header in (*self._choices, *self._numbers) if header != "TRIG"]
        return found | {header: self._setting_value(header, deadline) for header in others}

    def _give_back(self, found: Mapping[str, str], deadline: Deadline) -> None:
        """Restore the settings found at the start, in reverse order, and end the connection."""
        for header, value in reversed(list(found.items())):
            if header in self._numbers:
                if not _is_number(value, self._numbers[header][0]):
                    self._set(f"MAIN:{header} {value}", deadline)
            elif value != self._choices[header].rstrip("."):
                self._set(f"MAIN:{header}:{value.ljust(4, '.') if value in ('ON', 'OFF') else value}", deadline)
        self._set("COMU:OFF.", deadline, STREAMED)

    def _set_up(self, deadline: Deadline) -> None:
        for header, choice in self._choices.items():
            self._set(f"MAIN:{header}:{choice}", deadline, STREAMED if header == "TRIG" else 0)
        for header, (value, form) in self._numbers.items():
            self._set(f"MAIN:{header} {value:{form}}", deadline)
        if self.settings.reopen_after_voltage:  # as one driver does; not known to be needed
            self._set("COMU:OFF.", deadline)
            self._open(deadline)

    def _ask_settings(self, deadline: Deadline) -> Mapping[str, str]:
        """Return every setting that affects a value and has a key. Raises InstrumentRefused with a bias on,
        Implausible."""
        found = {}
        for header, choice in self._choices.items():
            found[header] = self._setting_value(header, deadline)
            self._check(header, found[header], choice.rstrip("."), found[header] == choice.rstrip("."))
        for header, (value, _) in self._numbers.items():
            found[header] = self._setting_value(header, deadline)
            self._check(header, found[header], f"{value:g}", _is_number(found[header], value))
        for header in ("INTB", "EXTB") if self.settings.bias == "refuse" else ():
            found[header] = self._setting_value(header, deadline)
            if found[header] != "OFF":
                raise InstrumentRefused(f"{self.name}: {header} is {found[header]!r}, not off. {REMINDER}")
        return found

    def _check(self, header: str, found: str, wanted: str, same: bool) -> None:
        if not same:
            raise Implausible(
                f"{self.name}: MAIN:{header} is {found!r}, expected {wanted!r}; was it changed at the meter?"
            )

    def _setting_value(self, header: str, deadline: Deadline, streamed: int = 0) -> str:
        """Return the value of a setting, without the blanks and dots that fill its field."""
        reply = self._command(f"MAIN:{header}?", deadline, streamed)
        found = re.fullmatch(rf"MAIN:{re.escape(header)}[: ] *(\S+)", reply.rstrip())
        if not found:
            raise Garbled(f"{self.name}: MAIN:{header}? gave {reply!r}, expected MAIN:{header} and its value")
        return found[1].rstrip(".")

    @property
    def _more_within(self) -> float:
        return self.settings.agreement_D

    def _measure(self, deadline: Deadline) -> Reading:
        self._say(b"MAIN:STAR\n\r")
        primary = self._result(deadline)
        if primary in (b"PRIM:OV01", b"PRIM:OVER"):
            raise OverRange(f"{self.name}: {primary.decode()}: out of range; is the stack connected, and discharged?")
        secondary = self._result(deadline)
        if secondary.startswith(b"SECO:OVER"):
            raise OverRange(f"{self.name}: {secondary.decode('latin-1')}: D is out of range; check the leads")
        C, D = parse_results(self.name, primary, secondary, self.settings)
        return Reading(C, self.unit, self._now(), (primary, secondary), {"D": D})

    def _result(self, deadline: Deadline) -> bytes:
        try:
            line = self.link.read_until(END, deadline.within(self.settings.result_s)).removesuffix(END)
        except NoReply as e:
            raise NoReply(f"{self.name}: no result within {self.settings.result_s:g} s of MAIN:STAR ({e})") from e
        return line.strip(b"\r")

    def _set(self, message: str, deadline: Deadline, streamed: int = 0) -> None:
        """Send a setting; its echo acknowledges it, with blanks as the meter writes them."""
        reply = self._command(message, deadline, streamed)
        if _header_and_value(reply) != _header_and_value(message):
            if re.search(r"\d,\d", reply):
                raise no_value(self.name, reply.encode("ascii"), message)
            raise InstrumentRefused(f"{self.name}: {message} was answered {reply!r}, expected its echo: not set")

    def _command(self, message: str, deadline: Deadline, streamed: int = 0) -> str:
        """Return the reply to a message. streamed: how many results of a self-triggering meter may precede it."""
        if streamed:
            self.link.drop()
            self.link.send(message.encode("ascii") + b"\n\r")
        else:
            self._say(message.encode("ascii") + b"\n\r")
        within = deadline.within(self.settings.timeout_s)
        try:
            for _ in range(streamed + 1):
                line = self.link.read_until(END, within).removesuffix(END).strip(b"\r")
                if not RESULT.match(line):
                    return text_of(self.name, line)
        except NoReply as e:
            raise NoReply(f"{self.name}: {message} was not acknowledged ({e})") from e
        raise Garbled(
            f"{self.name}: results came unasked, no acknowledgement of {message}; is it triggering by itself?"
        )


def _header_and_value(message: str) -> tuple[str, str | float]:
    header, _, value = message.strip().partition(" ")
    try:
        return header, float(value)
    except ValueError:
        return header, value.strip()


def _is_number(text: str, value: float) -> bool:
    return bool(re.fullmatch(r"\d*\.?\d+", text)) and abs(float(text) - value) <= 1e-3 * max(value, 0.005)


def parse_results(who: str, primary: bytes, secondary: bytes, settings: Lcr800Settings) -> tuple[float, float]:
    """Return C [F] and D of the two result lines. Raises Garbled for a wrong width, digits, point or unit,
    Implausible."""
    first = PRIMARY.fullmatch(text_of(who, primary))
    second = SECONDARY.fullmatch(text_of(who, secondary))
    if not first or not second:
        expected = "MAIN:PRIM with C, MAIN:SECO with D and pF, nF or uF"
        raise no_value(who, secondary if first else primary, expected)
    C = _number(who, primary, first["field"], PRIMARY_WIDTH, settings.primary_digits) * FARADS[second["unit"]]
    D = _number(who, secondary, second["field"], SECONDARY_WIDTH, settings.secondary_digits)
    lo, hi = settings.range_uF
    if not lo <= C * 1e6 <= hi:
        raise Implausible(f"{who}: C = {C * 1e6:g} uF is outside {lo:g} to {hi:g} uF, the range in the bench file")
    if not 0.0 <= D <= settings.max_D:
        raise Implausible(f"{who}: D = {D:g} is outside 0 to {settings.max_D:g}: no stack in order dissipates that")
    return C, D


def _number(who: str, line: bytes, field: str, width: int, digits: int) -> float:
    """Return the number in a field of fixed width, or one less: the manual's examples lack the blank of the sign."""
    if len(field) not in (width, width - 1) or sum(c.isdigit() for c in field) != digits:
        words = f"{width} characters with {digits} digits"
        raise Garbled(f"{who}: {line!r} has the number field {field!r}, expected {words}")
    return float(field)


TRIALS = (
    *(
        Trial(f"At the meter, {words}")
        for words in (
            "set the display to DELTA, with a nominal value other than zero",
            "set the display to DELTA %",
            "set the mode to R/Q",
            "set the circuit to parallel",
            "set the level to its smallest",
            "set the frequency to 120 Hz",
            "set the speed to fast",
            "hold the range",
        )
    ),
    Trial("Switch the meter off and on again", asked=False),
)
DRIVER = serial_driver(Lcr800, Lcr800Settings, "lcr800", trials=TRIALS)
