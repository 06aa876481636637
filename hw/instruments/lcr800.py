"""GW Instek LCR-800 series: C and D at 1 kHz.

Known from [LCR800] (pages 87-90, 107-110): messages end LF CR in that order, replies LF; `COMU:OVER`, `COMU:OFF.`; the
result messages `MAIN:PRIM`, `MAIN:SECO`, `PRIM:OV01`, `PRIM:OVER`, `SECO:OVER`, their fixed widths (7 and 6 characters,
the sign's place blank when positive), and that the unit of the primary value comes with the secondary. Known from
drivers (three that agree): `COMU?` -> `COMU:ON..`; every setting is echoed as its acknowledgement; `MAIN:STAR` is not
echoed; kHz with 5 decimals, V with 3; 38400 8N1; no `*IDN?`, so the serial number cannot be read. Assumed, so set in
the bench file: five digits of C and four of D; series circuit; a new session after a change of the voltage is not
needed (`reopen_after_voltage`, one driver does it); the time that a measurement and a zeroing may take (`result_s`,
`zeroing_s`). What else it can be set to: `lcr800_commands`.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Literal

from pydantic import Field

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange
from hw.instruments.driver import serial_driver
from hw.instruments.lcr800_commands import QUESTIONS, ZEROINGS, setting
from hw.instruments.reading import Identity, Reading
from hw.instruments.serial_instrument import Seconds, SerialInstrument, SerialSettings, text_of
from hw.link import Deadline, Link
from specs.strict import Positive

END = b"\n"
FARADS = {"pF": 1e-12, "nF": 1e-9, "uF": 1e-6}
PRIMARY = re.compile(r"MAIN:PRIM (?P<field> *-?\d*\.\d*)")
SECONDARY = re.compile(r"MAIN:SECO (?P<field> *-?\d*\.\d+)(?P<unit>[pnu]F)")
RESULT = re.compile(rb"(MAIN:PRIM|MAIN:SECO|PRIM:OV01|PRIM:OVER|SECO:OVER)")
PRIMARY_WIDTH, SECONDARY_WIDTH = 7, 6
FREQUENCY_KHZ = 1.0
MAX_STREAMED = 20  # result lines that may stand before an echo while the meter triggers itself
REMINDER = (
    "The stack is electrically poled: discharge it before connecting, keep the meter's internal and external bias off, "
    "and never bias it against its poling."
)


class Lcr800Settings(SerialSettings):
    """Settings of an LCR-800.

    agreement_percent : how far two answers in a row may differ. range_uF : plausible capacitances. max_D : largest
    plausible dissipation of a piezo stack. bias : "refuse" stops when the meter's bias is on, "allow" does not look.
    """

    speed: Literal["SLOW", "MEDI", "FAST"] = "SLOW"
    circuit: Literal["SERI", "PARA"] = "SERI"
    voltage_V: Annotated[float, Field(ge=0.005, le=1.275)] = 1.0
    agreement_percent: Positive = 0.1
    range_uF: Annotated[list[float], Field(min_length=2, max_length=2)] = Field(default_factory=lambda: [0.01, 100.0])
    max_D: Positive = 0.2
    bias: Literal["refuse", "allow"] = "refuse"
    reopen_after_voltage: bool = False
    primary_digits: Annotated[int, Field(ge=3, le=6)] = 5
    secondary_digits: Annotated[int, Field(ge=2, le=5)] = 4
    result_s: Seconds = 2.5
    zeroing_s: Seconds = 30.0


class Lcr800(SerialInstrument[Lcr800Settings]):
    """Capacitance [F] and dissipation of a stack at 1 kHz, small signal."""

    unit = "F"
    reminders: tuple[str, ...] = (REMINDER,)

    def __init__(
        self, name: str, link: Link, settings: Lcr800Settings, model: str | None = None, serial: str | None = None
    ) -> None:
        super().__init__(name, link, settings, model, serial)
        self._last_F = 0.0  # the agreement is a percentage of what was measured

    @property
    def _within(self) -> float:
        return self._last_F * self.settings.agreement_percent / 100.0

    def _begin(self, deadline: Deadline) -> None:
        self._open_session(deadline)
        self._set("MAIN:TRIG:MANU", deadline)
        self._set("MAIN:MODE:CD", deadline)
        self._set(f"MAIN:CIRC:{self.settings.circuit}", deadline)
        self._set(f"MAIN:FREQ {FREQUENCY_KHZ:.5f}", deadline)
        self._set(f"MAIN:VOLT {self.settings.voltage_V:.3f}", deadline)
        if self.settings.reopen_after_voltage:
            self._set("COMU:OFF.", deadline)
            self._open_session(deadline)
        self._set(f"MAIN:SPEE:{self.settings.speed}", deadline)
        if self.settings.bias == "refuse":
            for source in ("INTB", "EXTB"):
                self._check_bias(source, deadline)

    def _open_session(self, deadline: Deadline) -> None:
        said = self._command("COMU?", deadline)
        if not re.fullmatch(r"COMU:ON(\.\.)?", said):
            raise Garbled(f"{self.name}: COMU? gave {said!r}, expected 'COMU:ON..'; is it an LCR-800?")
        self._set("COMU:OVER", deadline)

    def _check_bias(self, source: str, deadline: Deadline) -> None:
        said = self._command(f"MAIN:{source}?", deadline)
        if not re.fullmatch(rf"MAIN:{source}[: ]OFF\.?", said):
            raise InstrumentRefused(f"{self.name}: {source} is not off ({said!r}). {REMINDER}")

    def _identify(self, deadline: Deadline) -> Identity:
        """The meter does not tell who it is; what it is set to is asked instead, so that a value at another frequency
        or of another mode is never taken for C at 1 kHz."""
        said = self._command("MAIN:FREQ?", deadline)
        found = re.fullmatch(r"MAIN:FREQ +(\d*\.\d+)", said)
        if not found:
            raise Garbled(f"{self.name}: MAIN:FREQ? gave {said!r}, expected MAIN:FREQ and a number in kHz")
        if abs(float(found[1]) - FREQUENCY_KHZ) > 1e-3:
            raise Implausible(f"{self.name}: it measures at {found[1]} kHz, expected {FREQUENCY_KHZ:g} kHz")
        if (mode := self._command("MAIN:MODE?", deadline)) not in ("MAIN:MODE:CD", "MAIN:MODE CD"):
            raise Implausible(f"{self.name}: its mode is {mode!r}, expected CD")
        return Identity()

    def set_to(self, function: str, value: str | float | bool) -> None:
        """Set one of `lcr800_commands`; the next reading sets what it needs. Raises ValueError, InstrumentError."""
        message = setting(function, value)
        with self._aside() as deadline:
            self._set(message, deadline)

    def asked(self, function: str) -> str:
        """What one of `lcr800_commands.QUESTIONS` is set to, in its words. Raises ValueError, InstrumentError."""
        if function not in QUESTIONS:
            raise ValueError(f"{function!r}: expected one of {', '.join(QUESTIONS)}; nothing sent")
        header = QUESTIONS[function]
        with self._aside() as deadline:
            said = self._command(f"{header}?", deadline)
        if not (said.startswith(header) and said[len(header) :][:1] in (":", " ")):
            raise Garbled(f"{self.name}: {header}? gave {said!r}, expected {header} and its value")
        return said[len(header) + 1 :].strip()

    def zero(self, which: str) -> None:
        """Zero the meter with its leads "OPEN" or short ("SHOR"). Raises ValueError, Refused when it fails,
        InstrumentError."""
        if which not in ZEROINGS:
            raise ValueError(f"{which!r}: expected one of {', '.join(ZEROINGS)}; nothing sent")
        with self._aside(self.settings.zeroing_s) as deadline:
            said = self._command(f"OFFS:{which}", deadline, self.settings.zeroing_s)
        if said != f"{which}:OK":
            raise InstrumentRefused(
                f"{self.name}: OFFS:{which} was answered {said!r}, expected '{which}:OK': not zeroed"
            )

    @contextmanager
    def _aside(self, at_least_s: float = 0.0) -> Iterator[Deadline]:
        """A session for something other than a measurement, which leaves the meter otherwise than a measurement needs
        it: the next reading begins anew."""
        deadline = self.link.deadline(max(self.deadline_s, at_least_s))
        with self._session_ends_on_error():
            self.link.drop_until_quiet(self.settings.quiet_s, deadline)
            self._open_session(deadline)
            yield deadline
        self._session = 0

    def finish(self) -> None:
        """Give the meter back to its keys. Raises InstrumentError."""
        self._set("COMU:OFF.", self.link.deadline(self.deadline_s))
        self.close()

    def _measure(self, deadline: Deadline) -> Reading:
        self._say(b"MAIN:STAR\n\r")
        primary = self._result(deadline)
        if primary in (b"PRIM:OV01", b"PRIM:OVER"):
            raise OverRange(f"{self.name}: {primary.decode()}: out of range; is the stack connected, and discharged?")
        secondary = self._result(deadline)
        if secondary.startswith(b"SECO:OVER"):
            raise OverRange(f"{self.name}: {secondary.decode('latin-1')}: D is out of range; check the leads")
        C, D = parse_results(self.name, primary, secondary, self.settings)
        self._last_F = C
        return Reading(C, self.unit, self._now(), (primary, secondary), {"D": D})

    def _result(self, deadline: Deadline) -> bytes:
        try:
            line = self.link.read_until(END, deadline.within(self.settings.result_s)).removesuffix(END)
        except NoReply as e:
            raise NoReply(f"{self.name}: no result within {self.settings.result_s:g} s of MAIN:STAR ({e})") from e
        return line.strip(b"\r")

    def _set(self, message: str, deadline: Deadline) -> None:
        """Send a setting; its echo acknowledges it."""
        said = self._command(message, deadline)
        if said != message:
            raise InstrumentRefused(f"{self.name}: {message} was answered {said!r}, expected its echo: not set")

    def _command(self, message: str, deadline: Deadline, timeout_s: float = 0.0) -> str:
        """Reply to a message; results that a self-triggering meter sent before it are passed over. timeout_s: where it
        takes longer than others."""
        self.link.drop()
        self.link.send(message.encode("ascii") + b"\n\r")
        within = deadline.within(max(self.settings.timeout_s, timeout_s))
        try:
            for _ in range(MAX_STREAMED):
                line = self.link.read_until(END, within).removesuffix(END).strip(b"\r")
                if not RESULT.match(line):
                    return text_of(self.name, line)
        except NoReply as e:
            raise NoReply(f"{self.name}: {message} was not acknowledged ({e})") from e
        raise Garbled(f"{self.name}: only results came, no acknowledgement of {message}")


def parse_results(who: str, primary: bytes, secondary: bytes, settings: Lcr800Settings) -> tuple[float, float]:
    """C [F] and D of the two result lines. Raises Garbled where widths, digits or unit are not as they must be,
    Implausible outside the plausible range."""
    first = PRIMARY.fullmatch(text_of(who, primary))
    second = SECONDARY.fullmatch(text_of(who, secondary))
    if not first or not second:
        raise Garbled(
            f"{who}: {primary!r}, {secondary!r}; expected MAIN:PRIM with C, MAIN:SECO with D and pF, nF or uF"
        )
    C = _number(who, primary, first["field"], PRIMARY_WIDTH, settings.primary_digits) * FARADS[second["unit"]]
    D = _number(who, secondary, second["field"], SECONDARY_WIDTH, settings.secondary_digits)
    lo, hi = settings.range_uF
    if not lo <= C * 1e6 <= hi:
        raise Implausible(f"{who}: C = {C * 1e6:g} uF is outside {lo:g} to {hi:g} uF, the range in the bench file")
    if not 0.0 <= D <= settings.max_D:
        raise Implausible(f"{who}: D = {D:g} is outside 0 to {settings.max_D:g}: no stack in order dissipates that")
    return C, D


def _number(who: str, line: bytes, field: str, width: int, digits: int) -> float:
    """The number in a field of fixed width; the manual prints examples without the blank of the sign, so one less."""
    if len(field) not in (width, width - 1) or sum(c.isdigit() for c in field) != digits:
        words = f"{width} characters with {digits} digits"
        raise Garbled(f"{who}: {line!r} has the number field {field!r}, expected {words}")
    return float(field)


DRIVER = serial_driver(Lcr800, Lcr800Settings, "lcr800")
