"""Mahr Millimar C1208, C1216 and C1240: the common part of their protocols: settings, numbers, units, errors, silence.

Known from [MILLIMAR] (pages 58 to 70): the protocols and their commands; that nothing is sent while the menu is open or
a master measurement runs; that values come as the display shows them. Known from a driver: nothing; no driver is known.
Known from siblings only (C1202, other makers' Opto-RS): error replies `ERRn` and `OV`. Assumed, so set in the bench
file: line settings; micrometre as `um` on the wire (`micrometre`); digits before and after the point if they are known
to be fixed (`integer_digits` and `decimals`, both or neither: a lost leading digit shows in the first only); the range
of the probe (`range_mm`). The factor of a feature cannot be asked: it must be 1."""

import re
from typing import Annotated, ClassVar, Literal, TypeVar

from pydantic import Field, model_validator

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange
from hw.instruments.length import METRES, LengthInstrument, LengthSettings
from hw.instruments.reading import no_value
from hw.instruments.serial_instrument import text_of
from hw.link import Deadline

_NUMBER = r" *(?P<sign>[+-]?) *(?P<whole>\d+)\.(?P<fraction>\d+)"
VALUE = re.compile(_NUMBER + r"(?P<unit>[a-zA-Z\x80-\xff]+)")
BARE_VALUE = re.compile(_NUMBER)
MENU = "is a menu open, or a master measurement running?"
ERRORS = {  # Opto-RS; the C1202 gives 3, 5 and 6 other meanings
    "0": "sensor error (speed, distance)",
    "1": "it does not know the command",
    "2": "parity error: check the line settings",
    "3": "measuring range exceeded, or no measurement available",
    "5": "measurement invalid; is the probe connected?",
    "6": "feature not available",
}


class MillimarSettings(LengthSettings):
    """Settings of a Millimar.

    protocol : as chosen in its menu (PROTOCL). unit : of the display, which the driver sets if the protocol can.
    integer_digits, decimals : of the display, if they are fixed. micrometre : how the wire spells it."""

    protocol: Literal["OPTORSD", "OPTORSS", "M1240"]
    unit: Literal["mm", "in", "um"]
    integer_digits: Annotated[int, Field(ge=1, le=6)] | None = None
    decimals: Annotated[int, Field(ge=1, le=6)] | None = None
    micrometre: Annotated[str, Field(min_length=1)] = "um"

    @model_validator(mode="after")
    def _both_or_neither(self) -> "MillimarSettings":
        if (self.integer_digits is None) != (self.decimals is None):
            raise ValueError("integer_digits and decimals: expected both or neither; one alone hides a lost digit")
        return self


def check_error(who: str, line: bytes) -> None:
    """Raise the error of an error reply (sibling models; the C1216's own are not published)."""
    if line.strip().startswith(b"OV"):
        raise OverRange(f"{who}: it is over range ({line!r})")
    if found := re.fullmatch(rb"\s*ERR ?(\d)\s*", line):
        digit = found[1].decode()
        kind = OverRange if digit == "3" else InstrumentRefused
        raise kind(f"{who}: {line.decode('ascii').strip()}: {ERRORS.get(digit, 'no meaning known')}")


def parse_value(who: str, line: bytes, settings: MillimarSettings) -> tuple[float, int]:
    """Return the metres of `xxx.xxx<unit>`, and its decimals. Raises an InstrumentError, as `check_error` does."""
    check_error(who, line)
    found = VALUE.fullmatch(line.decode("latin-1").rstrip(" "))
    if not found:
        raise no_value(who, line, "a number and its unit, such as 0.123mm")
    spelled = {"mm": "mm", "in": "in", settings.micrometre: "um"}
    unit = spelled.get(found["unit"])
    if unit is None:
        raise Garbled(f"{who}: {line!r} has the unit {found['unit']!r}, expected one of {', '.join(spelled)}")
    if unit != settings.unit:
        raise Implausible(f"{who}: {line!r} is in {unit}, the bench file says {settings.unit}")
    return _metres(who, line, found, unit, settings)


def parse_bare(who: str, text: str, unit: str, settings: MillimarSettings) -> tuple[float, int]:
    """Return the metres of a number in the set unit, and its decimals. Raises Garbled, Implausible."""
    line = text.encode("latin-1")
    found = BARE_VALUE.fullmatch(text)
    if not found:
        raise no_value(who, line, "a number such as 0.123")
    return _metres(who, line, found, unit, settings)


def _metres(who: str, line: bytes, found: re.Match[str], unit: str, settings: MillimarSettings) -> tuple[float, int]:
    fixed = (("before", found["whole"], settings.integer_digits), ("after", found["fraction"], settings.decimals))
    for what, digits, expected in fixed if unit == settings.unit else ():
        if expected is not None and len(digits) != expected:
            raise Garbled(f"{who}: {line!r} has {len(digits)} digits {what} the point, the display has {expected}")
    decimals = len(found["fraction"])
    settings.fine_enough(who, line, unit, decimals)
    metres = float(f"{found['sign']}{found['whole']}.{found['fraction']}") * METRES[unit]
    return settings.plausible(who, line, metres), decimals


M = TypeVar("M", bound=MillimarSettings)


class Millimar(LengthInstrument[M]):
    """Displacement [m] of a Millimar: messages end CR, replies as the protocol has it."""

    end: ClassVar[bytes]

    def _line(self, message: str, deadline: Deadline) -> bytes:
        """Return the reply to a message without its end. Raises InstrumentError with the usual cause of silence."""
        try:
            reply = self._ask(message.encode("ascii") + b"\r", self.end, deadline)
        except NoReply as e:
            words = f"{self.name}: no reply; {MENU} Else check cable, protocol and line settings ({e})"
            raise NoReply(words) from e
        return reply.removesuffix(self.end).lstrip(b"\r\n")

    def _text(self, message: str, deadline: Deadline) -> str:
        """Return the reply as text. Raises InstrumentError if it is an error."""
        line = self._line(message, deadline)
        check_error(self.name, line)
        return text_of(self.name, line)
