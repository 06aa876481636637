"""One step: entries into its fields, one by one to the store; judged as soon as nothing is missing."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual.binding import ActiveBinding, Binding, BindingType
from textual.widgets import Input

from accept.capture.operator_actions import Person
from accept.capture.setup import CaptureResult
from accept.store import Event
from accept.store.payloads import EntryUndone
from accept.tui.screens.ask import Question, QuestionLine, required
from accept.tui.screens.capture_dialogue import CaptureDialogue
from accept.tui.screens.put_right import ask_remedy
from accept.tui.screens.record_picker import Pick
from accept.tui.screens.step_form import StepForm
from accept.tui.widgets.fields import Field, FieldPlace
from accept.tui.widgets.live_value import Gauge
from accept.tui.widgets.step_list import WIDE_FROM
from accept.workflow.capture import capture
from accept.workflow.entry.parse_entry import (
    EntryError,
    are_several,
    doubt,
    parse_list,
    parse_number,
    parse_scalar,
    passing_range,
    usual_range,
)
from accept.workflow.shift import NOT_TAKEN
from accept.workflow.steps.plan import has_files, is_needed
from accept.workflow.steps.section import records_awaited
from checks.declare import CsvTable, Measured, Scalar, Series, Vector
from checks.errors import RecordError

TYPED_AHEAD_S = 0.2  # what a paste or a scanner sends arrives within; a person reads a refusal more slowly


class StepScreen(StepForm):
    """Values and files of one step, stored one by one; judged as soon as nothing is missing."""

    # All before the line itself gets them: so keys act in the order in which they were pressed, however fast they come.
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "enter", show=False, priority=True),
        Binding("f2", "pick", "File", priority=True),
        Binding("f3", "read", "Read", priority=True),
        Binding("f4", "repeat", "Repeat", priority=True),
        Binding("f5", "note", "Note", priority=True),
        # F6 and F9 stand beside the fields: in the footer they would push "Back" off 80 columns.
        Binding("f6", "way", "Input", priority=True, show=False),
        Binding("f7", "picture", "Plots", priority=True),
        Binding("f8", "measure_again", "Again", priority=True),
        Binding("f9", "keep", "Keep", priority=True, show=False),
        Binding("ctrl+z", "undo", "Undo", priority=True),
        Binding("ctrl+r", "put_right", "Put right", priority=True),
        Binding("up", "line(-1)", show=False, priority=True),
        Binding("down", "line(1)", show=False, priority=True),
        Binding("escape", "leave", "Back", priority=True),
    ]

    async def action_enter(self) -> None:
        """Save what stands in the line, and go on at once: the next key belongs to the next line."""
        if await self.take_scan():
            return
        field = self._focused_field() or self._refused()
        if field is None:
            await self._finish()  # nothing is missing here: the list opens the next step
        elif text := field.input.value.strip():
            if not (await self._is_other_unit(field, text) or await self._is_refused(field)):
                self._give(field, field.input.value, repeat=False)
        elif (
            file := field.proposed or (self._proposals.get(field.place.declared.name) if field.damaged else None)
        ) is not None:
            self._give(field, file.name, repeat=False)
        elif self.dispensable(field):
            await self._finish()
        else:
            self._go_past(field)

    async def take_value(self, text: str) -> None:
        """Give a value to the field under the cursor, if it takes one."""
        field = self._focused_field()
        if field is None:
            self.say(f"{text} was not saved: this step is complete. ↑ ↓: choose the field to correct", "bad")
        elif field.place.is_file:
            self.say(f"{text} was not saved: {field.place.name} is a file. {self.what_now}", "bad")
        else:
            self._give(field, text, repeat=False)

    def _go_past(self, field: Field) -> None:
        """Go on from an empty field, unless it is required: what is read or typed next would be that of another."""
        if is_needed(field.place.declared) and not (field.pending or self._has(field.place)):
            self.say(f"{field.place.name} is required. {self.what_now}. ↓: next field", "bad")
        else:
            self._go_on(field)
            self._hint()

    async def _finish(self) -> None:
        """Judge what was given if that was put off, else go on to the next step, or to the next unit of the queue, once
        all is saved: what was not stays here."""
        await self.saved()
        if (field := self._refused()) is not None:
            self.set_focus(field.input)
        elif self.complete and self.session.judgement(self.step.name) is None and not self.judging:
            self.judge()
        else:
            await self.go_further()

    async def _is_other_unit(self, field: Field, text: str) -> bool:
        """Go to another unit if its serial was scanned into the line of a value or a file. Returns whether it was."""
        place = field.place
        if not any(map(str.isalpha, text)) or any(map(str.isspace, text)):
            return False
        if place.is_file:
            if (self.bench.records / Path(text).expanduser()).exists():
                return False
        else:
            with suppress(EntryError):
                parse_number(text, place.unit)
                return False
        if text != self.session.serial and await asyncio.to_thread(self.bench.known_one, text) is None:
            return False
        field.input.value = ""
        await self.saved()
        if why := await self.bench_app.scanned(text, self.queue or self.own_queue):
            self.say(why, "bad")
        return True

    async def _is_refused(self, field: Field) -> bool:
        """Take a passphrase away that was typed for a value or a file. Returns whether it was one."""
        text = field.input.value
        is_file = field.place.is_file and (self.bench.records / Path(text.strip()).expanduser()).exists()
        if refused := not is_file and await self.is_secret(text):
            field.input.value = ""
            self.app.bell()
            self.say(NOT_TAKEN, "bad")
        return refused

    def _refused(self) -> Field | None:
        """Return the first field whose entry was refused and still stands there: Enter tries it again before the cursor
        is back, and does not go on without it."""
        return next((f for f in self.query(Field) if f.has_class("refused") and f.input.value.strip()), None)

    def _give(self, field: Field, text: str, repeat: bool, sure: bool = False) -> None:
        """Send what was typed to the store, or say beside the field why not. sure: it was asked about already.

        The cursor goes on at once, because what was typed ahead belongs to the next field, and comes back to what was
        refused if nothing was.
        """
        place = field.place
        try:
            match place.declared:
                case Series() | CsvTable() as declared:
                    path = self.bench.records / Path(text.strip()).expanduser()  # an absolute one stays itself
                    self._store(field, partial(self._link, declared, path), text)
                case Vector() as declared if are_several(text, declared.size):
                    self._take_all(parse_list(text, declared), text, sure)
                case Scalar() as declared:
                    self._take(field, parse_scalar(text, declared), repeat, text, sure)
                case _:
                    self._take(field, parse_number(text, place.unit), repeat, text, sure)
        except EntryError as e:
            field.refuse(text, str(e))
            self.say(f"{field.place.name}: {e}", "bad")
            self.app.bell()
            self.set_timer(TYPED_AHEAD_S, partial(self._return_to, field))
        self._go_on(field)

    def _link(self, declared: Series | CsvTable, path: Path) -> Event:
        """Link a record, in a thread. Raises EntryError if it is refused, with what to do."""
        try:
            return self.session.link(self.step.name, declared, path)
        except RecordError as e:
            raise EntryError(f"{e}\n→ {self.session.link_advice(path, e)}") from e

    def _return_to(self, field: Field) -> None:
        """Put the cursor back to what was refused or asked about, unless it was saved or something was typed elsewhere
        meanwhile: what is typed next is its correction, and no value of the next field. Nothing is done if the fields
        of another form were laid out meanwhile."""
        if not field.query(Input):
            return
        here = self._focused_field()
        if (field.has_class("refused") or field.doubted is not None) and (here is None or not here.input.value):
            self.set_focus(field.input)
            field.input.select_all()

    def _take(self, field: Field, measured: Measured, repeat: bool, text: str, sure: bool) -> None:
        place, step = field.place, self.step.name
        if not sure and (question := self._doubt(place, measured.value)):
            self._ask(field, text, question)
            self.app.bell()
            self.set_timer(TYPED_AHEAD_S, partial(self._return_to, field))
            return
        self._store(
            field,
            lambda: self.session.take(step, place.declared, measured, index=place.index, repeat=repeat, text=text),
            text,
        )

    def _doubt(self, place: FieldPlace, value: float) -> str:
        declared = place.declared
        if not isinstance(declared, Scalar | Vector):
            return ""
        limits = self.step.asked.limits
        return doubt(value, place.unit, usual_range(declared, limits), passing_range(declared, limits))

    def _take_all(self, values: list[float], text: str, sure: bool) -> None:
        fields = list(self.query(Field))
        unusual = next((q for f, v in zip(fields, values, strict=True) if (q := self._doubt(f.place, v))), "")
        if unusual and not sure:
            self._ask(fields[0], text, unusual)
            self.say(f"{unusual}. F9: keep all", "doubt")
            self.set_timer(TYPED_AHEAD_S, partial(self._return_to, fields[0]))
            return
        for field, value in zip(fields, values, strict=True):
            self._take(field, Measured(value), False, f"{value:.9g} {field.place.unit}", True)

    async def action_keep(self) -> None:
        """Keep what the foot asks about as it was typed; without a question, go to the summary. Of several questions
        each is shown before it is answered."""
        here, asked = self._focused_field(), [field for field in self.query(Field) if field.doubted is not None]
        field = here if here in asked else self._asked if self._asked in asked else next(iter(asked), None)
        if field is None or field.doubted is None:
            typed = next((each for each in self.query(Field) if each.input.value.strip()), None)
            if typed is None:
                await self.action_to_summary()
            else:
                self.say(f"{typed.place.name} is not saved. Enter: save it", "bad")
        elif field is not self._asked:
            self._ask(field, field.doubted, field.question)
            self.set_focus(field.input)
        elif field.input.value != field.doubted:  # it was typed again meanwhile: that is another entry
            self.say("The entry was changed. Enter: save it", "bad")
        else:
            self._asked = None
            self._give(field, field.doubted, repeat=False, sure=True)

    def _ask(self, field: Field, text: str, question: str) -> None:
        """Ask about what was typed, beside the field and at the foot."""
        self._asked = field
        field.ask(text, question)
        self.say(f"{field.place.name}: {question}. F9: keep it, or type another", "doubt")

    def _store(self, field: Field, action: Callable[[], Event], text: str = "", doing: str = "saving") -> None:
        field.send()
        self.send(action, lambda event: self._stored(field, event), doing, lambda why: self._lost(field, text, why))

    def _stored(self, field: Field, event: Event) -> None:
        """Show a value that is on the disk."""
        field.arrived()
        self.show()
        if field.place.is_file:  # what it was is proposed no more, what it replaces may be proposed again
            taken = Path(str(event.data.get("origin", ""))).name
            self._proposals = {name: file for name, file in self._proposals.items() if file.name != taken}
            for other in self.query(Field):
                self._propose(other)
            self._look_again()
        given, kept = Path(str(event.data.get("origin", ""))).name, str(event.data.get("file", ""))
        saved = f"Saved ({event.seq}){f' as {kept}' if given != kept else ''}"
        if self._early:
            self.say(f"{saved}. The second F3 came too early: nothing was read. {self.what_now}", "doubt")
        else:
            self.say(f"{saved}. {self.what_now}", "saved")
        self._early = False
        for gauge in self.query(Gauge):
            gauge.forget()
        self._follow()
        if self.complete and not self._awaited():
            self.judge()

    def _awaited(self) -> bool:
        """Return whether the records of a step that needs none of them in particular are still coming in."""
        return records_awaited(self.step, self.state) and self.focused is not None

    def _lost(self, field: Field, text: str, why: str) -> None:
        """Put back what was typed but is not on the disk, and the cursor, unless something else was typed already."""
        field.arrived()
        self._early = False
        is_there = field.place.is_file and (self.bench.records / Path(text.strip()).expanduser()).is_file()
        field.refuse("" if is_there else text, why)  # a file that is no use is not tried again: Enter takes another
        refused = {Path(path).name for path in self.state.unusable}
        self._proposals = {name: file for name, file in self._proposals.items() if file.name not in refused}
        self._propose(field)
        if is_there:
            self.say(f"{Path(text).name}: not taken. {_sentence(why.rpartition('→ ')[2])}", "bad")
        self._look_again()
        self.set_timer(TYPED_AHEAD_S, partial(self._return_to, field))

    async def action_pick(self) -> None:
        field = self._focused_field()
        if field is None or not field.place.is_file:
            files = [f for f in self.query(Field) if f.place.is_file]
            empty = [f for f in files if not self._has(f.place)]
            field = next(iter(empty or (files if len(files) == 1 else [])), None)  # the only one may be replaced
        if field is None:
            others = any(map(has_files, self.step.check.forms))
            full = "No empty field for a file. ↑ ↓: choose the field to replace"
            other = "This field wants a number. F6: take a file" if others else "This step takes no file"
            self.say(full if has_files(self._form) else other, "bad")
            return
        chosen, declared = field, field.place.declared
        if not isinstance(declared, Series | CsvTable):
            return
        await self.app.push_screen(
            Pick(
                chosen.place.name,
                self.bench.records,
                partial(self.session.may_fit, declared),
                partial(self.session.name_score, self.step, declared),
                chosen.proposed.name if chosen.proposed is not None else "",
            ),
            lambda path: self._give(chosen, self._from_records(path), repeat=False) if path else None,
        )

    def _from_records(self, path: Path) -> str:
        """Return a file as it would be typed: the name alone if it is in the folder of the records."""
        records = self.bench.records
        return str(path.relative_to(records) if path.is_relative_to(records) else path)

    def action_read(self) -> None:
        """Take the instrument's value into the line; what is saved there already is replaced only when asked twice."""
        field = self._focused_field()
        if field is None and self._reading:
            self._too_early()
        elif field is None:
            self.say("Step complete. ↑ ↓: choose a field to read again")
        elif self._reading:
            self._too_early()
        elif self._has(field.place) and self._rereading is not field:
            self._rereading = field
            self.say(f"{field.place.name} is saved. F3 again: replace it. F4: one more reading of it", "doubt")
        else:
            self._read(field, repeat=False)

    async def action_repeat(self) -> None:
        """Take one more reading of the same value: what stands in the line, or what the instrument says."""
        field = self._focused_field()
        if field is not None and field.input.value.strip():
            if not await self._is_refused(field):
                self._give(field, field.input.value, repeat=True)
        elif self._reading:
            self._too_early()
        elif field is not None:
            self._read(field, repeat=True)
        else:
            self.say("Step complete: nothing was read. ↑ ↓: choose the field, F4: one more reading of it", "doubt")

    def _too_early(self) -> None:
        """Say that nothing is read for this key: the probe would still be at the point before."""
        self._early = True
        self.app.bell()
        self.say("Wait: a reading is under way. Press F3 again when it is saved", "bad")

    def _read(self, field: Field, repeat: bool) -> None:
        place, step = field.place, self.step.name
        if place.is_file and self.bench.instruments.recording(step) is not None:
            self._ask_to_measure(field)
            return
        instrument = None if place.is_file else self._instrument(place)
        if instrument is None:
            self.say("No instrument for this field; type the value", "bad")
            return
        self._reading = True
        self._store(
            field,
            lambda: self._read_now(
                lambda: self.session.read(step, place.declared, instrument, index=place.index, repeat=repeat)
            ),
            doing=f"reading {instrument.name}",
        )
        self._go_on(field)

    def _ask_to_measure(self, field: Field) -> None:
        """Measure the whole step; where a record is proposed already, only when asked twice: it takes minutes."""
        proposed = [f.proposed.name for f in self.query(Field) if f.proposed is not None]
        if proposed and self._rereading is not field:
            self._rereading = field
            self.say(f"Enter: take {proposed[0]}. F3 again: measure at the rig, some minutes; Esc stops it", "doubt")
        else:
            self._measure()

    def _measure(self) -> None:
        """Measure the whole step by its recipe: the bench is set up as it asks, Escape stops it."""
        step, instruments = self.step.name, self.bench.instruments
        instrument = instruments.recording(step)
        dialogue = CaptureDialogue(self, f"Measure: {self.step.guide.words}")
        actions = instruments.staged or Person(dialogue.ask)
        self._reading, self.stop = True, dialogue.stop

        def measure() -> CaptureResult:
            try:
                return capture(self.session, step, instrument, actions, dialogue.say, stopped=dialogue.stopped)
            finally:
                self._reading, self.stop = False, None

        def measured(captured: CaptureResult) -> None:
            dialogue.ended()
            self._measured(captured)

        doing = f"measuring with {instrument.name}, some minutes; Esc: stop"
        self.send(measure, measured, doing, lambda _: dialogue.ended())

    def _measured(self, captured: CaptureResult) -> None:
        notes = f". {'; '.join(captured.notes)}" if captured.notes else ""
        self.say(f"Saved{notes}", "saved")
        self.show()
        self._go_on(None)
        if self.complete:
            self.judge()

    def _read_now(self, read: Callable[[], Event]) -> Event:
        """Read in a thread: another reading may be asked for when this one has ended, well or not."""
        try:
            return read()
        finally:
            self._reading = False

    def action_measure_again(self) -> None:
        if not self.state.entries:
            self.say("Nothing to repeat: this step has no entries", "bad")
            return
        words = "The record keeps the earlier entries."
        question = Question("Measure this step again", words, [QuestionLine("Reason")], required("Type the reason"))
        self.app.push_screen(question, self._anew)

    def _anew(self, answer: list[str] | None) -> None:
        if answer is not None:
            self.send(lambda: self.session.remeasure(self.step.name, answer[0]), self._changed, "storing")

    def action_put_right(self) -> None:
        ask_remedy(self, self.bench, self.session, self._mended)

    def _mended(self, step: str) -> None:
        """Begin this step anew with the new records, or leave it for the one that they belong to."""
        if step == self.step.name:
            self.call_later(self._begin_anew)
        else:
            self.leave(False)

    async def _begin_anew(self) -> None:
        await self._look_for_records()
        await self._lay_out()
        self.show()
        self.say(f"New records are there. {self.what_now}", "saved")

    def action_undo(self) -> None:
        """Undo the last entry of this step only: the technician would not see what goes elsewhere."""
        self.send(partial(self.session.undo, self.step.name), self._changed, "undoing")

    def _changed(self, event: Event) -> None:
        if event.what == EntryUndone.KIND:
            self.say(f"Undone: {self.session.words_of(event)}; the record keeps both", "saved")
        else:
            self.say(f"Saved ({event.seq}); the record keeps the earlier entries", "saved")
        self.show()
        self._go_on(None)
        if self.complete:
            self.judge()

    @property
    def active_bindings(self) -> dict[str, ActiveBinding]:
        """Return the bindings, with those that do nothing at the present field out of the row of keys."""
        idle = self._idle() if self.is_mounted and self.query(Field) else set()
        return {
            key: active._replace(binding=replace(active.binding, show=False))
            if active.node is self and active.binding.action in idle
            else active
            for key, active in super().active_bindings.items()
        }

    def _idle(self) -> set[str]:
        """Return the actions that only say why they do nothing at present."""
        field, form = self._focused_field(), self._form
        is_value = field is not None and not field.place.is_file
        reads = field is not None and self._instrument(field.place) is not None
        does = {
            "pick": has_files(form),
            "read": reads or (not is_value and field is not None and self._is_measured),
            "repeat": is_value and (reads or (field is not None and self._has(field.place))),
            # behind F1 if there is no room for it
            "measure_again": bool(self.state.entries) and not (is_value and self.app.size.width < WIDE_FROM),
            "undo": bool(self.session.attempt.undoable),
        }
        return {action for action, active in does.items() if not active}

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave keys without a meaning at this step out of the footer."""
        if not self.is_mounted:
            return True
        match action:
            case "put_right":
                return self.bench.training is not None
            case "way":
                return len(self.step.check.forms) > 1
            case _:
                return super().check_action(action, parameters)

    def more_help(self) -> list[str]:
        return [
            "Numbers may carry a unit and an uncertainty: 4.99 uF, 4,99, 4.99 ± 0.02 uF. F3 reads the instrument; at a "
            "record it measures the whole step. F4 takes one more reading of the same value: the mean counts, the "
            "scatter is shown. If the decimal point or the unit looks mistyped, the program asks; F9 keeps the value.\n"
        ]


def _sentence(words: str) -> str:
    """Return words with a capital letter in front; names within keep theirs."""
    return words[:1].upper() + words[1:]
