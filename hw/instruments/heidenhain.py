"""Heidenhain ND 287 and ND 281B, the readouts of the MT 25 length gauge.

Known from [ND287] (pages 102-115) and [ND281B] (pages 39-62): STX (0x02) asks for a value; the answer is 17 characters:
sign, number of 10 characters with its point and leading zeros as blanks, blank, unit, sorting status, series status,
CR, LF; optional blank lines follow it; ESC commands end CR, T, F and S ones are answered ACK (0x06) or NAK (0x15), A
ones STX and text; ENQ asks for the error message; DC3 and DC1 stop and go on; ND 281B: 9600 7E2. Known from drivers:
the ESC codes below; `A0000` answers STX and three lines of 10 characters. Assumed: that the identification names the
model (`identification`: words that must be in it; left out: only noted); the answer to ENQ and `A0301` ends CR LF.
"""

import re
from typing import Annotated

from pydantic import Field

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange, WrongInstrument
from hw.instruments.driver import serial_driver
from hw.instruments.length import METRES, LengthInstrument, LengthSettings
from hw.instruments.reading import Identity, Reading
from hw.instruments.serial_instrument import text_of
from hw.link import Deadline

STX, ENQ, ACK, DC1, DC3, NAK, ESC = b"\x02", b"\x05", b"\x06", b"\x11", b"\x13", b"\x15", b"\x1b"
END = b"\r\n"
FRAME = re.compile(r"(?P<sign>[+\- ])(?P<number> *\d+\.\d+) (?P<unit>.)(?P<sorting>[<=>? ])(?P<series>[ SAGD12F])")
FRAME_LENGTH, NUMBER_LENGTH = 15, 10  # without CR LF
UNITS = {" ": "mm", '"': "in"}
IDENTITY_LINES, IDENTITY_LENGTH = 3, 10
ACTUAL = {"A", " "}  # series status of a value that is what the probe shows now; S, G and D are extremes of a series
KEYS = {str(d): f"T000{d}" for d in range(10)} | {"CL": "T0100", "-": "T0101", ".": "T0102", "NAV": "T0103"}
FUNCTIONS = {"REF": "F0000", "SERIES": "F0100", "PRINT": "F0200", "RESET": "S0000", "LOCK": "S0001", "UNLOCK": "S0002"}
TEXTS = {"displayed": "A0100", "position": "A0200", "error": "A0301", "software": "A0400", "status": "A0800"}


class HeidenhainSettings(LengthSettings):
    """Settings of a readout. identification : words that its identification must hold."""

    identification: Annotated[str, Field(min_length=1)] | None = None


class Heidenhain(LengthInstrument[HeidenhainSettings]):
    """Position [m] of the probe."""

    def _begin(self, deadline: Deadline) -> None:
        """Nothing is set: the readout's own settings are the technician's."""

    def _identify(self, deadline: Deadline) -> Identity:
        """The identification has no fixed fields; a word is looked for, and model and serial are not compared."""
        words = self.identification(deadline)
        wanted = self.settings.identification
        if wanted is not None and wanted not in words:
            raise WrongInstrument(
                f"{self.name}: its identification is {words!r}, expected {wanted!r} in it; are two instruments swapped?"
            )
        return Identity()

    def identification(self, deadline: Deadline) -> str:
        """The three lines of A0000, joined by blanks. Raises InstrumentError."""
        lines = [self._escape("A0000", deadline)]
        while len(lines) < IDENTITY_LINES:
            lines.append(self.link.read_until(END, deadline.within(self.settings.timeout_s)).removesuffix(END))
        for line in lines:
            if len(line) != IDENTITY_LENGTH:
                raise Garbled(f"{self.name}: {line!r} in its identification, expected {IDENTITY_LENGTH} characters")
        return " ".join(text_of(self.name, line).strip() for line in lines)

    def text(self, what: str) -> str:
        """One of `TEXTS`: displayed value, position, error, software, status. Raises InstrumentError."""
        return text_of(self.name, self._escape(TEXTS[what], self.link.deadline(self.deadline_s))).strip()

    def error_message(self) -> str:
        """What the readout says is wrong (ENQ). Raises InstrumentError."""
        deadline = self.link.deadline(self.deadline_s)
        return text_of(self.name, self._ask(ENQ, END, deadline, harmless=END).removesuffix(END).lstrip(STX)).strip()

    def hold(self) -> None:
        """Stop its output (DC3). Raises InstrumentError."""
        self._say(DC3, harmless=END)

    def go_on(self) -> None:
        """Let its output go on (DC1). Raises InstrumentError."""
        self._say(DC1, harmless=END)

    def do(self, function: str) -> None:
        """One of `FUNCTIONS` or `KEYS`. Raises Refused when the readout does not take it, InstrumentError."""
        code = FUNCTIONS.get(function) or KEYS[function]
        self._say(_message(code), harmless=END)
        deadline = self.link.deadline(self.deadline_s).within(self.settings.timeout_s)
        answer = self.link.read_exactly(1, deadline)
        if answer == NAK:
            raise InstrumentRefused(f"{self.name}: {function} ({code}) is unknown to it, or not possible now")
        if answer != ACK:
            raise Garbled(f"{self.name}: {function} ({code}) was answered {answer!r}, expected ACK or NAK")

    def _escape(self, code: str, deadline: Deadline) -> bytes:
        """Text of an A command, without STX and end."""
        within = deadline.within(self.settings.timeout_s)
        self._say(_message(code), harmless=END)
        first = self.link.read_exactly(1, within)
        if first == NAK:
            raise InstrumentRefused(f"{self.name}: {code} is unknown to it")
        if first != STX:
            raise Garbled(f"{self.name}: {code} was answered {first!r}..., expected STX")
        return self.link.read_until(END, within).removesuffix(END)

    def _measure(self, deadline: Deadline) -> Reading:
        try:
            line = self._ask(STX, END, deadline, harmless=END).removesuffix(END)
            while not line:  # the blank lines that may follow the value before
                line = self.link.read_until(END, deadline.within(self.settings.timeout_s)).removesuffix(END)
        except NoReply as e:
            raise NoReply(f"{self.name}: no value; check cable, line settings and that no menu is open ({e})") from e
        return Reading(parse_frame(self.name, line, self.settings), self.unit, self._now(), (line,))


def _message(code: str) -> bytes:
    return ESC + code.encode("ascii") + b"\r"


def parse_frame(who: str, line: bytes, settings: HeidenhainSettings) -> float:
    """Metres of a value's 15 characters. Raises Garbled, OverRange, Implausible."""
    text = text_of(who, line)
    found = FRAME.fullmatch(text)
    if not found or len(found["number"]) != NUMBER_LENGTH:
        words = "sign, number in 10 characters, blank, unit, sorting, series"
        raise Garbled(f"{who}: {line!r}, expected {FRAME_LENGTH} characters: {words}")
    if found["unit"] == "?":
        raise OverRange(f"{who}: the readout reports a fault of the gauge ({line!r})")
    if found["unit"] not in UNITS:
        raise Implausible(f"{who}: {line!r} has the unit {found['unit']!r}, expected a length in mm or inch")
    if found["series"] not in ACTUAL:
        raise Implausible(f"{who}: {line!r} is not the actual value (series status {found['series']!r})")
    metres = float(found["number"]) * METRES[UNITS[found["unit"]]] * (-1.0 if found["sign"] == "-" else 1.0)
    return settings.plausible(who, line, metres)


DRIVER = serial_driver(Heidenhain, HeidenhainSettings, "nd287", "nd281b")
