"""Entries that are taken back, by an event: the record keeps both."""

from accept.store import Event
from accept.store.payloads import EntryUndone, RecordLinked, RunOpened, StepNoted, ValueTaken, payload_of
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.session.unit import Subject
from accept.workflow.steps.section import value_words


class Undo(Subject):
    """Takes back entries of one unit."""

    def entry(self, step: str = "") -> Event:
        """Take back the last entry of this attempt. step: only if it belongs to this one. Raises EntryError if there is
        no entry, or one of another step, or a nonconformance, which only quality assurance releases."""
        with self._unit.mutex:
            seqs = self._unit.attempt.undoable
            last = next((e for e in reversed(self._unit.events) if seqs and e.seq == seqs[-1]), None)
            if last is None:
                raise EntryError("there is nothing to undo in this attempt")
            if step and last.data.get("step") != step:
                raise EntryError("the last entry belongs to another step; undo it in the step list")
            if last.what == StepNoted.KIND and (note := StepNoted.of(last)).nonconformance:
                raise EntryError(f"'{note.text}' holds this unit; only quality assurance releases it (F9, then ^T)")
            return self._unit.append(EntryUndone(last.seq))

    def unit(self) -> Event:
        """Take back that this unit was begun, as if its serial had not been entered. Raises EntryError if anything was
        done at it, StoreError."""
        with self._unit.mutex:
            done = {e.what for e in self._unit.events if e.seq > self._unit.begun} - {RunOpened.KIND}
            if done or self._unit.attempt.number > 1:
                raise EntryError(f"{self._unit.serial} stays: something was done at it")
            return self._unit.append(EntryUndone(self._unit.begun))

    def words_of(self, undo: Event) -> str:
        """Return what an event took back, and the step that it belonged to."""
        of = EntryUndone.of(undo).undoes
        event = next(each for each in self._unit.events if each.seq == of)
        return f"{entry_words(event)} ({self._unit.step(str(event.data['step'])).short})"


def entry_words(event: Event) -> str:
    """Return what was entered by an event."""
    match payload_of(event):
        case ValueTaken() as taken:
            return value_words(taken.input, taken.index, taken.value, taken.unit)
        case RecordLinked() as link:
            return link.file
        case StepNoted() as note:
            return f"note '{note.text}'"
    return "measuring again"
