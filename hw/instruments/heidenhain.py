"""Heidenhain ND 287 and ND 281B, the readouts of the MT 25 length gauge.

Known from [ND287] (pages 102-115) and [ND281B] (pages 39-62): STX (0x02) asks for a value; the answer is 17
characters: sign, number of 10 characters with its point and leading zeros as blanks, blank, unit, sorting status,
series status, CR, LF; optional blank lines follow it; the series status of a two-axis ND 287 is 1 for X1, 2 for X2 and
A for X1 + X2; `ESC A0000 CR` asks for the identification, `ND-287` and `ND-281B` with a hyphen, and NAK (0x15) refuses;
ND 281B: 9600 7E2.
Known from drivers: `A0000` answers STX and three lines of 10 characters.
Assumed: that the identification names the model; whether the display has a second axis (`axis`, required of an ND 287).
"""

import re
from typing import Annotated, Literal

from pydantic import Field

from hw.errors import Garbled, Implausible, NoReply, OverRange, WrongInstrument
from hw.instruments.driver import Ask, Driver, Instrument, Trial, serial_driver
from hw.instruments.length import METRES, LengthInstrument, LengthSettings
from hw.instruments.reading import Identity, Reading, no_value
from hw.instruments.serial_instrument import text_of
from hw.link import Deadline
from specs.bench import InstrumentEntry

STX, NAK, ESC = b"\x02", b"\x15", b"\x1b"
END = b"\r\n"
FRAME = re.compile(
    r"(?P<sign>[+\- ])(?P<number> *\d+\.(?P<fraction>\d+)) (?P<unit>.)(?P<sorting>[<=>? ])(?P<series>[ SAGD12F])"
)
FRAME_LENGTH, NUMBER_LENGTH = 15, 10  # without CR LF
UNITS = {" ": "mm", '"': "in"}
IDENTITY_LINES, IDENTITY_LENGTH = 3, 10  # of the answer to A0000 ([ND287])
SERIES = {"single": "A ", "X1": "1", "X2": "2"}  # status of an actual value; S, G and D are extremes of a series


class HeidenhainSettings(LengthSettings):
    """Settings of a readout. identification : required words in its identification, without blanks and hyphens."""

    identification: Annotated[str, Field(min_length=1)] | None = None
    axis: Literal["single"] = "single"

    @property
    def series(self) -> str:
        """Return the series status that a value may have."""
        return SERIES[self.axis]


class Nd287Settings(HeidenhainSettings):
    """axis : the axis on the display: the only one, or X1 or X2 of two. A display of two axes also has A, their sum."""

    axis: Literal["single", "X1", "X2"]  # type: ignore[assignment]  # wider, and without a default


class Heidenhain(LengthInstrument[HeidenhainSettings]):
    """Position [m] of the probe. Nothing is set: the readout's own settings are the technician's."""

    def _identify(self, deadline: Deadline) -> Identity:
        """Search the identification for words, since it has no fixed fields. The whole text must not change."""
        words = self._identification(deadline)
        wanted = self.settings.identification
        if wanted is not None and (words is None or _letters(wanted) not in _letters(words)):
            answer = "it refuses to tell its identification" if words is None else f"its identification is {words!r}"
            raise WrongInstrument(f"{self.name}: {answer}, expected {wanted!r} in it; are two instruments swapped?")
        return Identity(identification=words or "not told")

    def _identification(self, deadline: Deadline) -> str | None:
        """Return the three lines of A0000, joined by blanks; None if the readout refuses it. Raises InstrumentError."""
        within = deadline.within(self.settings.timeout_s)
        self._say(ESC + b"A0000\r")
        first = b"\r"
        while first in (b"\r", b"\n"):  # of the blank lines that may follow a value
            first = self.link.read_exactly(1, within)
        if first == NAK:
            return None
        if first != STX:
            raise Garbled(f"{self.name}: A0000 was answered {first!r}..., expected STX")
        lines = [self.link.read_until(END, within).removesuffix(END) for _ in range(IDENTITY_LINES)]
        for line in lines:
            if len(line) != IDENTITY_LENGTH:
                raise Garbled(f"{self.name}: {line!r} in its identification, expected {IDENTITY_LENGTH} characters")
        return " ".join(text_of(self.name, line).strip() for line in lines)

    def _measure(self, deadline: Deadline) -> Reading:
        try:
            line = self._ask(STX, END, deadline).removesuffix(END)
            while not line:  # the blank lines that may follow the value before
                line = self.link.read_until(END, deadline.within(self.settings.timeout_s)).removesuffix(END)
        except NoReply as e:
            raise NoReply(f"{self.name}: no value; check cable, line settings and that no menu is open ({e})") from e
        metres, series = parse_frame(self.name, line, self.settings)
        return Reading(metres, self.unit, self._now(), (line,), settings={"series": series})


def _letters(words: str) -> str:
    return re.sub(r"[\s-]", "", words).upper()


def parse_frame(who: str, line: bytes, settings: HeidenhainSettings) -> tuple[float, str]:
    """Return the value of 15 characters in metres, and the series status. Raises Garbled, OverRange, Implausible."""
    found = FRAME.fullmatch(line.decode("latin-1"))
    if not found or len(found["number"]) != NUMBER_LENGTH:
        text_of(who, line)
        words = "sign, number in 10 characters, blank, unit, sorting, series"
        raise no_value(who, line, f"{FRAME_LENGTH} characters: {words}")
    if found["unit"] == "?":
        raise OverRange(f"{who}: the readout reports a fault of the gauge ({line!r})")
    if found["unit"] not in UNITS:
        raise Implausible(f"{who}: {line!r} has the unit {found['unit']!r}, expected a length in mm or inch")
    if found["series"] not in settings.series:
        words = f"the bench file says axis = {settings.axis!r}"
        raise Implausible(f"{who}: {line!r} is not the actual value (series status {found['series']!r}); {words}")
    unit = UNITS[found["unit"]]
    settings.fine_enough(who, line, unit, len(found["fraction"]))
    metres = float(found["number"]) * METRES[unit] * (-1.0 if found["sign"] == "-" else 1.0)
    return settings.plausible(who, line, metres), found["series"]


_ND287, _ND281B = serial_driver(Heidenhain, Nd287Settings), serial_driver(Heidenhain, HeidenhainSettings)


def _open(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return (_ND287 if entry.driver == "nd287" else _ND281B).open(name, entry, ask)


TRIALS = (
    Trial("At the readout, set the unit to inch", asked=False),
    Trial("Set the display step to 10 um or more"),
    Trial("Start a series and show MIN, MAX or DIFF"),
    Trial("Show the second axis, or the sum of both", optional=True),
    Trial("Open the readout's menu"),
    Trial("Switch the readout off and on again", asked=False),
)
DRIVER = Driver(("nd287", "nd281b"), _open, TRIALS)
