"""The steps of a unit on the left, what the one under the cursor asks for and showed on the right."""

import asyncio
from contextlib import suppress
from functools import partial
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import DataTable, Label

from accept.store import Event
from accept.tui.background.busy_screen import ENDS, MOVES, Working
from accept.tui.background.scanning import Scanning
from accept.tui.screens.gap import WORDS, Explain, answer
from accept.tui.screens.notes import ask_note, note_saved, note_words
from accept.tui.screens.put_right import ask_remedy
from accept.tui.widgets.card import Card, entitle
from accept.tui.widgets.drawing import fitted
from accept.tui.widgets.findings import findings_text, limits_text, notes_text
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.step_list import (
    GAP,
    GAP_TITLE,
    HELD,
    StepList,
    UnitBar,
    head,
    held_words,
    setup,
    standing,
    what_to_do,
)
from accept.workflow.bench import Workbench
from accept.workflow.dialogue.turn import Toast
from accept.workflow.effects.serve_step import changed_words
from accept.workflow.ports import Computation
from accept.workflow.session import Session
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.status import Status
from accept.workflow.steps.unit_list import RIG
from specs.errors import AcceptError

_OPEN = "Enter: open the step"
_DONE = f"All steps are done. F9: summary and signature. {_OPEN}"


class Steps(Scanning):
    """Dismisses True when the next unit is wanted, False when this one is left as it is."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *MOVES,
        *ENDS,
        Binding("enter", "open", "Open", priority=True),
        Binding("right", "open", show=False, priority=True),
        Binding("f2", "say_where_signed", show=False, priority=True),
        Binding("f5", "note", "Note", priority=True),
        Binding("ctrl+z", "undo", "Undo"),  # no letter: a serial that is scanned here must not undo anything
        Binding("f9", "summary", "Summary", priority=True),
        Binding("ctrl+s", "summary", "Sign", priority=True),
        Binding("ctrl+r", "put_right", "Repair"),
        Binding("escape", "leave", "Other unit", priority=True),
    ]

    def __init__(self, bench: Workbench, session: Session, words: str = "") -> None:
        """Make the list. words: what the start has to say, such as a record that could not be taken."""
        super().__init__(bench, session)
        self._words = words
        self._judged_here: set[tuple[str, int]] = set()  # steps with their last entry
        self._judging: tuple[tuple[str, int], Computation] | None = None  # one of them, while it is judged by itself

    @property
    def main_key(self) -> str:
        """Return the key of what is to be done next."""
        return "f9" if self._done else "enter"

    @property
    def _done(self) -> bool:
        return self.session.judgements.next_step() is None

    @property
    def _what_now(self) -> str:
        return _DONE if self._done else _OPEN

    def compose(self) -> ComposeResult:
        yield UnitBar(self.session)
        with Horizontal(id="main"):
            yield StepList(self.session, live=True)
            with Vertical(id="pane"):
                with Card(title="", id="todo"):
                    yield Hanging(id="words")
                with Horizontal(id="columns"):
                    with VerticalScroll(id="form", classes="card", can_focus=False):
                        yield Hanging(id="card")
                    with Vertical(id="side"):
                        yield Card(Hanging(id="guide"), title="Drawing", id="drawing")
        yield Label("", id="status")
        yield KeyRow()

    def on_mount(self) -> None:
        if not self.alive:
            return
        self._show()
        self._stand_at_next()
        self.set_focus(self.query_one(StepList))
        self.say(self._words or self._what_now, "bad" if self._words else "quiet")
        self.aside(self.bench_app.load_summary, lambda _: None, "import")
        self.aside(self._look_into_records, lambda _: None, "records")

    def _look_into_records(self) -> None:
        """Look into the folder of the records once, so that a step knows at once what it can propose."""
        for step in self.session.steps:
            with suppress(AcceptError, OSError):  # the step says why
                self.session.records.proposals(step, step.check.forms[-1], self.bench.records)

    def on_screen_resume(self) -> None:
        self._show()
        self._judge_what_waits()

    def _judge_what_waits(self) -> None:
        """Judge one step after the other that is complete and was not judged, as after a power cut or by an earlier
        program. What a model takes part in is left to its own screen: it would keep the other process for seconds."""
        if not (self.alive and self.is_current):
            return
        waiting = {
            (s.name, self.session.state(s.name).upto) for s in self.session.judgements.unjudged if s.check.model is None
        }
        left = sorted(waiting - self._judged_here)
        if left:
            self._judged_here.add(left[0])
            self.aside(partial(self._judge, left[0]), lambda _: self._judged(), "judge")

    def on_screen_suspend(self) -> None:
        """Leave the other process to what is opened: what it was judging here is judged when this screen is back."""
        if self._judging is not None:
            waiting, computation = self._judging
            self._judged_here.discard(waiting)
            computation.cancel()

    on_unmount = on_screen_suspend

    def _judge(self, waiting: tuple[str, int]) -> None:
        computation = self.bench.services.computation(self.session)
        self._judging = waiting, computation
        with suppress(AcceptError, OSError):  # the step says why, when it is opened
            computation.judge_step(waiting[0])
        self._judging = None

    def _judged(self) -> None:
        self._show()
        self._judge_what_waits()

    def _show(self) -> None:
        if self.alive:
            self.query_one(StepList).show()
            self.query_one(UnitBar).show()
            self._show_card()
            self.refresh_bindings()

    def on_data_table_row_highlighted(self, _: DataTable.RowHighlighted) -> None:
        self._show_card()

    def on_resize(self) -> None:
        self._show_card()

    def _show_card(self) -> None:
        """Show what the step under the cursor asks for and what it showed, whole."""
        rail = self.query_one(StepList)
        if not rail.row_count:
            return
        step = self._step_here()
        entitle(self.query_one("#todo"), *((GAP_TITLE,) if step is None else head(self.session, step)))
        self.query_one("#words", Hanging).hang(what_to_do(WORDS) if step is None else instructions(step))
        self.query_one("#guide", Hanging).hang(Text("" if step is None else fitted(step.guide.picture, self.app.size)))
        self.query_one("#side").set_class(step is None, "nothing")
        entitle(
            self.query_one("#form"),
            "Limits" if step is not None and not self.session.state(step.name).entries else "Result",
        )
        self.query_one("#card", Hanging).fit(partial(card, self.session, step))

    def _stand_at_next(self) -> None:
        step = self.session.judgements.next_step()
        if step is not None:
            self.query_one(StepList).stand_at(step.name)

    def _step_here(self) -> WorkflowStep | None:
        """Return the step under the cursor, None if it is the gap analysis."""
        row = self.query_one(StepList).cursor_row
        return self.session.steps[row] if row < len(self.session.steps) else None

    async def action_open(self) -> None:
        """Open the step. Keys that follow wait until it is there: so none of them is lost."""
        if self.is_current and not await self.action_take_scan():
            await self._open(self._step_here())

    @property
    def value_goes(self) -> str:
        step = self._step_here()
        return "" if step is None or step.derived else f"save it in {step.short}, unless a unit has this serial"

    async def take_value(self, text: str) -> None:
        """Open the step under the cursor with a value that was typed over the list: what follows goes on there."""
        step = self._step_here()
        if step is None or step.derived:
            await super().take_value(text)
            return
        await self._open(step)
        if isinstance(shown := self.app.screen, Scanning) and shown is not self:
            await shown.take_value(text)

    async def _open(self, step: WorkflowStep | None) -> None:
        if step is None:
            await self.app.push_screen(Explain(self.bench, self.session), self._back)
        else:
            await self.app.push_screen(self.bench_app.step_screen(self.bench, self.session, step.name), self._back)

    async def open_step(self, name: str) -> None:
        self.query_one(StepList).stand_at(name)
        await self._open(None if name == GAP else self.session.step(name))

    async def begin_queue(self, step: str, words: str) -> None:
        """Open the step that is done at one unit after the other, the summary without one. words: said there."""
        if not step:
            await self.action_summary()
            return
        self.query_one(StepList).stand_at(step)
        await self._open(self.session.step(step))
        shown = self.app.screen
        if words and isinstance(shown, Working):
            shown.say_first(words)

    async def _back(self, goes_on: bool | str | None) -> None:
        """Stand at the next incomplete step, and open it if Enter asked for it; behind the last step open the summary.
        Keys that follow wait for it. goes_on: None for the summary at once, the name of a step with new records."""
        if isinstance(goes_on, str):
            self._mended(goes_on)
            return
        self._show()
        left = self._step_here()
        if goes_on is None or (goes_on and left is None):
            await self.action_summary()
            return
        step = self._next_of_queue() or self.session.judgements.next_step(left.name if goes_on and left else None)
        if step is not None:
            self.query_one(StepList).stand_at(step.name)
            if goes_on:
                await self._open(step)
        elif goes_on:
            await self.action_summary()
        else:
            self.say(self._what_now)

    def _next_of_queue(self) -> WorkflowStep | None:
        """Return the step that the queue asks for next at this unit, None without a queue of several steps."""
        queue = self.bench_app.queue
        rig = queue.step_at(self.session.judgements.waiting) if queue is not None and queue.name == RIG else ""
        return self.session.step(rig) if rig else None

    def action_move(self, rows: int) -> None:
        self._asked_about = ""
        super().action_move(rows)

    async def action_note(self) -> None:
        step = self._step_here() or self.session.step("frf")
        await ask_note(self, step, self._noted)

    def _noted(self, event: Event) -> None:
        self._show()
        self.say(self._what_now)
        note_saved(self, event)

    def action_undo(self) -> None:
        self.send(self.session.undo.entry, self._undone, "undoing")

    def _undone(self, event: Event) -> None:
        self._show()
        self.tell(changed_words(event, self.session.undo.words_of(event)))
        self.say(self._what_now)

    def action_say_where_signed(self) -> None:
        """Say where a unit is signed: F2, which does so there, does nothing here."""
        self.say("F9: summary. A unit is signed there")

    async def action_summary(self) -> None:
        """Open the summary; drawing and signing take a second to import, in a thread. Keys that follow wait for it."""
        summary = await asyncio.to_thread(self.bench_app.load_summary)
        if self.is_current:
            await self.app.push_screen(summary(self.bench, self.session), self._summed)

    def _summed(self, finished: bool | str | None) -> None:
        self._show()
        if finished:
            self.leave(True)
        else:
            self._stand_at_next()
            self.say(self._what_now)

    def check_action(self, action: str, _: tuple[object, ...]) -> bool | None:
        """Leave keys of a training out of the footer elsewhere."""
        return action != "put_right" or self.bench.training is not None

    def action_put_right(self) -> None:
        ask_remedy(self, self._mended)

    def _mended(self, step: str) -> None:
        self._show()
        self.query_one(StepList).stand_at(step)
        self.tell(Toast("New records are there"))
        self.say("Enter: measure the step again")

    def help_text(self) -> str:
        marks = "\n".join(f"  {status.mark}  {status.word}" for status in Status)
        return f"You can do the steps in any order. The cursor is on the first incomplete step.\n\n{marks}"


def instructions(step: WorkflowStep) -> Text:
    """Return what to do at a step, and with which instrument."""
    text, more = what_to_do(step.guide.words), setup(step)
    return text.append("\n").append_text(more) if more else text


def card(session: Session, step: WorkflowStep | None, room: int) -> Text:
    """Return what holds the unit, and what was found where a step is judged; before that where it stands, and its
    limits. step: None for the gap analysis; room: columns."""
    judgements, found = session.judgements, session.gap.found
    text = held_words(judgements.nonconformances)
    text.append("\n\n" if text else "")
    if step is None:
        return text.append_text(Text("Not analysed yet", "dim") if found is None else answer(found))
    judgement, stands = judgements.of_step(step.name), standing(session, step)
    if judgement is not None and not stands:
        first = judgements.action_at_source(step) or ""
        text.append_text(findings_text(step.check, judgement, judgements.usual, first, room=room))
        text.append("\n" if judgement.notes else "").append_text(notes_text(judgement))
    else:
        text.append(f"{stands}\n\n" if stands else "", "bold yellow")
        text.append_text(limits_text(step, judgements.earlier, room))
    for note in session.state(step.name).notes:
        text.append(f"\n{note_words(note)}", HELD if note.nonconformance else "dim")
    return text
