"""One step: renders its dialogue, passes on keys and executes effects; what they mean is decided there."""

import asyncio
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.events import Resize
from textual.widgets import Static
from textual.worker import WorkerCancelled, WorkerFailed

from accept.pictures.labels import label_of
from accept.pictures.words import pretty
from accept.store import Event
from accept.store.payloads import EntryUndone
from accept.tui.screens.ask import Question, QuestionLine, required
from accept.tui.screens.capture_dialogue import CaptureDialogue
from accept.tui.screens.notes import ask_note, note_saved
from accept.tui.screens.page import Page
from accept.tui.screens.put_right import ask_remedy
from accept.tui.screens.record_picker import Pick
from accept.tui.widgets.card import Card, entitle
from accept.tui.widgets.drawing import drawing_text
from accept.tui.widgets.fields import Field, stored_words
from accept.tui.widgets.findings import Findings, limits_text, notes_text
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.limit_bar import blocks, limits
from accept.tui.widgets.live_value import Followed, Gauge
from accept.tui.widgets.pictures import pictures_of, show_in, units_before
from accept.tui.widgets.plot import has_room
from accept.tui.widgets.step_list import head, setup
from accept.tui.widgets.text_entry import typed
from accept.workflow.bench import Workbench
from accept.workflow.dialogue import step as dialogue
from accept.workflow.dialogue import step_effects as do
from accept.workflow.dialogue.step_effects import Do
from accept.workflow.dialogue.step_state import FieldPlace, StepDialogue, Turn
from accept.workflow.effects.serve_step import StepService, changed_words, saved_words
from accept.workflow.entry.record_folder import age_words
from accept.workflow.session import Session
from accept.workflow.steps.plan import has_files
from accept.workflow.steps.section import counted, repeated
from checks.declare import Measured, Series

_COURSE = 16  # columns of how a record runs
LOOK_EVERY_S = 1.0  # into the folder of the records
LOOK_AT_MOST_S = 0.7  # before the form is shown: a slow folder is waited for no longer than a person notices
TYPED_AHEAD_S = 0.2  # what a paste or a scanner sends arrives within; a person reads a refusal more slowly
_HELP = (
    "Numbers may carry a unit and an uncertainty: 4.99 uF, 4,99, 4.99 ± 0.02 uF. F3 reads the instrument; at a "
    "record it measures the whole step. F4 takes one more reading of the same value: the mean counts, the "
    "scatter is shown. If the decimal point or the unit looks mistyped, the program asks; ^K keeps the value.\n"
)


