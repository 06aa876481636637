"""All that the workflow has at hand: store, folder, specs, instruments, where records arrive."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from accept.campaign import DEFAULT_SPEC, load_spec
from accept.home import home
from accept.store import Store, open_store
from accept.workflow.instruments import Instruments, NoInstruments
from accept.workflow.known import KnownUnit, known_unit, known_units
from accept.workflow.session import Session, serial_problem
from specs import Spec

LOCK_WAIT_S = 5.0  # for another program's hold on the store: then the technician is told


@dataclass(frozen=True, eq=False)
class Bench:
    """specs: kind -> spec. records: folder that new record files arrive in. hidden: what a training unit has, told at
    the end; None where the unit is real. proposed: serial to begin with."""

    store: Store
    home: Path
    specs: Mapping[str, Spec]
    instruments: Instruments = field(default_factory=NoInstruments)
    records: Path = field(default_factory=Path.cwd)
    hidden: str | None = None
    proposed: str = ""

    def known(self) -> list[KnownUnit]:
        """Units of the kinds that are judged here. Raises StoreError."""
        return [unit for unit in known_units(self.store) if unit.kind in self.specs]

    def known_one(self, serial: str) -> KnownUnit | None:
        """Raises StoreError."""
        return known_unit(self.store, serial)

    def problem(self, serial: str, kind: str) -> str | None:
        """Why this cannot be the serial of a unit of this kind."""
        return serial_problem(serial, self.specs[kind])

    def session(self, serial: str, kind: str, operator: str) -> Session:
        """Open a unit. Raises EntryError, UnitBusy, StoreError, OSError."""
        return Session(self.store, self.home, self.specs[kind], operator, serial)


def open_bench(spec: str | None, records: Path | None, instruments: Instruments | None = None) -> Bench:
    """The bench of `ACCEPT_HOME`. Raises SpecError, StoreError, HomeError."""
    specs = [load_spec(spec)] if spec else [load_spec(name) for name in DEFAULT_SPEC.values()]
    return Bench(
        open_store(timeout_s=LOCK_WAIT_S),
        home(),
        {one.kind: one for one in specs},
        instruments or NoInstruments(),
        records or Path.cwd(),
    )
