"""One step: what to do, where it goes, what it showed."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, Static

from accept.store import Event
from accept.tui.screens.ask import Question, QuestionLine
from accept.tui.screens.record_picker import Pick
from accept.tui.screens.step_view import StepView
from accept.tui.widgets.fields import Field, Place, places
from accept.tui.widgets.live_value import Gauge
from accept.tui.widgets.text_entry import typed
from accept.workflow.bench import Workbench
from accept.workflow.entry.parse_entry import EntryError, doubt, parse_list, parse_number, parse_scalar, usual_range
from accept.workflow.instruments.port import InstrumentPort
from accept.workflow.session import Session
from accept.workflow.steps.plan import has_files
from accept.workflow.steps.section import repeated
from checks.declare import CsvTable, Measured, Scalar, Series, Vector


class StepScreen(StepView):
    """Values and files of one step, stored one by one; judged as soon as nothing is missing."""

    # All before the line itself gets them: so keys act in the order in which they were pressed, however fast they come.
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "enter", show=False, priority=True),
        Binding("f2", "pick", "File", priority=True),
        Binding("f3", "read", "Read", priority=True),
        Binding("f4", "repeat", "Repeat", priority=True),
        Binding("f5", "note", "Note", priority=True),
        Binding("f6", "way", "Input", priority=True),
        Binding("f7", "picture", "Plots", priority=True),
        Binding("f8", "measure_again", "Again", priority=True),
        Binding("f9", "keep", "Keep", priority=True),
        Binding("ctrl+z", "undo", "Undo", priority=True),
        Binding("up", "line(-1)", show=False, priority=True),
        Binding("down", "line(1)", show=False, priority=True),
        Binding("escape", "leave", "Back", priority=True),
    ]

    def __init__(self, bench: Workbench, session: Session, name: str) -> None:
        super().__init__(bench, session, name)
        self._form = self.step.form(session.state(name).form)
        self._reading = False
        self._rereading: Field | None = None  # F3 was pressed once on what is saved already

    def parts(self) -> ComposeResult:
        yield from super().parts()  # what came out stands on top, so that nobody has to scroll for it
        yield Label("", id="way", markup=False)
        with Horizontal(id="upper"):
            with Vertical(id="form"):
                yield Gauge()  # above the fields: it stays in sight where they are more than the screen has rows
                yield Vertical(id="fields")
            if self.step.guide.picture:
                yield Static(self.step.guide.picture, id="guide", markup=False)

    async def on_mount(self) -> None:
        await self._lay_out()
        self.show()
        self.say("Step complete. Esc: step list" if self.complete else "Enter: save the field")
        if self.complete:
            self.judge()

    async def _lay_out(self) -> None:
        """The form's fields; the cursor in the first that is empty."""
        if not self.alive:
            return
        forms = self.step.check.forms
        others = ", ".join(f.name for f in forms if f is not self._form)
        self.query_one("#way", Label).update(f"Input: {self._form.name}   (F6: {others})" if others else "")
        self.query_one("#way").display = bool(others)
        self.query_one("#upper").set_class(has_files(self._form) or len(list(places(self._form))) < 4, "files")
        fields = self.query_one("#fields")
        await fields.remove_children()
        if not self.alive:  # left while the old fields went
            return
        await fields.mount(*(Field(place, self.step, self.state) for place in places(self._form)))
        self._go_on(None)

    def _go_on(self, after: Field | None) -> None:
        """The cursor to the next field that nothing is saved for or under way to, behind `after` where there is one. At
        once, so that no key comes between; and nowhere when all is there, so that nothing is overwritten unseen."""
        self._rereading = None
        fields = list(self.query(Field))
        start = fields.index(after) + 1 if after in fields else 0
        empty = [f for f in fields[start:] + fields[:start] if not (f.pending or self._has(f.place))]
        self.set_focus(empty[0].input if empty else None)
        if empty and empty[0] is after:
            empty[0].input.select_all()

    def _has(self, place: Place) -> bool:
        if place.is_file:
            return self.state.link(place.declared.name) is not None
        return bool(self.state.readings(place.declared.name, place.index))

    def lacking(self) -> str:
        return ""  # the fields themselves show it

    def show(self) -> None:
        """Everything from the state of the session."""
        super().show()
        for field in self.query(Field):
            field.show(self.state)

    def on_descendant_focus(self) -> None:
        self._follow()

    def on_screen_resume(self) -> None:
        self._follow()

    def on_screen_suspend(self) -> None:
        for gauge in self.query(Gauge):
            gauge.leave()

    def _follow(self) -> None:
        """The gauge shows the instrument of the present line, or what is stored there."""
        field = self._focused_field()
        for gauge in self.query(Gauge):
            if field is None or field.place.is_file:
                gauge.follow(None, "", None, None)
            else:
                place = field.place
                limit = self.step.asked.limits.get(place.declared.name)
                stored = None if self.complete else self._stored_value(place)  # its finding shows it then
                gauge.follow(self._instrument(place), place.unit, limit, stored)

    def _stored_value(self, place: Place) -> Measured | None:
        name = place.declared.name
        one = repeated(self.state.readings(name, place.index), self.step.asked, name)
        return None if one is None else Measured(one.value, one.U)

    async def action_line(self, way: int) -> None:
        """To the line above or below."""
        fields = [field.input for field in self.query(Field)]
        await typed(*fields)
        self._rereading = None
        now = fields.index(self.focused) if self.focused in fields else (-1 if way > 0 else 0)
        if fields:
            self.set_focus(fields[(now + way) % len(fields)])

    async def action_enter(self) -> None:
        """Save what stands in the line, and go on at once: the next key belongs to the next line."""
        field = await self._typed_field()
        if field is None:
            self.say("Step complete. ↑ ↓: choose a field to correct. Esc: step list")
            self.app.bell()
        elif not field.input.value.strip():
            self._go_on(field)
        else:
            self._give(field, field.input.value, repeat=False)

    async def _typed_field(self) -> Field | None:
        """The field that the cursor is in, when every key before this one has arrived there."""
        await typed(*(field.input for field in self.query(Field)))
        return self._focused_field()

    def _give(self, field: Field, text: str, repeat: bool, sure: bool = False) -> None:
        """Send what was typed to the store, or say beside the field why not. sure: it was asked about already."""
        place, step = field.place, self.step.name
        try:
            match place.declared:
                case Series() | CsvTable() as declared:
                    path = self.bench.records / Path(text.strip()).expanduser()  # an absolute one stays itself
                    self._store(field, partial(self.session.link, step, declared, path), text)
                case Vector() as declared if len(text.replace(";", " ").split()) == declared.size:
                    self._take_all(parse_list(text, declared), text, sure)
                case Scalar() as declared:
                    self._take(field, parse_scalar(text, declared), repeat, text, sure)
                case _:
                    self._take(field, parse_number(text, place.unit), repeat, text, sure)
        except EntryError as e:
            field.refuse(text, str(e))
            self.say(f"{field.place.name}: {e}", "bad")
            self.app.bell()
        self._go_on(field)

    def _take(self, field: Field, measured: Measured, repeat: bool, text: str, sure: bool) -> None:
        place, step = field.place, self.step.name
        if not sure and (question := self._doubt(place, measured.value)):
            field.ask(text, question)
            self.say(f"{place.name}: {question}. F9: keep it, ↑: correct it", "doubt")
            self.app.bell()
            return
        self._store(
            field,
            lambda: self.session.take(step, place.declared, measured, index=place.index, repeat=repeat, text=text),
            text,
        )

    def _doubt(self, place: Place, value: float) -> str:
        declared = place.declared
        if not isinstance(declared, Scalar | Vector):
            return ""
        return doubt(value, place.unit, usual_range(declared, self.step.asked.limits))

    def _take_all(self, values: list[float], text: str, sure: bool) -> None:
        fields = list(self.query(Field))
        unusual = next((q for f, v in zip(fields, values, strict=True) if (q := self._doubt(f.place, v))), "")
        if unusual and not sure:
            fields[0].ask(text, unusual)
            self.say(f"{unusual}. F9: keep all", "doubt")
            return
        for field, value in zip(fields, values, strict=True):
            self._take(field, Measured(value), False, f"{value:.9g} {field.place.unit}", True)

    async def action_keep(self) -> None:
        """What was asked about is meant as it was typed."""
        here = await self._typed_field()
        asked = [field for field in self.query(Field) if field.doubted]
        field = here if here in asked else next(iter(asked), None)
        if field is None or field.doubted is None:
            return
        text, line = field.doubted, field.input
        if line.value != text:  # it was typed again meanwhile: that is another entry
            self.say("The entry was changed. Enter: save it", "bad")
            return
        self._give(field, text, repeat=False, sure=True)

    def _store(self, field: Field, action: Callable[[], Event], text: str = "", doing: str = "saving") -> None:
        field.send()
        self.send(action, lambda event: self._stored(field, event), doing, lambda why: self._lost(field, text, why))

    def _stored(self, field: Field, event: Event) -> None:
        """It is on the disk: now it may be shown."""
        field.arrived()
        self.say(f"Saved ({event.seq})", "saved")
        self.show()
        self._follow()
        if self.complete:
            self.judge()

    def _lost(self, field: Field, text: str, why: str) -> None:
        """It is not on the disk: what was typed comes back; the cursor only where it stands nowhere."""
        field.arrived()
        field.refuse(text, why)
        if self.focused is None:
            self._go_on(None)

    def _focused_field(self) -> Field | None:
        return field_of(self.focused) if isinstance(self.focused, Input) else None

    async def action_pick(self) -> None:
        field = await self._typed_field()
        if field is None or not field.place.is_file:
            field = next((f for f in self.query(Field) if f.place.is_file and not self._has(f.place)), None)
        if field is None:
            self.say("No empty field for a file. ↑ ↓: choose the field to replace", "bad")
            return
        chosen = field
        await self.app.push_screen(
            Pick(chosen.place.name, self.bench.records),
            lambda path: self._give(chosen, str(path), repeat=False) if path else None,
        )

    async def action_read(self) -> None:
        """Take the instrument's value into the line; what is saved there already is replaced only when asked twice."""
        field = await self._typed_field()
        if field is None:
            self.say("Step complete. ↑ ↓: choose a field to read again")
        elif self._reading:
            self.say("A reading is under way", "bad")
        elif self._has(field.place) and self._rereading is not field:
            self._rereading = field
            self.say(f"{field.place.name} is saved. F3 again: replace it. F4: one more reading of it", "doubt")
        else:
            self._read(field, repeat=False)

    async def action_repeat(self) -> None:
        """One more reading of the same value: what stands in the line, or what the instrument says."""
        field = await self._typed_field()
        if field is not None and field.input.value.strip():
            self._give(field, field.input.value, repeat=True)
        elif self._reading:
            self.say("A reading is under way", "bad")
        elif field is not None:
            self._read(field, repeat=True)

    def _read(self, field: Field, repeat: bool) -> None:
        place, step = field.place, self.step.name
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

    def _read_now(self, read: Callable[[], Event]) -> Event:
        """In a thread: another reading may be asked for when this one has ended, well or not."""
        try:
            return read()
        finally:
            self._reading = False

    def _instrument(self, place: Place) -> InstrumentPort | None:
        return self.bench.instruments.serving(self.step.name, place.declared.name, place.index)

    async def action_way(self) -> None:
        """The next way of giving this step its data. What was given another way stays until something new is given."""
        forms = self.step.check.forms
        self._form = forms[(forms.index(self._form) + 1) % len(forms)]
        await self._lay_out()
        self.show()

    def action_measure_again(self) -> None:
        if not self.state.entries:
            self.say("Nothing to repeat: this step has no entries", "bad")
            return
        question = Question(
            "Measure this step again", "The record keeps the earlier entries.", [QuestionLine("Reason")]
        )
        self.app.push_screen(question, self._anew)

    def _anew(self, answer: list[str] | None) -> None:
        if answer is not None:
            self.send(lambda: self.session.remeasure(self.step.name, answer[0]), self._changed, "storing")

    def action_undo(self) -> None:
        """Only what was entered at this step: elsewhere the technician would not see what goes."""
        last = self.session.last_entry()
        if last is None or last.data.get("step") != self.step.name:
            self.say("The last entry belongs to another step; undo it in the step list", "bad")
            return
        self.send(self.session.undo, self._changed, "undoing")

    def _changed(self, event: Event) -> None:
        self.say(f"Saved ({event.seq}); the record keeps the earlier entries", "saved")
        self.show()
        self._go_on(None)
        if self.complete:
            self.judge()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Keys that mean nothing at this step are not in the footer."""
        if not self.is_mounted:
            return True
        match action:
            case "way":
                return len(self.step.check.forms) > 1
            case "pick":
                return has_files(self._form)
            case "read":
                return any(not p.is_file and self._instrument(p) is not None for p in places(self._form))
            case "repeat":
                return any(not p.is_file for p in places(self._form))
            case "measure_again":
                return bool(self.state.entries)
            case "undo":
                return bool(self.session.attempt.undoable)
            case "keep":
                return any(field.doubted for field in self.query(Field))
            case _:
                return super().check_action(action, parameters)

    def more_help(self) -> list[str]:
        return [
            "Numbers may carry a unit and an uncertainty: 4.99 uF, 4,99, 4.99 ± 0.02 uF. F3 reads the instrument, F4 "
            "takes one more reading of the same value: the mean counts, the scatter is shown. A value that may be a "
            "slip of the point or of the unit is asked about: F9 keeps it.\n"
        ]


def field_of(line: Input) -> Field | None:
    """The field of a line, None when the form was changed since the key was pressed."""
    return next((a for a in line.ancestors if isinstance(a, Field)), None)
