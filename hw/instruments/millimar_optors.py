"""Mahr Millimar by OPTORSD (questions and settings) or OPTORSS (one question).

Known from [MILLIMAR] (pages 69, 70): messages end CR, replies CR LF; `?` -> value with unit; `ID?`, `VER?`, `UNI?`,
`SER?`, `CHA?`, printed with a blank (or `_`) before CR; settings `mm`, `in`, `um`, `CHA...`, `DIS text` (7 characters)
are acknowledged. OPTORSS knows `?` only. Assumed: the text of the acknowledgement is not printed. Any one line but an
error is taken for one, or none within the timeout (`acknowledged = false`: none is waited for); what was set is read
back, so nothing rests on it.
"""

import re
from typing import ClassVar, Literal

from hw.errors import Garbled, Implausible
from hw.instruments.millimar import Millimar, MillimarSettings, check_error, parse_value
from hw.instruments.reading import Identity, Reading
from hw.link import Deadline

MAX_DISPLAY = 7


class OptorsSettings(MillimarSettings):
    """acknowledged : whether a setting is answered by a line."""

    protocol: Literal["OPTORSD", "OPTORSS"]
    acknowledged: bool = True


class MillimarOptors(Millimar[OptorsSettings]):
    """Displacement [m] of a Millimar."""

    end: ClassVar[bytes] = b"\r\n"

    @property
    def _duplex(self) -> bool:
        return self.settings.protocol == "OPTORSD"

    def _begin(self, deadline: Deadline) -> None:
        if not self._duplex:
            return
        self._set(self.settings.unit, deadline)
        if (found := self.question("UNI?", deadline)) != self._spelled:
            raise Implausible(f"{self.name}: the display is in {found!r} and did not change to {self._spelled!r}")
        if self.settings.formula is not None:
            self._set(f"CHA{self.settings.formula}", deadline)
            self._check_formula(self.settings.formula, deadline)

    @property
    def _spelled(self) -> str:
        return self.settings.micrometre if self.settings.unit == "um" else self.settings.unit

    def _check_formula(self, wanted: str, deadline: Deadline) -> None:
        """`CHA-1-2` reads back as `-C1-C2`; a leading + may be missing (assumed)."""
        expected = re.sub(r"([+-])", r"\1C", wanted)
        found = self.question("CHA?", deadline)
        if found.lstrip("+") != expected.lstrip("+"):
            raise Implausible(f"{self.name}: its formula is {found!r} and did not change to {expected!r}")

    def _identify(self, deadline: Deadline) -> Identity:
        if not self._duplex:
            return Identity()
        said = self.question("ID?", deadline)
        maker, comma, model = said.partition(",")
        if maker != "MAHR GMBH" or not comma:
            raise Garbled(f"{self.name}: ID? gave {said!r}, expected 'MAHR GMBH,' and a model")
        return Identity(model.strip(), self.question("SER?", deadline))

    def version(self) -> str:
        """Firmware version. Raises InstrumentError."""
        return self.question("VER?", self.link.deadline(self.deadline_s))

    def show(self, text: str) -> None:
        """Text on line 1 of its display, at most 7 characters. Raises ValueError, InstrumentError."""
        if len(text) > MAX_DISPLAY or not text.isascii() or not text.isprintable():
            raise ValueError(f"{text!r} is no text of at most {MAX_DISPLAY} printable characters; nothing sent")
        self._set(f"DIS {text}", self.link.deadline(self.deadline_s))

    def question(self, message: str, deadline: Deadline) -> str:
        """The reply to `ID?` and its like, without blanks. Raises InstrumentError."""
        return self._text(message, deadline).strip(" _")

    def _measure(self, deadline: Deadline) -> Reading:
        line = self._line("?", deadline)
        return Reading(parse_value(self.name, line, self.settings), self.unit, self._now(), (line,))

    def _set(self, message: str, deadline: Deadline) -> None:
        if self.settings.acknowledged:
            check_error(self.name, self._line(message, deadline))
        else:
            self._say(message.encode("ascii") + b"\r")
