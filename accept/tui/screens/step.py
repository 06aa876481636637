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
from accept.workflow.bench import Workbench
from accept.workflow.entry.parse_entry import EntryError, parse_list, parse_number, parse_scalar
from accept.workflow.instruments.port import InstrumentPort
from accept.workflow.session import Session
from accept.workflow.steps.plan import has_files
from accept.workflow.steps.section import repeated
from checks.declare import CsvTable, Measured, Scalar, Series, Vector


class StepScreen(StepView):
    """Values and files of one step, stored one by one; judged as soon as nothing is missing."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f2", "pick", "File"),
        Binding("f3", "read", "Read"),
        Binding("f4", "repeat", "Repeat"),
        Binding("f5", "note", "Note"),
        Binding("f6", "way", "Input"),
        Binding("f7", "picture", "Plot"),
        Binding("f8", "measure_again", "Again"),
        Binding("ctrl+z", "undo", "Undo"),
        # before the page gets them: it would scroll where the form is longer than the screen
        Binding("up", "app.focus_previous", show=False, priority=True),
        Binding("down", "app.focus_next", show=False, priority=True),
        Binding("escape", "leave", "Back"),
    ]

    def __init__(self, bench: Workbench, session: Session, name: str) -> None:
        super().__init__(bench, session, name)
        self._form = self.step.form(session.state(name).form)

    def parts(self) -> ComposeResult:
        with Horizontal(id="upper"):
            with Vertical(id="form"):
                yield Label("", id="way", markup=False)
                yield Vertical(id="fields")
                yield Gauge()
            if self.step.guide.picture:
                yield Static(self.step.guide.picture, id="guide", markup=False)
        yield from super().parts()

    async def on_mount(self) -> None:
        await self._lay_out()
        self.show()
        self.say("Enter: save the field")
        if self.complete:
            self.judge()

    async def _lay_out(self) -> None:
        """The form's fields; the cursor in the first that is empty."""
        if not self.alive:
            return
        forms = self.step.check.forms
        others = ", ".join(f.name for f in forms if f is not self._form)
        self.query_one("#way", Label).update(f"input: {self._form.name}   (F6: {others})" if others else "")
        self.query_one("#way").display = bool(others)
        self.query_one("#upper").set_class(has_files(self._form), "files")
        fields = self.query_one("#fields")
        await fields.remove_children()
        if not self.alive:  # left while the old fields went
            return
        await fields.mount(*(Field(place, self.step, self.state) for place in places(self._form)))
        self._to_next_empty(None)

    def _to_next_empty(self, after: Field | None) -> None:
        """Focus the first field with nothing stored, behind `after` where there is one."""
        fields = list(self.query(Field))
        start = fields.index(after) + 1 if after in fields else 0
        empty = [f for f in fields[start:] + fields[:start] if not self._has(f.place)]
        for line in [line for first in (empty or fields)[:1] for line in first.query(Input)]:
            self.set_focus(line)  # at once: `focus()` comes after keys that were typed meanwhile, which would be lost

    def _has(self, place: Place) -> bool:
        if place.is_file:
            return self.state.link(place.declared.name) is not None
        return bool(self.state.readings(place.declared.name, place.index))

    def show(self) -> None:
        """Everything from the state of the session."""
        super().show()
        if self.alive:
            self.query_one("#upper").set_class(self.complete, "complete")
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

    def on_input_submitted(self, event: Input.Submitted) -> None:
        field = field_of(event.input)
        if field is None:
            return
        if not event.value.strip():
            self._to_next_empty(field)
            if self.complete:
                self.say("Step complete. Esc: step list")
        else:
            self._give(field, event.value, repeat=False)

    def _give(self, field: Field, text: str, repeat: bool) -> None:
        """Store what was typed, or say beside the field why not."""
        place, step = field.place, self.step.name
        try:
            match place.declared:
                case Series() | CsvTable() as declared:
                    path = self.bench.records / Path(text.strip()).expanduser()  # an absolute one stays itself
                    self._store(field, partial(self.session.link, step, declared, path))
                case Scalar() as declared:
                    self._take(field, parse_scalar(text, declared), repeat, text)
                case Vector() as declared if len(text.replace(";", " ").split()) == declared.size:
                    self._take_all(parse_list(text, declared), text)
                case _:
                    self._take(field, parse_number(text, place.unit), repeat, text)
        except EntryError as e:
            field.refuse(str(e))
            self.app.bell()

    def _take(self, field: Field, measured: Measured, repeat: bool, text: str) -> None:
        place, step = field.place, self.step.name
        self._store(
            field,
            lambda: self.session.take(step, place.declared, measured, index=place.index, repeat=repeat, text=text),
        )

    def _take_all(self, values: list[float], text: str) -> None:
        for other, value in zip(self.query(Field), values, strict=True):
            self._take(other, Measured(value), False, text)

    def _store(self, field: Field, action: Callable[[], Event], doing: str = "storing") -> None:
        self.send(action, lambda event: self._stored(field, event), doing, field.refuse)

    def _stored(self, field: Field, event: Event) -> None:
        """It is on the disk: now it may be shown."""
        field.accept()
        self.say(f"Saved ({event.seq})", "good")
        self.show()
        if self._focused_field() in (field, None):
            self._to_next_empty(field)
        self._follow()
        if self.complete:
            self.judge()

    def _focused_field(self) -> Field | None:
        return field_of(self.focused) if isinstance(self.focused, Input) else None

    def action_pick(self) -> None:
        field = self._focused_field()
        if field is None or not field.place.is_file:
            field = next((f for f in self.query(Field) if f.place.is_file and not self._has(f.place)), None)
        if field is None:
            self.say("This step has no field for a file", "bad")
            return
        chosen = field
        self.app.push_screen(
            Pick(chosen.place.declared.label, self.bench.records),
            lambda path: self._give(chosen, str(path), repeat=False) if path else None,
        )

    def action_read(self) -> None:
        """Take the instrument's value into the line."""
        self._read(repeat=False)

    def action_repeat(self) -> None:
        """One more reading of the same value: what stands in the line, or what the instrument says."""
        field = self._focused_field()
        if field is not None and field.input.value.strip():
            self._give(field, field.input.value, repeat=True)
        else:
            self._read(repeat=True)

    def _read(self, repeat: bool) -> None:
        field = self._focused_field()
        instrument = self._instrument(field.place) if field is not None and not field.place.is_file else None
        if field is None or instrument is None:
            self.say("No instrument for this field; type the value", "bad")
            return
        place, step = field.place, self.step.name
        self._store(
            field,
            lambda: self.session.read(step, place.declared, instrument, index=place.index, repeat=repeat),
            f"reading {instrument.name}",
        )

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
        self.say(f"Saved ({event.seq}); the record keeps the earlier entries", "good")
        self.show()
        self._to_next_empty(None)
        if self.complete:
            self.judge()

    def check_action(self, action: str, _: tuple[object, ...]) -> bool | None:
        """Keys that mean nothing at this step are not in the footer."""
        if action == "way":
            return len(self.step.check.forms) > 1
        if action == "pick":
            return has_files(self._form)
        return True

    def more_help(self) -> list[str]:
        return [
            "Numbers may carry a unit and an uncertainty: 4.99 uF, 4,99, 4.99 ± 0.02 uF. F3 reads the instrument, F4 "
            "takes one more reading of the same value: the mean counts, the scatter is shown.\n"
        ]


def field_of(line: Input) -> Field | None:
    """The field of a line, None when the form was changed since the key was pressed."""
    return next((a for a in line.ancestors if isinstance(a, Field)), None)
