"""Mahr Millimar by M1240.

Known from [MILLIMAR] (page 67): messages and replies end CR; `I` -> `I,MAHRGMBH,C1208,Vn.nn`, printed with a blank
before CR; `P86,1` `P86,2` `P86,3` set mm, inch, micrometre; `M` -> `M1, xxx.xxx`, the current value(s), without unit.
"A command can be acknowledged with CR."
Known from a sibling (C1245): `I, MAHR GMBH` with blanks. Both forms are taken.
Assumed: whether `P86` is answered (`acknowledged`: "cr", "echo" or "none"); that several features come as a line each
(`features`). The unit cannot be read back, so every value is taken in two units: numbers that do not differ as the
units do show a display that did not obey. Formula and factor cannot be asked at all: prefer OPTORSD."""

import math
import re
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply
from hw.instruments.length import METRES
from hw.instruments.millimar import Millimar, MillimarSettings, parse_bare
from hw.instruments.reading import Identity, Reading, agreed, no_value
from hw.instruments.serial_instrument import text_of
from hw.link import Deadline

END = b"\r"
UNIT_CODES = {"mm": "P86,1", "in": "P86,2", "um": "P86,3"}
OTHER_UNIT = {"mm": "um", "in": "um", "um": "mm"}
IDENTITY = re.compile(r"I, ?MAHR ?GMBH, ?(?P<model>[A-Z]?\d+), ?(?P<version>V\d+\.\d+) *")
VALUE = re.compile(r"M(?P<feature>\d+), *(?P<number>[-+ ]*\d+\.\d+) *")
APART = 3.0  # tolerances by which a number must differ from itself in the other unit, to show which unit it has


class M1240Settings(MillimarSettings):
    """acknowledged : how setting the unit is answered. features : how many values `M` returns; the first is taken."""

    protocol: Literal["M1240"]
    acknowledged: Literal["cr", "echo", "none"] = "cr"
    features: Annotated[int, Field(ge=1, le=16)] = 1


class MillimarM1240(Millimar[M1240Settings]):
    """Displacement [m] of a Millimar."""

    end: ClassVar[bytes] = END

    def _identify(self, deadline: Deadline) -> Identity:
        reply = self._text("I", deadline)
        found = IDENTITY.fullmatch(reply)
        if not found:
            raise Garbled(f"{self.name}: I gave {reply!r}, expected I,MAHRGMBH,model,version")
        return Identity(found["model"], None, found["version"])

    def _read_agreed(self, deadline: Deadline) -> Reading:
        """Read in the bench file's unit, in another one, and again, so that the display keeps its own."""
        ours = self.settings.unit
        other = OTHER_UNIT[ours]
        (first, step), (check, check_step) = self._in_unit(ours, deadline), self._in_unit(other, deadline)
        again, _ = self._in_unit(ours, deadline)
        within = self._within(first) + (step + check_step) / 2
        value = agreed(self.name, (first, again), self._within(first)).value
        both = agreed(self.name, (first, check, again), within)
        same_format = math.isclose(step / METRES[ours], check_step / METRES[other])
        if same_format and abs(value / METRES[ours] * METRES[other] - value) <= APART * within:
            raise Implausible(
                f"{self.name}: {both.raw!r}: so near to zero nothing shows whether the display is in {ours}; move the "
                "probe a little off zero"
            )
        return replace(both, value=value, settings={"decimals": str(round(-math.log10(step / METRES[ours])))})

    def _measure(self, deadline: Deadline) -> Reading:
        return self._in_unit(self.settings.unit, deadline)[0]

    def _in_unit(self, unit: str, deadline: Deadline) -> tuple[Reading, float]:
        """Return a reading in a unit, and its last digit [m]."""
        self._set_unit(unit, deadline)
        lines = [self._text("M", deadline)]
        while len(lines) < self.settings.features:
            rest = self.link.read_until(END, deadline.within(self.settings.timeout_s)).removesuffix(END)
            lines.append(text_of(self.name, rest))
        for number, line in enumerate(lines, 1):
            found = VALUE.fullmatch(line)
            if not found or int(found["feature"]) != number:
                words = f"'M{number}, ' and a number (features = {self.settings.features} in the bench file)"
                raise no_value(self.name, line.encode("ascii"), words)
        first = VALUE.fullmatch(lines[0])
        metres, decimals = parse_bare(self.name, first["number"] if first else "", unit, self.settings)
        raw = tuple(line.encode("ascii") for line in lines)
        return Reading(metres, self.unit, self._now(), raw), METRES[unit] * 10.0**-decimals

    def _set_unit(self, unit: str, deadline: Deadline) -> None:
        code, how = UNIT_CODES[unit], self.settings.acknowledged
        if how == "none":
            self._say(code.encode("ascii") + END)
            return
        try:
            reply = self._text(code, deadline)
        except NoReply as e:
            raise NoReply(f"{e}; if it never answers {code}, the bench file needs acknowledged = 'none'") from e
        expected = "" if how == "cr" else code
        if reply.strip() != expected:
            raise InstrumentRefused(
                f"{self.name}: {code} was answered {reply!r}, expected {expected!r} (acknowledged = {how!r} in the "
                "bench file): the unit is not known"
            )
