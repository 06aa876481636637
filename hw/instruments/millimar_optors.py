"""Mahr Millimar by OPTORSD (questions and settings) or OPTORSS (one question).

Known from [MILLIMAR] (pages 69, 70): messages end CR, replies CR LF; `?` -> value with unit; `ID?`, `UNI?`, `SER?`,
`CHA?`, printed with a blank (or `_`) before CR; settings `mm`, `in`, `um` and `CHA...` are acknowledged. OPTORSS knows
`?` only: neither unit setting nor formula nor instrument can be asked there.
Assumed: the text of the acknowledgement is not printed. Any one line but an error is taken for one, or none within the
timeout (`acknowledged = false`: none is waited for); what was set is read back, so nothing rests on it."""

import re
from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import model_validator

from hw.errors import Garbled, Implausible
from hw.instruments.millimar import Millimar, MillimarSettings, check_error, parse_value
from hw.instruments.reading import Identity, Reading
from hw.link import Deadline


class OptorsSettings(MillimarSettings):
    """formula : connection formula to hold it to (`+1`, `-1-2`...), required of OPTORSD: another one doubles or turns
    the displacement. acknowledged : whether a setting is answered by a line."""

    protocol: Literal["OPTORSD", "OPTORSS"]
    formula: Literal["+1", "-1", "+2", "-2", "+1+2", "+1-2", "+2-1", "-1-2"] | None = None
    acknowledged: bool = True

    @model_validator(mode="after")
    def _formula_of_a_duplex_line(self) -> "OptorsSettings":
        if self.protocol == "OPTORSD" and self.formula is None:
            raise ValueError("formula is missing: the connection formula of the display, such as '+1'")
        return self


class MillimarOptors(Millimar[OptorsSettings]):
    """Displacement [m] of a Millimar."""

    end: ClassVar[bytes] = b"\r\n"
    answers = 3  # a sign that was lost shows in no width, as it would in a frame of fixed length

    @property
    def _duplex(self) -> bool:
        return self.settings.protocol == "OPTORSD"

    def _set_up(self, deadline: Deadline) -> None:
        for message in (self.settings.unit, f"CHA{self.settings.formula}") if self._duplex else ():
            if self.settings.acknowledged:
                check_error(self.name, self._line(message, deadline))
            else:
                self._say(message.encode("ascii") + b"\r")

    def _identify(self, deadline: Deadline) -> Identity:
        if not self._duplex:
            return Identity()
        reply = self._question("ID?", deadline)
        maker, comma, model = reply.partition(",")
        if maker != "MAHR GMBH" or not comma:
            raise Garbled(f"{self.name}: ID? gave {reply!r}, expected 'MAHR GMBH,' and a model")
        return Identity(model.strip(), self._question("SER?", deadline))

    def _ask_settings(self, deadline: Deadline) -> Mapping[str, str]:
        """Return unit and formula; `CHA-1-2` reads back as `-C1-C2`, where a leading + may be missing (assumed)."""
        if not self._duplex:
            if unasked := self.link.drop_until_quiet(self.settings.quiet_s, deadline).strip(b"\r\n"):
                # One answer too many was late.
                words = "is it sending by itself, or was DATA pressed?"
                raise Garbled(f"{self.name}: {unasked[:40]!r} came unasked; {words}")
            return {}
        spelled = self.settings.micrometre if self.settings.unit == "um" else self.settings.unit
        formula = re.sub(r"([+-])", r"\1C", str(self.settings.formula)).lstrip("+")
        unit, read_back = self._question("UNI?", deadline), self._question("CHA?", deadline)
        if unit != spelled:
            raise Implausible(f"{self.name}: its unit is {unit!r}, the bench file has {spelled!r}; was it changed?")
        if read_back.lstrip("+") != formula:
            raise Implausible(
                f"{self.name}: its formula is {read_back!r}, the bench file has {formula!r}; was it changed at the "
                "gauge? With two features only FEAT. 1 can be changed"
            )
        return {"unit": unit, "formula": read_back}

    def _question(self, message: str, deadline: Deadline) -> str:
        """Return the reply to `ID?` and its like, without blanks. Raises InstrumentError."""
        return self._text(message, deadline).strip(" _")

    def _measure(self, deadline: Deadline) -> Reading:
        line = self._line("?", deadline)
        metres, decimals = parse_value(self.name, line, self.settings)
        return Reading(metres, self.unit, self._now(), (line,), settings={"decimals": str(decimals)})
