"""Facts for the dialogue at a step, and the execution of its effects on the unit and the bench."""

from collections.abc import Callable
from pathlib import Path

from accept.store import Event
from accept.workflow.bench import Workbench
from accept.workflow.dialogue.fields import FieldPlace, places
from accept.workflow.dialogue.step_effects import Recognize, StoreEntry
from accept.workflow.dialogue.step_state import StepFacts
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.entry.record_folder import Proposals
from accept.workflow.instruments.port import InstrumentPort
from accept.workflow.session import Session
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.unit_list import Queue
from checks.declare import CsvTable, Form, Series
from checks.errors import RecordError
from specs.errors import AcceptError


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

    def recognize(self, asked: Recognize, is_secret: Callable[[str], bool]) -> str:
        """Return `unit`, `passphrase` or "" for a text, as `recognized` takes it. Raises StoreError."""
        text = asked.text.strip()
        if asked.is_file and self.path(text).exists():
            return ""
        if asked.may_be_serial and (text == self.session.serial or self.bench.known_one(text) is not None):
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
