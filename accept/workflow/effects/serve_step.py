"""Facts for the dialogue at a step, and the execution of its effects on the unit and the bench."""

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path

from accept.store import Event
from accept.workflow.bench import Workbench
from accept.workflow.dialogue.step_effects import Recognize, StoreEntry
from accept.workflow.dialogue.step_state import FieldPlace, StepFacts, places
from accept.workflow.dialogue.turn import Toast
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.entry.record_folder import Proposals
from accept.workflow.instruments.port import InstrumentPort
from accept.workflow.session import Session
from accept.workflow.session.entries import entry_words
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.unit_list import Queue
from checks.declare import CsvTable, Form, Series
from checks.errors import RecordError
from specs.bench import channel_map
from specs.errors import AcceptError

_COURSE = 24  # values that show how a record runs


def saved_words(event: Event) -> Toast:
    """Return what was saved, when, and as which entry of the record."""
    origin, file = Path(str(event.data.get("origin", ""))).name, event.data.get("file", "")
    renamed = f"{origin} as " if file and origin not in ("", file) else ""
    return Toast(saved_title(event), f"{renamed}{entry_words(event)}")


def changed_words(event: Event, undone: str) -> Toast:
    """Return what was undone, "" for a step that is measured again."""
    if undone:
        return Toast(f"Undone {_clock_words(event)}", f"{undone}; the record keeps both")
    return Toast(saved_title(event), "Measured again; the record keeps the earlier entries")


def saved_title(event: Event, what: str = "Saved") -> str:
    """Return that something was saved, when, and as which entry of the record."""
    return f"{what} {_clock_words(event)} as entry {event.seq}"


def _clock_words(event: Event) -> str:
    """Return when an event was stored, as the bench's clock showed it."""
    return f"{datetime.fromisoformat(event.time).astimezone():%H:%M:%S}"


class StepService:
    """Serves one step. All but `facts` and `instrument` may block."""

    def __init__(self, bench: Workbench, session: Session, step: WorkflowStep) -> None:
        self.bench, self.session, self.step = bench, session, step

    def facts(self, queue: Queue | None) -> StepFacts:
        """Return the state of unit and bench. queue: what is done at one unit after the other."""
        session, step = self.session, self.step
        served = ((place.key, self.instrument(place)) for form in step.check.forms for place in places(form))
        return StepFacts(
            session.serial,
            session.spec.kind,
            session.run.seq,
            session.state(step.name),
            session.judgements.status(step),
            session.judgements.of_step(step.name),
            session.judgements.action_at_source(step),
            session.judgements.next_step(step.name) is not None,
            tuple(session.judgements.waiting),
            queue,
            {key: port.offer for key, port in served if port is not None},
            self.bench.instruments.recording(step.name) is not None,
            bool(session.attempt.undoable),
            self.bench.training is not None,
        )

    def instrument(self, place: FieldPlace) -> InstrumentPort | None:
        """Return the instrument that reads a value, None if it is typed."""
        return None if place.is_file else self.bench.instruments.serving(self.step.name, *place.key)

    def proposals(self, form: Form) -> Proposals:
        """Return the proposed records of a form; if they cannot be listed, the list behind F2 gives the reason."""
        try:
            return self.session.records.proposals(self.step, form, self.bench.records)
        except (AcceptError, OSError):
            return {}

    def path(self, text: str) -> Path:
        """Return the path of a record as it is typed; a relative one is in the folder of the records."""
        return self.bench.records / Path(text.strip()).expanduser()

    def course(self, declared: Series, file: str) -> Sequence[float]:
        """Return the course of a stored record in few values, none of one that cannot be read."""
        import numpy as np

        from hw.records import read  # readers load slowly

        try:
            record = read(self.session.folder / file, declared, channel_map(self.session.attempt.channels))
            values = np.asarray(record[list(declared.channels)[-1]], dtype=float)
        except (RecordError, OSError, KeyError):
            return ()
        return [float(part.max()) for part in np.array_split(values, min(_COURSE, values.size))]

    def stored_at(self, seq: int) -> float:
        """Return when an entry was stored [s since 1970]."""
        event = next(each for each in reversed(self.session.events) if each.seq == seq)
        return datetime.fromisoformat(event.time).timestamp()

    def recognize(self, asked: Recognize, is_secret: Callable[[str], bool]) -> str:
        """Return `unit`, `passphrase` or "" for a text, as `recognized` takes it. Raises StoreError."""
        text = asked.text.strip()
        if asked.is_file and self.path(text).exists():
            return ""
        if asked.may_be_serial and (text == self.session.serial or self.bench.is_serial(text)):
            return "unit"
        return "passphrase" if is_secret(asked.text) else ""

    def store(self, entry: StoreEntry) -> Event:
        """Store an entry. Raises EntryError, InstrumentError, StoreError, OSError."""
        session, step, index, declared = self.session, self.step.name, entry.place[1], entry.declared
        if isinstance(declared, Series | CsvTable):
            path = self.path(entry.text)
            try:
                return session.records.link(step, declared, path)
            except RecordError as e:
                raise EntryError(f"{e}\n→ {session.records.link_advice(path, e)}") from e
        if entry.measured is not None:
            return session.entries.take(
                step, declared, entry.measured, index=index, repeat=entry.repeat, text=entry.text
            )
        instrument = self.bench.instruments.serving(step, *entry.place)
        if instrument is None:
            raise EntryError("No instrument for this field; type the value")
        return session.entries.read(step, declared, instrument, index=index, repeat=entry.repeat)

    def doing(self, entry: StoreEntry) -> str:
        """Return what happens while an entry is stored."""
        port = self.bench.instruments.serving(self.step.name, *entry.place) if entry.is_reading else None
        return "saving" if port is None else f"reading {port.name}"
