"""One step: what to do, where it goes, what it showed."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import Footer, Input, Label, Static

from accept.store import Event
from accept.tui.ask import Ask, Line
from accept.tui.fields import Field, Place, places
from accept.tui.findings import COLOURS, Findings, missing_words
from accept.tui.notes import ask_note
from accept.tui.pick import Pick
from accept.tui.plot import PanelView
from accept.tui.strip import limits
from accept.tui.working import Working
from accept.workflow.bench import Bench
from accept.workflow.instruments import Instrument, reading
from accept.workflow.judgement import StepJudgement
from accept.workflow.section import missing, ready
from accept.workflow.session import Session
from accept.workflow.state import StepState
from accept.workflow.steps import has_files
from accept.workflow.typed import EntryError, parse_list, parse_number, parse_scalar
from checks.declare import Measured, Scalar, Series, Table, Vector
from specs import Limit


class StepScreen(Working[bool]):
    """Values and files of one step, stored one by one; judged as soon as nothing is missing."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f2", "pick", "File"),
        Binding("f3", "read", "Read"),
        Binding("f4", "repeat", "More"),
        Binding("f5", "note", "Note"),
        Binding("f6", "way", "Way"),
        Binding("f7", "picture", "Plot"),
        Binding("f8", "anew", "Anew"),
        Binding("ctrl+z", "undo", "Undo"),
        Binding("up", "app.focus_previous", show=False),
        Binding("down", "app.focus_next", show=False),
        Binding("pageup", "page(-1)", show=False),
        Binding("pagedown", "page(1)", show=False),
        Binding("escape", "leave", "Back"),
    ]

    def __init__(self, bench: Bench, session: Session, name: str) -> None:
        super().__init__()
        self.bench, self.session = bench, session
        self.step = session.step(name)
        self._form = self.step.form(session.state(name).form)
        self._panel = 0
        self._live = ""

    def compose(self) -> ComposeResult:
        yield Label("", id="head", classes="title", markup=False)
        yield Static(self.step.guide.words, id="words", markup=False)
        with VerticalScroll(id="body", can_focus=False):
            with Horizontal(id="upper"):
                with Vertical(id="form"):
                    yield Label("", id="way", markup=False)
                    yield Vertical(id="fields")
                if self.step.guide.picture:
                    yield Static(self.step.guide.picture, id="guide", markup=False)
            yield Findings(id="findings")
            yield Vertical(id="pictures")
        yield Label("", id="status")
        yield Footer(compact=True)

    async def on_mount(self) -> None:
        await self._lay_out()
        self._show()
        self.say("Enter stores the line")
        if ready(self.step, self._state):
            self._judge()

    @property
    def _state(self) -> StepState:
        return self.session.state(self.step.name)

    async def _lay_out(self) -> None:
        """The form's fields; the cursor in the first that is empty."""
        if not self.alive:
            return
        forms = self.step.check.forms
        others = ", ".join(f.name for f in forms if f is not self._form)
        self.query_one("#way", Label).update(f"giving: {self._form.name}   (F6: {others})" if others else "")
        self.query_one("#way").display = bool(others)
        self.query_one("#upper").set_class(has_files(self._form), "files")
        fields = self.query_one("#fields")
        await fields.remove_children()
        if not self.alive:  # left while the old fields went
            return
        await fields.mount(*(Field(place, self.step, self._state) for place in places(self._form)))
        self._to_next_empty(None)

    def _to_next_empty(self, after: Field | None) -> None:
        """Focus the first field with nothing stored, behind `after` where there is one."""
        fields = list(self.query(Field))
        start = fields.index(after) + 1 if after in fields else 0
        empty = [f for f in fields[start:] + fields[:start] if not self._has(f.place)]
        for first in (empty or fields)[:1]:
            first.query(Input).focus()

    def _has(self, place: Place) -> bool:
        if place.is_file:
            return self._state.link(place.declared.name) is not None
        return bool(self._state.readings(place.declared.name, place.index))

    def _show(self) -> None:
        """Everything from the state of the session."""
        if not self.alive:
            return
        number = 1 + [s.name for s in self.session.steps].index(self.step.name)
        status = self.session.status(self.step)
        head = self.query_one("#head", Label)
        head.update(
            f"{number}/{len(self.session.steps)} {self.step.title}  ·  {self.session.serial}"
            f"  ·  {status.mark} {status.word}"
        )
        head.styles.color = {"bold red": "red", "dim": "white"}.get(COLOURS[status], COLOURS[status])
        self.query_one("#upper").set_class(ready(self.step, self._state), "complete")
        for field in self.query(Field):
            field.show(self._state)
        judgement = self.session.judgement(self.step.name) if ready(self.step, self._state) else None
        wanted = missing_words([i.label for i in missing(self.step, self._state)]) if self._state.entries else ""
        self.query_one(Findings).show(judgement, wanted)
        self._show_picture()

    def _show_picture(self) -> None:
        """As many pictures as the screen is wide for, from the chosen one on."""
        panels = list(self.session.panels(self.step.name).values())
        holder = self.query_one("#pictures")
        holder.remove_children()
        if panels:
            many = 2 if self.app.size.width >= 110 else 1
            shown = [panels[(self._panel + i) % len(panels)] for i in range(min(many, len(panels)))]
            first = self._panel % len(panels) + 1
            words = f"picture {first} of {len(panels)}, F7: next" if len(panels) > many else ""
            holder.mount(Label(words, classes="quiet"), Horizontal(*(PanelView(p) for p in shown), classes="panels"))

    def on_input_submitted(self, event: Input.Submitted) -> None:
        field = field_of(event.input)
        if field is None:
            return
        if not event.value.strip():
            self._to_next_empty(field)
            if ready(self.step, self._state):
                self.say("nothing is missing here: Esc goes back to the steps")
        else:
            self._give(field, event.value, repeat=False)

    def _give(self, field: Field, text: str, repeat: bool) -> None:
        """Store what was typed, or say beside the field why not."""
        place, step = field.place, self.step.name
        try:
            match place.declared:
                case Series() | Table() as declared:
                    path = self.bench.records / Path(text.strip()).expanduser()  # an absolute one stays itself
                    self._store(field, partial(self.session.link, step, declared, path))
                case Scalar() as declared:
                    self._take(field, parse_scalar(text, declared), repeat, text, "typed")
                case Vector() as declared if len(text.replace(";", " ").split()) == declared.size:
                    self._take_all(field, parse_list(text, declared), text)
                case _:
                    self._take(field, parse_number(text, place.unit), repeat, text, "typed")
        except EntryError as e:
            field.refuse(str(e))
            self.app.bell()

    def _take(self, field: Field, measured: Measured, repeat: bool, text: str, source: str) -> None:
        place, step = field.place, self.step.name
        self._store(
            field,
            lambda: self.session.take(
                step, place.declared, measured, index=place.index, repeat=repeat, text=text, source=source
            ),
        )

    def _take_all(self, field: Field, values: list[float], text: str) -> None:
        for other, value in zip(self.query(Field), values, strict=True):
            self._take(other, Measured(value), False, text, "typed")

    def _store(self, field: Field, action: Callable[[], Event]) -> None:
        self.send(action, lambda event: self._stored(field, event), "storing", field.refuse)

    def _stored(self, field: Field, event: Event) -> None:
        """It is on the disk: now it may be shown."""
        field.accept()
        self.say(f"stored as event {event.seq}", "good")
        self._show()
        if self._focused_field() in (field, None):
            self._to_next_empty(field)
        if ready(self.step, self._state):
            self._judge()

    def _judge(self) -> None:
        self.query_one(Findings).show(None, "judging … (Esc goes back, the entries are kept)")
        self.aside(lambda: self.session.judge_step(self.step.name), self._judged, "judge")

    def _judged(self, judgement: StepJudgement) -> None:
        self._show()

    def _focused_field(self) -> Field | None:
        return field_of(self.focused) if isinstance(self.focused, Input) else None

    def action_pick(self) -> None:
        field = self._focused_field()
        if field is None or not field.place.is_file:
            field = next((f for f in self.query(Field) if f.place.is_file and not self._has(f.place)), None)
        if field is None:
            self.say("no line of this step takes a file", "bad")
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
            self.say("no instrument reads this line: type the value", "bad")
            return
        place = field.place
        self.send(
            lambda: reading(instrument, place.unit),
            lambda measured: self._read_done(field, measured, repeat, instrument.name),
            f"reading {instrument.name}",
            field.refuse,
        )

    def _read_done(self, field: Field, measured: Measured, repeat: bool, source: str) -> None:
        self._take(field, measured, repeat, f"{measured.value:.9g} {field.place.unit}", source)

    def _instrument(self, place: Place) -> Instrument | None:
        return self.bench.instruments.serving(self.step.name, place.declared.name, place.index)

    def action_note(self) -> None:
        ask_note(self, self.session, self.step, self._noted)

    def _noted(self, event: Event) -> None:
        self.say(f"note kept as event {event.seq}", "good")

    async def action_way(self) -> None:
        """The next way of giving this step its data. What was given another way stays until something new is given."""
        forms = self.step.check.forms
        self._form = forms[(forms.index(self._form) + 1) % len(forms)]
        await self._lay_out()
        self._show()

    def action_picture(self) -> None:
        self._panel += 1
        self._show_picture()
        self.query_one("#body", VerticalScroll).scroll_end(animate=False)

    def action_anew(self) -> None:
        if not self._state.entries:
            self.say("nothing was taken yet", "bad")
            return
        question = Ask("Measure this step again", "What was taken stays in the record.", [Line("Why?")])
        self.app.push_screen(question, self._anew)

    def _anew(self, answer: list[str] | None) -> None:
        if answer is not None:
            self.send(lambda: self.session.remeasure(self.step.name, answer[0]), self._changed, "storing")

    def action_undo(self) -> None:
        """Only what was entered at this step: elsewhere the technician would not see what goes."""
        last = self.session.last_entry()
        if last is None or last.data.get("step") != self.step.name:
            self.say("the last entry was made at another step: undo it in the list of steps", "bad")
            return
        self.send(self.session.undo, self._changed, "undoing")

    def _changed(self, event: Event) -> None:
        self.say(f"stored as event {event.seq}; what was before stays in the record", "good")
        self._show()
        self._to_next_empty(None)
        if ready(self.step, self._state):
            self._judge()

    def action_page(self, way: int) -> None:
        body = self.query_one("#body", VerticalScroll)
        body.scroll_relative(y=way * max(1, body.size.height - 2), animate=False)

    def action_leave(self) -> None:
        self.leave(True)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Keys that mean nothing at this step are not in the footer."""
        if action == "way":
            return len(self.step.check.forms) > 1
        if action == "pick":
            return has_files(self._form)
        return True

    def help_text(self) -> str:
        asked = self.step.asked
        bounds = [f"  {name}: {limit_words(limit)}\n      {limit.source}" for name, limit in asked.limits.items()]
        measured_with = f"\nMeasured with: {asked.instrument}" if asked.instrument else ""
        typed = "Numbers may carry a unit and an uncertainty: 4.99 uF, 4,99, 4.99 ± 0.02 uF."
        told = f"{self.step.guide.words}\n{self.step.guide.picture}{measured_with}\n"
        return "\n".join([told, f"{typed}\n", "Limits", *bounds])


def field_of(line: Input) -> Field | None:
    """The field of a line, None when the form was changed since the key was pressed."""
    return next((a for a in line.ancestors if isinstance(a, Field)), None)


def limit_words(limit: Limit) -> str:
    ends = limits({"lower": limit.lower, "upper": limit.upper})
    return f"{ends} {limit.unit}, {limit.rule}"
