"""Instruments without a wire: a person reads the value and types number and unit.

Nothing is known or assumed of any instrument; the typed text must hold a number and a unit, and be plausible."""

import re
import time
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Literal

from pydantic import Field

from hw.errors import Garbled, Implausible, SettingsError
from hw.instruments.driver import Ask, Driver, Instrument, settings_of
from hw.instruments.reading import Identity, Reading
from specs.bench import InstrumentEntry
from specs.strict import Strict

UNITS = {
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "in": 25.4e-3},
    "F": {"F": 1.0, "uF": 1e-6, "µF": 1e-6, "μF": 1e-6, "nF": 1e-9, "pF": 1e-12},
}
ENTRY = re.compile(r"\s*(?P<number>[+-]?(\d+(\.\d*)?|\.\d+))\s*(?P<unit>[A-Za-zµμ]+)\s*")


class ManualSettings(Strict):
    """measure : "displacement" or "capacitance". range : plausible values in `unit`."""

    measure: Literal["displacement", "capacitance"]
    unit: Annotated[str, Field(min_length=1)]
    range: Annotated[list[float], Field(min_length=2, max_length=2)]


class Manual:
    """Readings that a person types. ask : shows a question and returns the typed answer."""

    reminders: tuple[str, ...] = ()
    link = None
    asked: Mapping[str, str] = MappingProxyType({})

    def __init__(
        self,
        name: str,
        settings: ManualSettings,
        ask: Callable[[str], str],
        model: str | None = None,
        serial: str | None = None,
    ) -> None:
        self.name, self.settings, self.model, self.serial, self._ask = name, settings, model, serial, ask
        self.unit = "F" if settings.measure == "capacitance" else "m"
        if settings.unit not in UNITS[self.unit]:
            words = ", ".join(UNITS[self.unit])
            raise SettingsError(f"{name}: unit = {settings.unit!r}, expected one of {words}")

    def connect(self) -> Identity:
        return Identity()

    def read(self) -> Reading:
        """Return the typed reading. Raises Garbled if it is not a number with unit, Implausible outside the range."""
        typed = self._ask(f"{self.name}: reading with its unit, such as 4.99 {self.settings.unit}: ")
        value = parse_typed(self.name, typed, self.settings, self.unit)
        return Reading(value, self.unit, time.time(), (typed.encode("utf-8"),))

    def confirm(self) -> Identity:
        return Identity()

    def close(self) -> None:
        """Do nothing: no port is open."""


def parse_typed(who: str, typed: str, settings: ManualSettings, unit: str) -> float:
    """Return the SI value of typed text. Raises Garbled, Implausible."""
    found = ENTRY.fullmatch(typed)
    if not found or not found["number"].isascii():
        words = "use a decimal point, not a comma" if "," in typed else "a number and its unit"
        raise Garbled(f"{who}: {typed!r}: expected {words}, such as 4.99 {settings.unit}")
    known = UNITS[unit]
    if found["unit"] not in known:
        raise Garbled(f"{who}: {typed!r}: unknown unit {found['unit']!r} (known: {', '.join(known)})")
    value = float(found["number"]) * known[found["unit"]]
    lo, hi = (end * known[settings.unit] for end in settings.range)
    if not lo <= value <= hi:
        ends = f"{settings.range[0]:g} to {settings.range[1]:g} {settings.unit}"
        raise Implausible(f"{who}: {typed.strip()} is outside {ends}, the range in the bench file")
    return value


def _open(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return Manual(name, settings_of(name, ManualSettings, entry), ask, entry.model, entry.serial)


DRIVER = Driver(("manual",), _open)
