"""Mahr Millimar by M1240.

Known from [MILLIMAR] (page 67): messages and replies end CR; `I` -> `I,MAHRGMBH,C1208,Vn.nn`; `F1`, `F2` start and `F3`
ends a measurement, `R` resets, each echoed; `Z` starts a two-point master measurement, which a key ends; `P86,1`
`P86,2` `P86,3` set mm, inch, micrometre; `M` -> `M1, xxx.xxx` without unit; `M70` -> stored values, which reading
deletes. "A command can be acknowledged with CR." Known from a sibling (C1245): `I, MAHR GMBH` with blanks. Both forms
are taken. Assumed: whether `P86` is answered (`acknowledged`: "cr", "echo" or "none"). The unit cannot be read back, so
it is set again before every value: someone may have changed it at the instrument.
"""

import re
from typing import ClassVar, Literal

from hw.errors import Garbled, InstrumentRefused, NoReply
from hw.instruments.millimar import Millimar, MillimarSettings, parse_bare
from hw.instruments.reading import Identity, Reading
from hw.instruments.serial_instrument import text_of
from hw.link import Deadline

END = b"\r"
UNIT_CODES = {"mm": "P86,1", "in": "P86,2", "um": "P86,3"}
IDENTITY = re.compile(r"I, ?MAHR ?GMBH, ?(?P<model>[A-Z]?\d+),(?P<version>V\d+\.\d+)")
VALUE = re.compile(r"M1, (?P<number>[-+ \d.]+)")
STORED = re.compile(r"(?P<feature>\d{1,5}), ?(?P<number>[-+ \d.]+)")
MAX_STORED = 400


class M1240Settings(MillimarSettings):
    """acknowledged : how setting the unit is answered."""

    protocol: Literal["M1240"]
    acknowledged: Literal["cr", "echo", "none"] = "cr"


class MillimarM1240(Millimar[M1240Settings]):
    """Displacement [m] of a Millimar."""

    end: ClassVar[bytes] = END

    def _begin(self, deadline: Deadline) -> None:
        """Nothing lasts: the unit is set before every value."""

    def _identify(self, deadline: Deadline) -> Identity:
        said = self._text("I", deadline)
        found = IDENTITY.fullmatch(said)
        if not found:
            raise Garbled(f"{self.name}: I gave {said!r}, expected I,MAHRGMBH,model,version")
        return Identity(found["model"], None, found["version"])

    def _measure(self, deadline: Deadline) -> Reading:
        self._set_unit(deadline)
        line = self._text("M", deadline)
        found = VALUE.fullmatch(line)
        if not found:
            raise Garbled(f"{self.name}: M gave {line!r}, expected 'M1, ' and a number")
        value = parse_bare(self.name, found["number"].lstrip(), self.settings)
        return Reading(value, self.unit, self._now(), (line.encode("ascii"),))

    def _set_unit(self, deadline: Deadline) -> None:
        code = UNIT_CODES[self.settings.unit]
        if self.settings.acknowledged == "none":
            self._say(code.encode("ascii") + END)
            return
        expected = "" if self.settings.acknowledged == "cr" else code
        if (said := self._text(code, deadline)) != expected:
            raise InstrumentRefused(
                f"{self.name}: {code} was answered {said!r}, expected {expected!r}: the unit is not known"
            )

    def start(self, timed: bool = False) -> None:
        """Start a measurement, with the set period (T-TIMER) where `timed`. Raises InstrumentError."""
        self._echoed("F1" if timed else "F2")

    def stop(self) -> None:
        """End a measurement. Raises InstrumentError."""
        self._echoed("F3")

    def reset(self) -> None:
        """Reset to the basic state. Raises InstrumentError."""
        self._echoed("R")

    def master(self) -> None:
        """Start the two-point master measurement, which a key at the instrument ends; until then it is silent."""
        self._echoed("Z")

    def stored(self) -> list[tuple[int, float, bytes]]:
        """Stored values: feature, metres, reply. Reading deletes them in the instrument, so the replies are kept in the
        transcript whatever happens. Raises InstrumentError when any line is damaged."""
        deadline = self.link.deadline(self.deadline_s)
        self._say(b"M70" + END)
        lines: list[bytes] = []
        while len(lines) < MAX_STORED:
            try:
                lines.append(self.link.read_until(END, deadline.within(self.settings.timeout_s)))
            except NoReply as e:
                if "nothing came" in str(e):
                    break
                raise Garbled(f"{self.name}: the last stored value is cut short ({e})") from e
        return [self._stored_value(line) for line in lines]

    def _stored_value(self, line: bytes) -> tuple[int, float, bytes]:
        found = STORED.fullmatch(text_of(self.name, line.removesuffix(END)))
        if not found:
            raise Garbled(f"{self.name}: {line!r} is no stored value; the transcript has all of them")
        return int(found["feature"]), parse_bare(self.name, found["number"].lstrip(), self.settings), line

    def _echoed(self, command: str) -> None:
        if (said := self._text(command, self.link.deadline(self.deadline_s))) != command:
            raise InstrumentRefused(f"{self.name}: {command} was answered {said!r}, expected its echo")
