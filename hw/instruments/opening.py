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
from hw.link import Link
from hw.serial_port import LineSettings
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


Opener = Callable[[str, InstrumentEntry, Ask], Instrument]


def _millimar(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    if entry.settings.get("protocol") == "M1240":
        return _serial(MillimarM1240, M1240Settings)(name, entry, ask)
    return _serial(MillimarOptors, OptorsSettings)(name, entry, ask)


def _serial(driver: Callable[..., Instrument], settings: type[Strict]) -> Opener:
    """How a driver on a serial line is made of an entry: all of them are made alike."""

    def opened(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
        return driver(name, _link(name, entry), _settings(name, settings, entry), entry.model, entry.serial)

    return opened


def _manual(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return Manual(name, _settings(name, ManualSettings, entry), ask, entry.model, entry.serial)


DRIVERS: dict[str, Opener] = {
    "millimar": _millimar,
    "lcr800": _serial(Lcr800, Lcr800Settings),
    "nd287": _serial(Heidenhain, HeidenhainSettings),
    "nd281b": _serial(Heidenhain, HeidenhainSettings),
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
