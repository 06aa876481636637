"""The form of one step: its fields, where the cursor stands, what the instrument of the present field shows."""

import asyncio

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, Static

from accept.judging.advice import ADVICE
from accept.tui.screens.step_view import StepView
from accept.tui.widgets.fields import Field, FieldPlace, places
from accept.tui.widgets.live_value import Gauge
from accept.workflow.bench import Workbench
from accept.workflow.instruments.port import InstrumentPort
from accept.workflow.record_folder import Proposals, age_words
from accept.workflow.session import Session
from accept.workflow.steps.plan import has_files, is_needed
from accept.workflow.steps.section import repeated
from checks.cause import Cause
from checks.declare import Form, Measured
from specs.errors import AcceptError

LOOK_EVERY_S = 1.0  # into the folder of the records
SAVES = ". Enter: save the field"
LOOK_AT_MOST_S = 0.7  # before the form is shown


class StepForm(StepView):
    """Lays out the fields and moves the cursor, always at once, so that every key has its field."""

    AUTO_FOCUS = ""  # where every value is there the cursor is in no field, after a question in front neither

    def __init__(self, bench: Workbench, session: Session, name: str) -> None:
        super().__init__(bench, session, name)
        self._form = self.step.form(session.state(name).form)
        self._reading = False
        self._early = False  # F3 was pressed while a reading was under way
        self._rereading: Field | None = None  # F3 was pressed once on what is saved already
        self._asked: Field | None = None  # whose value the foot asks about
        self._last: Field | None = None  # given last: where all is given, the arrows go on from it
        self._proposals: Proposals = {}  # of the present form
        self._chosen_form = False  # the technician chose the input
        self._hinting = False  # the line at the foot says what the present field wants

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
        self._hint()
        if self.complete:
            self.judge()
        self.set_interval(LOOK_EVERY_S, self._look_again)

    async def _look_for_records(self) -> None:
        """Look for records that fit before the form is laid out: without any entry it opens with the input for which
        something is there. A folder that answers slowly is waited for no longer than a person notices."""
        forms = [self._form] if self.state.entries else [self._form, *self.step.check.forms]
        for form in forms[:1] if self._is_readable else forms:
            try:
                found = await asyncio.wait_for(asyncio.to_thread(self._proposed_for, form), LOOK_AT_MOST_S)
            except TimeoutError:
                return
            if found:
                self._form, self._proposals = form, found
                return

    @property
    def _is_readable(self) -> bool:
        """Return whether an instrument reads a value of the present form."""
        return any(not p.is_file and self._instrument(p) is not None for p in places(self._form))

    def _proposed_for(self, form: Form) -> Proposals:
        try:
            return self.session.proposals(self.step, form, self.bench.records)
        except (AcceptError, OSError):  # the list behind F2 says why
            return {}

    def _look_again(self) -> None:
        """Look into the folder once more: a record that has just been written is proposed by itself, and for a form
        that was not begun the step changes to the input that it belongs to."""
        form = self._form
        if not self.is_current:
            return
        if has_files(form):
            self.aside(lambda: (form, self._proposed_for(form)), self._looked, "records")
        elif not (self._begun or self._chosen_form or self._is_readable):
            others = [each for each in self.step.check.forms if has_files(each)]
            self.aside(lambda: [(each, self._proposed_for(each)) for each in others], self._turn, "records")

    @property
    def _is_measured(self) -> bool:
        """Return whether the records of this step are measured from here."""
        return self.bench.instruments.recording(self.step.name) is not None

    @property
    def _begun(self) -> bool:
        """Return whether something was given, or typed without Enter."""
        typed = any(line.value for line in self.query("Field Input").results(Input))  # a field may not be drawn yet
        return typed or bool(self.state.entries) or any(field.pending for field in self.query(Field))

    def _turn(self, seen: list[tuple[Form, Proposals]]) -> None:
        self.call_later(self._turn_to, seen)

    async def _turn_to(self, seen: list[tuple[Form, Proposals]]) -> None:
        """Change to the first form for which there are records, unless something was typed meanwhile."""
        found = next(((form, proposals) for form, proposals in seen if proposals), None)
        if found is None or self._begun or self._chosen_form:
            return
        self._form, self._proposals = found
        await self._lay_out()
        self.show()
        self._hint()

    def _looked(self, seen: tuple[Form, Proposals]) -> None:
        form, found = seen
        if form is not self._form or found == self._proposals:
            return
        self._proposals = found
        here, before = self._focused_field(), {field: field.proposed for field in self.query(Field)}
        for field in before:
            self._propose(field)
        new = [field for field in before if field.proposed is not None and field.proposed != before[field]]
        if new and (here is None or not (here.input.value or here.proposed)):
            here = new[0]
            self.set_focus(here.input)
        if here in new and here is not None and here.proposed is not None:  # the foot names what Enter takes
            self.say(f"{here.proposed.name}, {age_words(here.proposed.mtime)}: {here.place.name}? Enter: take it")
        elif self._hinting or (here is not None and before[here] != here.proposed):
            self._hint()

    def _propose(self, field: Field) -> None:
        free = field.place.is_file and not field.pending and not self._has(field.place)
        field.propose(self._proposals.get(field.place.declared.name) if free else None)

    def _hint(self) -> None:
        """Say at the foot of the screen what the present field wants and which key gives it."""
        damaged = next((f for f in self.query(Field) if f.damaged), None)
        if damaged is not None and self._focused_field() in (None, damaged):
            self.say(f"{damaged.place.name}: {ADVICE[Cause.FILE_DAMAGED]}. F2: another file", "bad")
        else:
            self.say(self.what_now)
        self._hinting = True

    def say(self, words: str, role: str = "quiet") -> None:
        self._hinting = False
        super().say(words, role)

    @property
    def what_now(self) -> str:
        """Return what the field under the cursor wants, and which key gives it; without a cursor, how to go on."""
        field = self._focused_field()
        if field is None:
            return self.complete_words if self.complete else "↑ ↓: choose a field"
        place, instrument = field.place, self._instrument(field.place)
        optional = not is_needed(place.declared) and not place.among_optional
        if self._has(place):
            words = (
                f"{place.name} is saved. What is given now replaces it{', F4 repeats it' if not place.is_file else ''}"
            )
            return f"{self.put_right_first}. {words}" if self.put_right_first else words
        if self.put_right_first and self.dispensable(field):  # nothing that may be given here puts the step right
            again = "" if "F8" in self.put_right_first else "F8: measure again. "
            return f"{self.put_right_first}. {again}{self.enter_words}"
        if field.proposed is not None:
            words = f"Enter: take {field.proposed.name}, F2: another file"
        elif place.is_file:
            words = f"{'F3: measure, ' if self._is_measured else ''}F2: choose the file"
        elif instrument is not None:
            words = f"F3: take {instrument.offer}, or type it{SAVES}"
        else:
            words = f"Type the value{SAVES}"
        default = getattr(place.declared, "default", None)
        if field.proposed is None and (optional or (place.among_optional and self.complete)):
            without = "go on without it" if default is None else f"keep {default:g} {place.unit}"
            words = f"{words.replace(SAVES, '')}. Enter: {without}"
        words = f"Optional: {place.name}. {words}" if optional else words
        first = self.put_right_first if optional or place.among_optional else ""
        return f"{first}. {words}" if first else words

    def dispensable(self, field: Field) -> bool:
        """Return whether Enter may go past all that is still empty: the step was judged, and nothing that could be
        given here is missing for a result."""
        judgement = self.session.judgement(self.step.name) if self.complete else None
        if judgement is None or is_needed(field.place.declared) or any(f.proposed for f in self.query(Field)):
            return False
        causes = {r.cause for f in judgement.findings if f.cause is not None for r in f.cause.all()}
        return not causes & {Cause.NOT_MEASURED, Cause.ENTRY_MISSING}

    async def _lay_out(self) -> None:
        """Lay out the form's fields; the cursor goes into the first that is empty."""
        if not self.alive:
            return
        forms = self.step.check.forms
        others = ", ".join(f.name for f in forms if f is not self._form)
        self.query_one("#way", Label).update(f"Input: {self._form.name}   (F6: {others})" if others else "")
        self.query_one("#way").display = bool(others)
        self.query_one("#upper").set_class(has_files(self._form) or len(list(places(self._form))) < 4, "files")
        self.query_one("#main").set_class(has_files(self._form) and bool(self.step.guide.picture), "of-files")
        self.query_one("#drawing", Static).update(self.step.guide.picture)
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
        judgement = self.session.judgement(self.step.name) if self.complete else None
        for field in self.query(Field):
            field.show(self.state, judgement)

    def on_descendant_focus(self) -> None:
        self._follow()
        self.refresh_bindings()
        if self._hinting:
            self._hint()

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

    def action_line(self, way: int) -> None:
        """Move to the line above or below."""
        fields = [field.input for field in self.query(Field)]
        self._rereading = None
        if self.focused in fields:
            now = fields.index(self.focused)
        else:  # between the field that was given last and the next
            given = [n for n, field in enumerate(self.query(Field)) if field is self._last]
            now = (given[0] if given else -1) + (way < 0)
        if fields:
            self.set_focus(fields[(now + way) % len(fields)])
            if self._asked is None:
                self._hint()

    def _focused_field(self) -> Field | None:
        return field_of(self.focused) if isinstance(self.focused, Input) else None

    def _instrument(self, place: FieldPlace) -> InstrumentPort | None:
        return self.bench.instruments.serving(self.step.name, place.declared.name, place.index)

    async def action_way(self) -> None:
        """Change to the next way of giving this step its data. What was given another way stays until something new is
        given."""
        forms = self.step.check.forms
        self._chosen_form = True
        self._form, self._proposals = forms[(forms.index(self._form) + 1) % len(forms)], {}
        if has_files(self._form):
            self._proposals = await asyncio.to_thread(self._proposed_for, self._form)
        await self._lay_out()
        self.show()
        self._hint()


def field_of(line: Input) -> Field | None:
    """Return the field of a line, None when the form was changed since the key was pressed."""
    return next((a for a in line.ancestors if isinstance(a, Field)), None)
