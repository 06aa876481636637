"""The workflow's bench: store, folder, specs, instruments, and where records arrive."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from accept.base.names import is_system_account
from accept.store import Event, Store
from accept.store.payloads import AttemptStarted, RunOpened
from accept.units import UnitFolder
from accept.workflow.dialogue.begin import Begun
from accept.workflow.entry.parse_entry import is_described, serial_problem
from accept.workflow.instruments.port import Instruments
from accept.workflow.ports import Services
from accept.workflow.session import Session
from accept.workflow.session.import_folder import adopt
from accept.workflow.steps.unit_list import KnownUnit, known_unit, known_units
from specs.bench import NO_CHANNELS, BenchFile, Channels
from specs.spec import Spec


class Exercise(Protocol):
    """The simulated unit of a training, as the screens see it."""

    @property
    def hidden(self) -> str:
        """Return what was wrong, and what the technician made of it."""

    @property
    def choices(self) -> Sequence[str]:
        """Return what may be wrong with the unit, the truth among it; nothing once it was guessed."""

    def guess(self, place: int) -> str:
        """Return whether this was it, and the score of this session."""

    def remedies(self, session: Session) -> Sequence[Any]:
        """Return what can be put right at the bench, each in `words`, for a `step`."""

    def put_right(self, session: Session, remedy: Any) -> Event:
        """Record a step again, without the fault if this is its remedy."""

    def resume(self, session: Session) -> None:
        """Put right what was put right already in the present attempt."""


@dataclass(frozen=True, eq=False)
class Workbench:
    """The open bench. specs: kind -> spec. services: what judges, measures and signs. records: folder that new record
    files arrive in. training: the simulated unit of a training, None for a real one. proposed: serial to begin with.
    stated: the bench file whose calibrations stand behind the findings. taken: an existing unit folder to continue.
    closing: stops what runs beside the workflow."""

    store: Store
    home: Path
    specs: Mapping[str, Spec]
    services: Services
    instruments: Instruments = field(default_factory=Instruments)
    records: Path = field(default_factory=Path.cwd)
    training: "Exercise | None" = None
    proposed: str = ""
    stated: BenchFile | None = None
    taken: UnitFolder | None = None
    closing: Callable[[], None] = field(default=lambda: None)

    def close(self) -> None:
        """Close the instruments and the store, and end the process that judges."""
        self.services.close()
        self.closing()
        self.store.close()

    def last_operator(self) -> str:
        """Return who opened a unit here last, "" if none or an account of the system. Raises StoreError."""
        last = self._last_opened()
        return "" if last is None or is_system_account(last.who) else last.who

    def unfinished(self, operator: str) -> str:
        """Return the serial of the unit that was opened here last, with which the next start goes on; "" if another
        operator opened it, if nothing was measured yet, or if it is signed. Raises StoreError."""
        last = self._last_opened()
        if last is None or last.who != operator or not (self.home / "units" / last.subject).exists():
            return ""  # several benches may share a store: the folder is of this one
        known = self.known_one(last.subject)
        goes_on = known is not None and known.kind in self.specs and not known.signed and (known.taken or known.notes)
        return last.subject if goes_on else ""

    def _last_opened(self) -> Event | None:
        opened = [event for what in (AttemptStarted.KIND, RunOpened.KIND) for event in self.store.newest(what, 1)]
        return max(opened, key=lambda event: event.seq, default=None)

    def next_serial(self) -> str:
        """Return the serial that is proposed for the unit after this one."""
        return ""

    def at_unit(self, _: Begun) -> "Workbench":
        """Return the bench as it stands for a unit."""
        return self

    def known(self) -> list[KnownUnit]:
        """Return the units that were begun here last, of every kind. Raises StoreError."""
        return known_units(self.store, self.specs)

    def known_one(self, serial: str) -> KnownUnit | None:
        """Return the entry of one serial, None for a new one. Raises StoreError."""
        return known_unit(self.store, serial, self.specs)

    def described(self, serial: str) -> str | None:
        """Return the kind of the only spec that describes serials like this one, None if none or several do."""
        kinds = [kind for kind, spec in self.specs.items() if is_described(serial, spec)]
        return kinds[0] if len(kinds) == 1 else None

    def is_serial(self, text: str) -> bool:
        """Return whether text is the serial of a begun unit, or one by a spec's own pattern. Raises StoreError."""
        return any(is_described(text, spec) for spec in self.specs.values()) or self.known_one(text) is not None

    def problem(self, serial: str, kind: str) -> str | None:
        """Return why this serial is not valid for a unit of this kind, None if it is."""
        return serial_problem(serial, self.specs[kind])

    def session(self, serial: str, kind: str, operator: str) -> Session:
        """Open a unit. Raises EntryError, UnitBusy, StoreError, OSError."""
        return self.services.open_session(self.store, self.home, self.specs[kind], operator, serial, self.stated)

    def open_unit(self, begun: Begun) -> tuple[Session, list[str]]:
        """Return the unit with an attempt to work on, and what could not be taken from its folder. Raises as
        `session`, and EntryError if a passphrase was typed for one of the entries."""
        new = [] if self.known_one(begun.serial) is not None else [begun.serial]
        self.services.refuse_passphrases(self.home, [*new, begun.operator, *begun.parts.values(), begun.reason or ""])
        session = self.session(begun.serial, begun.kind, begun.operator)
        try:
            if begun.confirmed:
                self.services.tell_apart(self.store, begun.serial, begun.operator)
            self.services.warm()
            problems = self._attempt(session, begun)
            if self.training is not None:
                self.training.resume(session)
            return session, problems
        except BaseException:
            session.close()
            raise

    def add(self, begun: Begun) -> None:
        """Begin a unit of a tray, to be measured later. Raises as `session`."""
        session, _ = self.open_unit(begun)
        session.close()

    def take_off(self, serial: str, kind: str, operator: str) -> None:
        """Take a unit off the list at which nothing was done: its serial was a mistake. Raises as `session`, and
        EntryError if something was done."""
        session = self.session(serial, kind, operator)
        try:
            session.undo.unit()
        finally:
            session.close()

    def _channels(self, taken: UnitFolder | None) -> Channels:
        """Return the names of the channels in records: as the unit's folder gives them, else as the rig does."""
        if taken is not None and taken.channels:
            return taken.channels
        return self.stated.rig.channels if self.stated is not None and self.stated.rig is not None else NO_CHANNELS

    def _attempt(self, session: Session, begun: Begun) -> list[str]:
        taken = self.taken if self.taken is not None and self.taken.serial == session.serial else None
        if session.run.attempt is None or begun.reason is not None:
            simulated = taken is not None and taken.header.simulated
            session.begin(begun.parts, begun.reason or "", self._channels(taken), simulated)
        else:
            session.resume()
        if self.taken is not None and taken is None:
            return [f"nothing was taken from {self.taken.path}: it is the folder of {self.taken.serial}"]
        if taken is not None and taken.header.simulated and not session.attempt.simulated:
            return [
                f"nothing was taken from {taken.path}: it is of a simulated unit, {session.serial} is measured here"
            ]
        return [] if taken is None else adopt(session, taken)
