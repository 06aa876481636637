"""The form of one step: its fields, where the cursor stands, what the instrument of the present field shows."""

import asyncio

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, Static

from accept.tui.screens.step_view import StepView
from accept.tui.widgets.fields import Field, FieldPlace, places
from accept.tui.widgets.live_value import Gauge
from accept.tui.widgets.text_entry import typed
from accept.workflow.bench import Workbench
from accept.workflow.instruments.port import InstrumentPort
from accept.workflow.record_folder import Proposals, age_words
from accept.workflow.session import Session
from accept.workflow.steps.plan import has_files, is_needed
from accept.workflow.steps.section import repeated
from checks.declare import Form, Measured
from specs.errors import AcceptError

LOOK_EVERY_S = 1.0  # into the folder of the records
LOOK_AT_MOST_S = 0.7  # before the form is shown


class StepForm(StepView):
    """Lays out the fields and moves the cursor, always at once, so that every key has its field."""

    def __init__(self, bench: Workbench, session: Session, name: str) -> None:
        super().__init__(bench, session, name)
        self._form = self.step.form(session.state(name).form)
        self._reading = False
        self._rereading: Field | None = None  # F3 was pressed once on what is saved already
        self._last: Field | None = None  # given last: where all is given, the arrows go on from it
        self._proposals: Proposals = {}  # of the present form

    def parts(self) -> ComposeResult:
        yield from super().parts()  # the result stands on top: it is seen without scrolling
        yield Label("", id="way", markup=False)
        with Horizontal(id="upper"):
            with Vertical(id="form"):
                yield Gauge()  # above the fields: it stays in sight where they are more than the screen has rows
                yield Vertical(id="fields")
            if self.step.guide.picture:
                yield Static(self.step.guide.picture, id="guide", markup=False)

    async def on_mount(self) -> None:
        await self._look_for_records()
        await self._lay_out()
        self.show()
        self.say(self.complete_words if self.complete else self._first_words())
        if self.complete:
            self.judge()
        self.set_interval(LOOK_EVERY_S, self._look_again)

    async def _look_for_records(self) -> None:
        """Look for records that fit before the form is laid out: without any entry it opens with the input for which
        something is there. A folder that answers slowly is waited for no longer than a person notices."""
        forms = [self._form] if self.state.entries else [self._form, *self.step.check.forms]
        readable = any(not p.is_file and self._instrument(p) is not None for p in places(self._form))
        for form in forms[:1] if readable else forms:
            try:
                found = await asyncio.wait_for(asyncio.to_thread(self._proposed_for, form), LOOK_AT_MOST_S)
            except TimeoutError:
                return
            if found:
                self._form, self._proposals = form, found
                return

    def _proposed_for(self, form: Form) -> Proposals:
        try:
            return self.session.proposals(self.step, form, self.bench.records)
        except (AcceptError, OSError):  # the list behind F2 says why
            return {}

    def _look_again(self) -> None:
        """Look into the folder once more: a record that has just been written is proposed by itself."""
        form = self._form
        if self.is_current and has_files(form):
            self.aside(lambda: (form, self._proposed_for(form)), self._looked, "records")

    def _looked(self, seen: tuple[Form, Proposals]) -> None:
        form, found = seen
        if form is not self._form or found == self._proposals:
            return
        self._proposals = found
        here = self._focused_field()
        for field in self.query(Field):
            before = field.proposed
            self._propose(field)
            if field.proposed in (None, before) or field.proposed is None:
                continue
            self.say(f"{field.proposed.name}, {age_words(field.proposed.mtime)}: {field.place.name}? Enter: take it")
            if here is None or not (here.input.value or here.proposed):
                here = field
                self.set_focus(field.input)

    def _propose(self, field: Field) -> None:
        free = field.place.is_file and not field.pending and not self._has(field.place)
        field.propose(self._proposals.get(field.place.declared.name) if free else None)

    def _first_words(self) -> str:
        return "Enter: take the record proposed, F2: another file" if self._proposals else "Enter: save the field"

    async def _lay_out(self) -> None:
        """Lay out the form's fields; the cursor goes into the first that is empty."""
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
        for field in self.query(Field):
            self._propose(field)
        self._go_on(None)

    def _go_on(self, after: Field | None) -> None:
        """Move the cursor to the next field without a saved or pending value, behind `after` if given, then to one
        that is needed or for which a record is proposed. It moves at once, so that no key comes between, and leaves
        the fields if every value is there, so that none is overwritten unseen."""
        self._rereading, self._last = None, after
        fields = list(self.query(Field))
        empty = [f for f in fields if not (f.pending or self._has(f.place))]
        behind = empty if after not in fields else [f for f in empty if fields.index(f) > fields.index(after)]
        wanted = [f for f in empty if is_needed(f.place.declared) or f.proposed is not None]
        chosen = next(iter([*(behind or wanted), None]))
        self.set_focus(None if chosen is None else chosen.input)
        if chosen is not None and chosen is after:
            chosen.input.select_all()

    def _has(self, place: FieldPlace) -> bool:
        if place.is_file:
            return self.state.link(place.declared.name) is not None
        return bool(self.state.readings(place.declared.name, place.index))

    def lacking(self) -> str:
        return ""  # the fields themselves show it

    def show(self) -> None:
        """Show everything from the state of the session."""
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
        """Show the instrument of the present line at the gauge, or what is stored there."""
        field = self._focused_field()
        for gauge in self.query(Gauge):
            if field is None or field.place.is_file:
                gauge.follow(None, "", None, None)
            else:
                place = field.place
                limit = self.step.asked.limits.get(place.declared.name)
                stored = None if self.complete else self._stored_value(place)  # its finding shows it then
                gauge.follow(
                    self._instrument(place), place.unit, limit, stored, self.session.usual.get(place.declared.name)
                )

    def _stored_value(self, place: FieldPlace) -> Measured | None:
        name = place.declared.name
        one = repeated(self.state.readings(name, place.index), self.step.asked, name)
        return None if one is None else Measured(one.value, one.U)

    async def action_line(self, way: int) -> None:
        """Move to the line above or below."""
        fields = [field.input for field in self.query(Field)]
        await typed(*fields)
        self._rereading = None
        if self.focused in fields:
            now = fields.index(self.focused)
        else:  # between the field that was given last and the next
            given = [n for n, field in enumerate(self.query(Field)) if field is self._last]
            now = (given[0] if given else -1) + (way < 0)
        if fields:
            self.set_focus(fields[(now + way) % len(fields)])

    async def _typed_field(self) -> Field | None:
        """Return the field that the cursor is in, when every key before this one has arrived there."""
        await typed(*(field.input for field in self.query(Field)))
        return self._focused_field()

    def _focused_field(self) -> Field | None:
        return field_of(self.focused) if isinstance(self.focused, Input) else None

    def _instrument(self, place: FieldPlace) -> InstrumentPort | None:
        return self.bench.instruments.serving(self.step.name, place.declared.name, place.index)

    async def action_way(self) -> None:
        """Change to the next way of giving this step its data. What was given another way stays until something new is
        given."""
        forms = self.step.check.forms
        self._form, self._proposals = forms[(forms.index(self._form) + 1) % len(forms)], {}
        if has_files(self._form):
            self._proposals = await asyncio.to_thread(self._proposed_for, self._form)
        await self._lay_out()
        self.show()


def field_of(line: Input) -> Field | None:
    """Return the field of a line, None when the form was changed since the key was pressed."""
    return next((a for a in line.ancestors if isinstance(a, Field)), None)
