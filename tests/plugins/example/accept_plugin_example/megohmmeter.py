"""A megohmmeter that writes its last reading into a file, as its logger does."""

import time
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from hw.errors import Garbled, NoReply
from hw.instruments import Driver, Identity, Instrument, Reading, settings_of
from hw.instruments.driver import Ask
from hw.link import Link
from specs.bench import InstrumentEntry
from specs.strict import Strict


class MegohmmeterSettings(Strict):
    """file : where the logger writes."""

    file: str


class Megohmmeter:
    """Resistance [ohm]."""

    unit = "ohm"
    reminders: tuple[str, ...] = ("Discharge the stacks before you touch the leads.",)
    asked: Mapping[str, str] = MappingProxyType({})
    link: Link | None = None

    def __init__(self, name: str, settings: MegohmmeterSettings, model: str | None, serial: str | None) -> None:
        self.name, self.settings, self.model, self.serial = name, settings, model, serial

    def connect(self) -> Identity:
        return Identity(self.model, self.serial)

    def read(self) -> Reading:
        """Raises NoReply without a file, Garbled for what is no number."""
        try:
            line = Path(self.settings.file).read_bytes()
        except OSError as e:
            raise NoReply(f"{self.name}: {self.settings.file}: {e.strerror}") from e
        try:
            return Reading(float(line), self.unit, time.time(), (line,))
        except ValueError as e:
            raise Garbled(f"{self.name}: {line[:40]!r} is not a number") from e

    def confirm(self) -> Identity:
        """Still the one that it was."""
        return self.connect()

    def close(self) -> None:
        """Nothing is open."""


def _open(name: str, entry: InstrumentEntry, ask: Ask) -> Instrument:
    return Megohmmeter(name, settings_of(name, MegohmmeterSettings, entry), entry.model, entry.serial)


DRIVER = Driver(("megohmmeter",), _open)
