"""The interface of a driver: its names in a bench file, and how it is made from an entry there."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, TypeVar, runtime_checkable

from pydantic import ValidationError

from hw.errors import SettingsError
from hw.instruments.reading import Identity, Reading
from hw.link import Link
from hw.serial_port import LineSettings
from specs.bench import InstrumentEntry, RecorderEntry
from specs.strict import Strict, problem_line

Ask = Callable[[str], str]
S = TypeVar("S", bound=Strict)


class Instrument(Protocol):
    """The interface of a driver to captures and `accept hw test`. link: None without a wire. asked: the settings that
    the instrument has stated since `connect`. confirm: ask at the end of a run whether it is still the same."""

    name: str
    model: str | None
    serial: str | None
    unit: str
    reminders: tuple[str, ...]
    asked: Mapping[str, str]

    @property
    def link(self) -> Link | None: ...
    def connect(self) -> Identity: ...
    def read(self) -> Reading: ...
    def confirm(self) -> Identity: ...
    def close(self) -> None: ...


@runtime_checkable
class Sampling(Protocol):
    """An instrument that can also follow a moving value."""

    def sample(self) -> Reading:
        """Return a single answer: two answers of a moving value would not agree. A series ends with `confirm`."""


Opener = Callable[[str, InstrumentEntry, Ask], Instrument]


@dataclass(frozen=True)
class Trial:
    """A change at the instrument during commissioning. asked: the driver asks for this setting, so a reading must be
    refused; otherwise the value may also stay while the technician sees the change. optional: not every instrument of
    the kind has it."""

    do: str
    asked: bool = True
    optional: bool = False


@dataclass(frozen=True)
class Driver:
    """A driver of instruments. names: as `driver` in a bench file. open: (name in the bench file, entry, ask a person)
    -> instrument; the port is opened by its first use; raises SettingsError. trials: for its commissioning."""

    names: tuple[str, ...]
    open: Opener
    trials: tuple[Trial, ...] = ()

    @property
    def name(self) -> str:
        return self.names[0]


def serial_driver(
    driver: Callable[..., Instrument], settings: type[Strict], *names: str, trials: tuple[Trial, ...] = ()
) -> Driver:
    """Return the driver of an instrument on a serial line."""

    def opened(name: str, entry: InstrumentEntry, _: Ask) -> Instrument:
        return driver(name, link_of(name, entry), settings_of(name, settings, entry), entry.model, entry.serial)

    return Driver(names, opened, trials)


def link_of(name: str, entry: InstrumentEntry) -> Link:
    """Return the line that an entry describes. Raises SettingsError."""
    if entry.link is None:
        raise SettingsError(f"{name}: [instruments.{name}.link] is missing: port, baud, data_bits, parity...")
    return Link(LineSettings(**entry.link.model_dump()))


def settings_of(name: str, kind: type[S], entry: InstrumentEntry | RecorderEntry) -> S:
    """Return an entry's settings, of the driver's own kind. Raises SettingsError."""
    try:
        return kind.model_validate(entry.settings)
    except ValidationError as e:
        problems = "; ".join(problem_line(problem) for problem in e.errors())
        section = "recorders" if isinstance(entry, RecorderEntry) else "instruments"
        raise SettingsError(f"{name}: [{section}.{name}.settings] {problems}") from e