class StepScreen(Page):
    """Values and files of one step, judged in the other process; Escape stops a comparison with a model."""

    press = staticmethod(dialogue.press)
    AUTO_FOCUS = ""  # where every value is there the cursor is in no field, after a question in front neither

    # All before the line itself gets them: so keys act in the order in which they were pressed, however fast they come.
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "press('enter')", "Save", priority=True),
        Binding("ctrl+k", "press('ctrl+k')", "Keep it", priority=True),
        Binding("ctrl+r", "press('ctrl+r')", "Repair", priority=True),
        Binding("f2", "press('f2')", "File", priority=True),
        Binding("f3", "press('f3')", "Measure", priority=True),
        Binding("f4", "press('f4')", "Mean", priority=True),
        Binding("f5", "press('f5')", "Note", priority=True),
        Binding("ctrl+f", "press('ctrl+f')", "Other input", priority=True),
        Binding("f7", "picture", "Plot", priority=True),
        Binding("f8", "press('f8')", "Again", priority=True),
        Binding("f9", "press('f9')", "Summary", priority=True),
        Binding("f10", "press('f10')", "Next unit", priority=True),
        Binding("ctrl+n", "press('f10')", "Next unit", show=False, priority=True),
        Binding("ctrl+s", "press('f9')", "Sign", show=False, priority=True),
        Binding("ctrl+d", "press('ctrl+d')", "More values", show=False, priority=True),
        Binding("ctrl+z", "press('ctrl+z')", "Undo", priority=True),
        Binding("up", "press('up')", show=False, priority=True),
        Binding("down", "press('down')", show=False, priority=True),
        Binding("escape", "leave", "Steps", priority=True),
    ]

    def __init__(self, bench: Workbench, session: Session, name: str) -> None:
        self.step = session.step(name)
        super().__init__(bench, session, self.step.guide.words, name)
        self.service = StepService(bench, session, self.step)
        self.dialogue: StepDialogue = dialogue.opening(self.step, self.service.facts(None)).state
        self._shown: object = None  # that the parts above the fields were drawn from
        self._fields: Sequence[Field] = ()
        self._stood: object = None  # the cursor, and below which lines there was a reason
        self._courses: dict[str, Sequence[float]] = {}  # of stored records, by file
        self._laying_out = asyncio.Lock()
        self._gauge = Gauge()  # not shown at a derived step, which has nothing to follow
        self._guides = [Hanging(self.step.guide.picture, id="guide")] if self.step.guide.picture else []

    def above(self) -> ComposeResult:
        yield self._gauge

    def parts(self) -> ComposeResult:
        yield Findings(id="findings")  # on top: it is seen without scrolling
        if not self.step.derived:
            yield Card(Vertical(id="fields"), title="Entries", id="entries")
        yield Hanging(id="notes", classes="card")

    def say_first(self, words: str) -> None:
        self.say(words if self.step.derived else f"{words}. {self.dialogue.what_now}")

    def drawings(self) -> ComposeResult:
        if self._guides:
            yield Card(*self._guides, title="Drawing", id="drawing")
        yield Vertical(id="before")

    async def on_mount(self) -> None:
        if self.alive:
            await self.follow(dialogue.opening(self.step, self.service.facts(self.bench_app.queue)))
            self.set_interval(LOOK_EVERY_S, self.look_again)

    def at_present(self) -> Turn:
        return Turn(replace(self._edited().state, facts=self.service.facts(self.bench_app.queue)))

    def _edited(self) -> Turn:
        if len(self._fields) != len(self.dialogue.lines):  # they are being laid out
            return Turn(self.dialogue)
        lines = [field.input for field in self._fields]
        cursor = next((n for n, line in enumerate(lines) if line is self.focused), None)
        return dialogue.edited(self.dialogue, tuple(line.value for line in lines), cursor)

    def say(self, words: str, role: str = "quiet") -> None:
        self.dialogue = replace(self.dialogue, hints=False)
        super().say(words, role)

    async def execute(self, effect: object) -> None:
        match effect:
            case Do.JUDGE:
                self._judge()
            case Do.MEASURE:
                self._measure()
            case Do.STOP:
                self.stop_or(lambda: None)
            case Do.UNDO:
                self.send(partial(self.session.undo.entry, self.step.name), self._changed, "undoing")
            case Do.END_QUEUE:
                self.bench_app.queue = None
            case Do.ASK_REASON:
                words, lines = "The record keeps the earlier entries.", [QuestionLine("Reason")]
                question = Question("Measure this step again", words, lines, required("Type the reason"))
                self.app.push_screen(question, self._measure_again)
            case Do.ASK_NOTE:
                await ask_note(self, self.step, self._noted)
            case Do.ASK_REMEDY:
                ask_remedy(self, partial(self.later, dialogue.mended))
            case do.LookForRecords():
                await self._look(effect)
            case do.Recognize():
                kind = await asyncio.to_thread(self.service.recognize, effect, self.bench_app.is_secret)
                await self.answer(dialogue.recognized, effect, kind)
            case do.StoreEntry():
                self._store(effect)
            case do.Settle():
                await self._settle(effect)
            case do.Leave():
                self.leave(effect.result)
            case do.GoToUnit():
                await self.saved()
                if why := await self.bench_app.scanned(effect.serial, effect.queue):
                    self.say(why, "bad")
            case do.NextUnit():
                if why := await self.bench_app.next_unit(effect.queue, effect.words, effect.goes_on):
                    await self.answer(dialogue.no_next_unit, effect, why)
            case do.PickFile():
                await self._pick(effect)
            case do.ReturnLater():
                self.set_timer(TYPED_AHEAD_S, partial(self.answer, dialogue.returned, effect.place))

    async def _settle(self, effect: do.Settle) -> None:
        await self.saved()
        for worker in [w for w in self.workers if effect.judged and w.node is self and w.group == "judge"]:
            with suppress(WorkerFailed, WorkerCancelled):
                await worker.wait()
        await typed(self)  # what was refused last is known by now
        await self.answer(dialogue.settled, effect.then)

    async def _look(self, look: do.LookForRecords) -> None:
        if look.then in ("again", "turn"):
            if self.is_current:
                self.aside(
                    lambda: (look, [(form, self.service.proposals(form)) for form in look.forms], time.time()),
                    lambda looked: self.later(dialogue.looked, *looked),
                    "records",
                )
            return
        found = []
        with suppress(TimeoutError):
            for form in look.forms:
                proposals = asyncio.to_thread(self.service.proposals, form)
                found.append((form, await asyncio.wait_for(proposals, LOOK_AT_MOST_S)))
                if found[-1][1]:
                    break
        await self.answer(dialogue.looked, look, found, time.time())

    async def look_again(self) -> None:
        """Look into the folder of the records once more."""
        for look in dialogue.looks(self.at_present().state) if self.is_current else ():
            await self._look(look)

    def _store(self, entry: do.StoreEntry) -> None:
        def stored(event: Event) -> None:
            self._gauge.forget()
            self.later(dialogue.stored, entry, saved_words(event), event.data.get("origin", ""))
            self.call_next(self._watch)

        def failed(why: str) -> None:
            is_there = entry.is_file and self.service.path(entry.text).is_file()
            self.later(dialogue.not_stored, entry, why, is_there)

        self.send(lambda: self.service.store(entry), stored, self.service.doing(entry), failed)

    def _judge(self) -> None:
        name, done = self.step.name, partial(self.later, dialogue.judged)
        failed = partial(self.later, dialogue.not_judged)
        if self.step.check.model is None:
            judge = self.bench.services.computation(self.session).judge_step
            self.aside(partial(judge, name), done, "judge", failed)
        else:
            self.compute(lambda computation: computation.judge_step(name), done, "comparing", failed)

    def _measure(self) -> None:
        """Measure the whole step by its recipe: the bench is set up as it asks, Escape stops it."""
        step, instruments = self.step.name, self.bench.instruments
        talk = CaptureDialogue(self, f"Measure: {self.step.guide.words}", self.step.guide.picture)
        self.stop = talk.stopped.set

        def measure() -> Sequence[str]:
            try:
                return self.bench.services.measure(self.session, step, instruments, talk)
            finally:
                self.stop = None

        def ended(notes: Sequence[str] | str) -> None:
            talk.ended()
            self.later(dialogue.measured, None if isinstance(notes, str) else notes)

        doing = f"measuring with {instruments.recording(step).name}; Esc: stop"
        self.send(measure, ended, doing, ended)

    def _measure_again(self, answer: list[str] | None) -> None:
        if answer is not None:
            self.send(lambda: self.session.entries.remeasure(self.step.name, answer[0]), self._changed, "storing")

    def _noted(self, event: Event) -> None:
        note_saved(self, event)
        self.later(Turn)  # a nonconformance holds the step that is shown

    def _changed(self, event: Event) -> None:
        undone = self.session.undo.words_of(event) if event.what == EntryUndone.KIND else ""
        self.later(dialogue.changed, changed_words(event, undone))

    async def _pick(self, effect: do.PickFile) -> None:
        declared, records, session = effect.declared, self.bench.records, self.session
        lacks = partial(session.records.lacks, declared)
        score = partial(session.records.name_score, self.step, declared)

        def picked(path: Any) -> None:
            if path is not None:
                within = path.is_relative_to(records)
                self.later(dialogue.picked, effect.place, str(path.relative_to(records) if within else path))

        await self.app.push_screen(Pick(declared.label, records, lacks, score, effect.first), picked)

    async def draw(self) -> None:
        async with self._laying_out:
            if [field.place for field in self._fields] != [line.place for line in self.dialogue.lines]:
                await self._lay_out()
        if not self.alive or len(self._fields) != len(self.dialogue.lines):
            return
        self._show_fields()
        d = self.dialogue
        self._show_guides()
        line = None if d.cursor is None else self._fields[d.cursor].input
        if line is not self.focused:
            self.set_focus(line)
        stands = d.cursor, [d.reason(n)[1] for n in range(len(d.lines))]
        if line is not None and stands != self._stood:  # reasons that come and go below other lines move it
            self.call_after_refresh(line.scroll_visible, animate=False)
        self._stood = stands
        if (shown := (d.facts, d.judging_words, d.whole)) != self._shown:
            self._shown = shown
            self.show()

    def _show_guides(self) -> None:
        for guide in self._guides:
            guide.hang(drawing_text(self.dialogue, self.app.size))

    async def _show_before(self) -> None:
        if self.alive:
            panels = units_before(self.session, self.step) if has_room(self.app.size) else ()
            holder = self.query_one("#before")
            holder.set_class(not panels, "nothing")
            await show_in(holder, panels)

    def on_resize(self, _: Resize) -> None:
        self._show_guides()
        self.call_later(self._show_before)

    def _show_fields(self) -> None:
        d = self.dialogue
        judgement = d.facts.judgement if d.complete else None
        for n, (field, line) in enumerate(zip(self._fields, d.lines, strict=True)):
            stored = stored_words(line.place, self.step, d.facts.state, judgement)
            course = self._course(line.place)
            takes = n == d.cursor and d.proposed(n) is not None
            field.show(line.text, stored, *d.reason(n), takes=takes, course=course)
        self._gauge.leave_to_field(d.cursor is not None and d.reason(d.cursor)[1] == "refused")
        self._read_courses()

    def _course(self, place: FieldPlace) -> str:
        """Return how a stored record runs, and its age."""
        link = self.dialogue.facts.state.link(place.declared.name) if place.is_file else None
        if link is None:
            return ""
        drawn = blocks(self._courses.get(link.file, ()), _COURSE)
        return f"{drawn}  {age_words(self.service.stored_at(link.seq))}".strip()

    def _read_courses(self) -> None:
        """Read how the stored records run, beside everything else, each once."""
        for declared in (line.place.declared for line in self.dialogue.lines):
            link = self.dialogue.facts.state.link(declared.name)
            if isinstance(declared, Series) and link is not None and link.file not in self._courses:
                self._courses[link.file] = ()
                done = partial(self._show_course, link.file)
                self.aside(partial(self.service.course, declared, link.file), done, f"course {link.file}")

    def _show_course(self, file: str, course: Sequence[float]) -> None:
        self._courses[file] = course
        self._show_fields()

    async def _lay_out(self) -> None:
        self._fields = ()
        await self.query_one("#fields").remove_children()
        if not self.alive:  # left while the old fields went
            return
        fields = [Field(line.place) for line in self.dialogue.lines]
        await self.query_one("#fields").mount(*fields)
        self._fields = fields
        self.call_after_refresh(self._show_count)  # its card has its width then

    def show(self) -> None:
        """Show everything above the fields and around them."""
        d = self.dialogue
        self.entitle(*head(self.session, self.step))
        self.query_one("#setup", Static).update(setup(self.step))
        done = d.complete and not d.awaits_records  # else the instruction is still to be read
        self.query_one("#main").set_class(done, "complete")
        findings, words = self.query_one(Findings), d.judging_words
        judgement = d.facts.judgement if d.complete and not words else None
        findings.whole = d.whole
        findings.show(
            self.step.check, judgement, words or d.lacking, self.session.judgements.usual, d.facts.source_action or ""
        )
        notes = self.query_one("#notes", Hanging)
        earlier = self.session.judgements.earlier
        notes.display = judgement is None or bool(judgement.notes)
        notes.border_title = "Limits" if judgement is None else "Notes"
        notes.fit(lambda room: limits_text(self.step, earlier, room) if judgement is None else notes_text(judgement))
        panels = pictures_of(self.session, self.step)
        self.query_one("#main").set_class(bool(panels) and (done or not has_files(d.form)), "plotted")
        self.query_one("#side").set_class(self.step.derived and not panels, "nothing")
        self.pictures.show(panels)
        self.call_later(self._show_before)
        self._show_count()
        self.show_around()

    def _show_count(self) -> None:
        """Show how many of the entries are there, of those that are needed, and the other way to give them."""
        d = self.dialogue
        for card in self.query("#entries"):
            given, wanted = counted(d.form, d.facts.state)
            optional = f"{len(d.lines) - wanted} optional" if len(d.lines) > wanted else ""
            others = ", ".join(form.name for form in self.step.check.forms if form is not d.form)
            title = "Records" if has_files(d.form) else "Entries"
            words = [*filter(None, (f"{given} of {wanted}", f"^F: {others}" if others else "", optional))]
            if optional and 0 < card.size.width < len(f"{title}  {' · '.join(words)}"):
                words.pop()  # each of them says so itself
            entitle(card, title, " · ".join(words))

    def on_input_changed(self) -> None:
        """Show a line that is typed into."""
        turn = self._edited()
        self.dialogue = turn.state
        if turn.words is not None:
            super().say(turn.words.text, turn.words.role)
        if len(self._fields) == len(self.dialogue.lines):
            self._show_fields()

    async def on_descendant_focus(self) -> None:
        if self._edited().state.cursor != self.dialogue.cursor:  # not by its own doing, which was said and drawn
            await self.answer(dialogue.moved)
        self._watch()

    def on_screen_resume(self) -> None:
        self._watch()

    def on_screen_suspend(self) -> None:
        super().on_screen_suspend()
        self._gauge.leave()

    def _watch(self) -> None:
        """Show the instrument of the present line at the gauge, or what is stored there."""
        line, state = self.dialogue.here, self.dialogue.facts.state
        if line is None or line.place.is_file:
            self._gauge.follow(None, Followed(), None)
            return
        name, index = line.place.key
        one = None if self.dialogue.complete else repeated(state.readings(name, index), self.step.asked, name)
        stored = None if one is None else Measured(one.value, one.U)  # its finding shows it at a complete step
        limit, earlier = self.step.asked.limits.get(name), self.session.judgements.earlier.get(name, ())
        instrument = self.service.instrument(line.place)
        whose = "" if instrument is None else instrument.short_name
        self._gauge.follow(instrument, Followed(whose, line.place.name, line.place.unit, limit, earlier), stored)

    async def action_press(self, key: str) -> None:
        """Hand on a key, unless Enter ends a serial that was scanned; it is meant for the form."""
        self.leave_tab()
        if key != "enter" or not await self.action_take_scan():
            await super().action_press(key)

    async def take_value(self, text: str) -> None:
        """Give a value to the line under the cursor, if it takes one."""
        await self.answer(dialogue.take_value, text)

    @property
    def main_key(self) -> str:
        return self.dialogue.main_key

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave keys without a meaning at this step out of the footer."""
        if action == "picture":
            return bool(self.pictures.panels)
        return action != "press" or self.dialogue.means(str(parameters[0]))

    def help_text(self) -> str:
        bounds = [
            f"  {label_of(name)}: {limits(x.lower, x.upper, x.unit)}, {x.rule}\n      {pretty(x.source)} ({name})"
            for name, x in self.step.asked.limits.items()
        ]
        told = f"{self.step.guide.words}\n{setup(self.step).plain}\n\n{self.step.guide.picture}\n"
        return "\n".join([told, *([] if self.step.derived else [_HELP]), "Limits", *bounds])
