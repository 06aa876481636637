"""Mahr Millimar by the protocol that is set in its menu: M1240, OPTORSD (questions, settings), OPTORSS (one question).

M1240. Known from [MILLIMAR] (page 67): messages and replies end CR; `I` -> `I,MAHRGMBH,C1208,Vn.nn`, printed with a
blank before CR; `P86,1` `P86,2` `P86,3` set mm, inch, micrometre; `M` -> `M1, xxx.xxx`, the current value(s), without
unit. "A command can be acknowledged with CR."
Known from a sibling (C1245): `I, MAHR GMBH` with blanks. Both forms are taken.
Assumed: whether `P86` is answered (`acknowledged`: "cr", "echo" or "none"); that several features come as a line each
(`features`). The unit cannot be read back, so every value is taken in two units: numbers that do not differ as the
units do show a display that did not obey. Formula and factor cannot be asked at all: prefer OPTORSD.

OPTORSD, OPTORSS. Known from [MILLIMAR] (pages 69, 70): messages end CR, replies CR LF; `?` -> value with unit; `ID?`,
`UNI?`, `SER?`, `CHA?`, printed with a blank (or `_`) before CR; settings `mm`, `in`, `um` and `CHA...` are
acknowledged. OPTORSS knows `?` only: neither unit setting nor formula nor instrument can be asked there.
Assumed: the text of the acknowledgement is not printed. Any one line but an error is taken for one, or none within the
timeout (`acknowledged = false`: none is waited for); what was set is read back, so nothing rests on it."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply
from hw.instruments.driver import Ask, Driver, Instrument, Trial, serial_driver
from hw.instruments.length import METRES
from hw.instruments.millimar import Millimar, MillimarSettings, check_error, parse_bare, parse_value
from hw.instruments.reading import Identity, Reading, agreed, no_value
from hw.instruments.serial_instrument import text_of
from hw.link import Deadline
from specs.bench import InstrumentEntry

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


_M1240, _OPTORS = serial_driver(MillimarM1240, M1240Settings), serial_driver(MillimarOptors, OptorsSettings)


def _open(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return (_M1240 if entry.settings.get("protocol") == "M1240" else _OPTORS).open(name, entry, ask)


TRIALS = (
    Trial("At the gauge, set the display to another unit"),
    Trial("Set another connection formula, such as C1 + C2", asked=False),
    Trial("Set the factor of the feature to 0.5", asked=False),
    Trial("Open the gauge's menu"),
    Trial("Set the gauge to send by itself (SEND)", asked=False),
    Trial("Switch the gauge off and on again", asked=False),
)
DRIVER = Driver(("millimar",), _open, TRIALS)
