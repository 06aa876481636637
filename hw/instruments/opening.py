"""From an entry of the bench file to a driver on its line."""

from collections.abc import Callable
from typing import Protocol, TypeVar

from pydantic import ValidationError

from hw.errors import SettingsError
from hw.instruments.heidenhain import Heidenhain, HeidenhainSettings
from hw.instruments.lcr800 import Lcr800, Lcr800Settings
from hw.instruments.manual import Manual, ManualSettings
from hw.instruments.millimar_m1240 import M1240Settings, MillimarM1240
from hw.instruments.millimar_optors import MillimarOptors, OptorsSettings
from hw.instruments.reading import Identity, Reading
from hw.link import LineSettings, Link
from specs.bench import OFFLINE, InstrumentEntry
from specs.strict import Strict, problem_line

Ask = Callable[[str], str]
S = TypeVar("S", bound=Strict)


class Instrument(Protocol):
    """What capture and `accept hw test` need of any driver. link: None where there is no wire."""

    name: str
    model: str | None
    serial: str | None
    unit: str
    reminders: tuple[str, ...]

    @property
    def link(self) -> Link | None: ...
    def connect(self) -> Identity: ...
    def read(self) -> Reading: ...
    def close(self) -> None: ...


def _millimar(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    if entry.settings.get("protocol") == "M1240":
        settings = _settings(name, M1240Settings, entry)
        return MillimarM1240(name, _link(name, entry), settings, entry.model, entry.serial)
    return MillimarOptors(name, _link(name, entry), _settings(name, OptorsSettings, entry), entry.model, entry.serial)


def _lcr800(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return Lcr800(name, _link(name, entry), _settings(name, Lcr800Settings, entry), entry.model, entry.serial)


def _heidenhain(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    settings = _settings(name, HeidenhainSettings, entry)
    return Heidenhain(name, _link(name, entry), settings, entry.model, entry.serial)


def _manual(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return Manual(name, _settings(name, ManualSettings, entry), ask, entry.model, entry.serial)


DRIVERS: dict[str, Callable[[str, InstrumentEntry, Ask], Instrument]] = {
    "millimar": _millimar,
    "lcr800": _lcr800,
    "nd287": _heidenhain,
    "nd281b": _heidenhain,
    "manual": _manual,
}


def open_instrument(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    """Driver of an entry; the port is opened by its first use. ask: how the manual driver asks a person.
    Raises SettingsError."""
    if entry.driver not in DRIVERS:
        words = f"'{OFFLINE}' has no wire to it" if entry.driver == OFFLINE else f"unknown driver {entry.driver!r}"
        raise SettingsError(f"{name}: {words} (known: {', '.join(DRIVERS)})")
    return DRIVERS[entry.driver](name, entry, ask)


def _link(name: str, entry: InstrumentEntry) -> Link:
    if entry.link is None:
        raise SettingsError(f"{name}: [instruments.{name}.link] is missing: port, baud, data_bits, parity...")
    return Link(LineSettings(**entry.link.model_dump()))


def _settings(name: str, kind: type[S], entry: InstrumentEntry) -> S:
    try:
        return kind.model_validate(entry.settings)
    except ValidationError as e:
        problems = "; ".join(problem_line(problem) for problem in e.errors())
        raise SettingsError(f"{name}: [instruments.{name}.settings] {problems}") from e
