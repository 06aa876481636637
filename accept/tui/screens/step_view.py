"""What every step shows: where it stands, its findings, what to do about them, its pictures."""

from contextlib import suppress
from functools import partial
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.widgets import Static
from textual.worker import WorkerCancelled, WorkerFailed

from accept.judging.advice import first_advice
from accept.pictures.labels import label_of
from accept.store import Event
from accept.tui.background.process_work import send_to_worker
from accept.tui.screens.notes import ask_note, note_saved
from accept.tui.screens.page import Page
from accept.tui.widgets.findings import Findings, missing_words
from accept.tui.widgets.limit_bar import limits
from accept.tui.widgets.pictures import Pictures
from accept.tui.widgets.step_words import head, setup
from accept.workflow.bench import Workbench
from accept.workflow.session import Session
from accept.workflow.state.unit_state import StepJudgement, StepState
from accept.workflow.status import Status
from accept.workflow.steps.plan import needs_rig
from accept.workflow.steps.section import missing_labels, ready, records_awaited
from accept.workflow.unit_list import RIG, Queue
from accept.workflow.worker.judging import Elsewhere
from accept.workflow.worker.process import STOPPED
from specs.spec import Limit


class StepView(Page):
    """Judges in the other process; what a model takes part in is shown with a clock, and stopped with Escape."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f10,ctrl+n", "next_unit", "Same step, next unit", show=False, priority=True),
        Binding("f9", "to_summary", "Summary", show=False, priority=True),
        Binding("ctrl+d", "details", "More values", show=False, priority=True),
    ]

    def __init__(self, bench: Workbench, session: Session, name: str) -> None:
        self.step = session.step(name)
        self.judging = False  # a judgement is under way
        super().__init__(bench, session, self.step.guide.words, name)

    @property
    def state(self) -> StepState:
        return self.session.state(self.step.name)

    @property
    def complete(self) -> bool:
        return ready(self.step, self.state)

    @property
    def own_queue(self) -> Queue:
        """Return the queue of units that wait for this step."""
        return Queue(self.step.name, self.session.spec.kind, self.step.short, ())

    @property
    def queue(self) -> Queue | None:
        """Return what is done at one unit after the other, None if this step is not part of it."""
        queue = self.bench_app.queue
        at_rig = queue is not None and queue.name == RIG and needs_rig(self.step)
        return queue if at_rig or (queue is not None and queue.name == self.step.name) else None

    @property
    def complete_words(self) -> str:
        """Return what Enter and its neighbours do at a complete step."""
        summary = "" if self._is_last else ", F9: summary"
        return f"{self.put_right_first or 'Step complete'}. {self.enter_words}{summary}, ↑ ↓: correct, Esc: steps"

    @property
    def enter_words(self) -> str:
        """Return what Enter opens from a complete step."""
        at_rig = self._next_at_rig
        if at_rig == self.step.name:
            return "Enter: this step again"
        if at_rig:
            return f"Leave {self.session.serial} mounted. Enter: its next step, {self.session.step(at_rig).short}"
        if self.queue is not None:
            return "Enter: next unit"
        return f"Enter: {'summary' if self._is_last else 'next step'}, F10: next unit"

    @property
    def _is_last(self) -> bool:
        """Return whether Enter opens the summary from here."""
        return self.queue is None and self.session.next_step(self.step.name) is None

    @property
    def _next_at_rig(self) -> str:
        """Return the step that this unit still waits for in the queue of the rig, "" for none or in another queue: a
        unit leaves the rig when all of its steps there are done."""
        queue = self.queue
        return queue.step_at(self.session.waiting) if queue is not None and queue.name == RIG else ""

    @property
    def put_right_first(self) -> str:
        """Return what became of a step that failed or has no result, and what to do first; "" of any other."""
        judgement = self.session.judgement(self.step.name)
        if judgement is None or not self._is_bad:
            return ""
        todo = self.session.action_at_source(self.step) or first_advice(judgement.findings)
        todo = todo or ("record again" if self.step.derived else "F8: measure again")
        return f"{self.session.status(self.step).word.capitalize()} → {todo}"

    @property
    def what_now(self) -> str:
        """Return what to do next."""
        return self.complete_words

    def action_details(self) -> None:
        """Show the values without limits, or hide them."""
        findings = self.query_one(Findings)
        findings.whole = not findings.whole
        self.show()

    async def go_further(self) -> None:
        """Go on to the next step; of a queue, to the next unit as soon as this one has nothing more to do in it."""
        queue = self.queue
        if queue is None or self._next_at_rig:
            self.leave(True)
        elif why := await self._next_unit(queue):
            self.bench_app.queue = None
            self.say(f"{why}. Enter: next step of this unit", "good")

    async def action_next_unit(self) -> None:
        """Open the same step of the next unit that waits for it, also from the queue of the rig, which goes on then."""
        if why := await self._next_unit(self.own_queue, self.queue):
            self.say(why, "bad")

    async def _next_unit(self, queue: Queue, goes_on: Queue | None = None) -> str:
        """Open the next unit of a queue, with what was found at this one. goes_on: the queue that is done from there.
        Return why not."""
        await self.saved()
        for worker in [w for w in self.workers if w.node is self and w.group == "judge"]:
            with suppress(WorkerFailed, WorkerCancelled):
                await worker.wait()
        status = self.session.status(self.step)
        if status in (Status.FAIL, Status.NO_RESULT):
            self.app.bell()
        words = f"{self.session.serial}: {status.mark} {status.word}. "
        return await self.bench_app.next_unit(queue, words, goes_on)

    def show(self) -> None:
        """Show everything from the state of the session."""
        if not self.alive:
            return
        self.query_one("#head", Static).update(head(self.session, self.step))
        self.query_one("#setup", Static).update(setup(self.step))
        done = self.complete and not records_awaited(self.step, self.state)  # else the instruction is still to be read
        self.query_one("#main").set_class(done, "complete")
        judgement = self.session.judgement(self.step.name) if self.complete else None
        first = self.session.action_at_source(self.step) or ""
        self.query_one(Findings).show(self.step.check, judgement, self.lacking(), self.session.usual, first)
        self.query_one(Pictures).show(self.session.panels(self.step.name))
        self.show_around()

    def lacking(self) -> str:
        """Return what is still to be given, in words."""
        return missing_words(missing_labels(self.step, self.state)) if self.state.entries else ""

    def judge(self) -> None:
        """Judge what was taken; the findings appear when they are there."""
        name, findings = self.step.name, self.query_one(Findings)
        self.judging = True
        if self.step.check.model is None:
            findings.show(self.step.check, None, "Evaluating … (Esc: back; entries are kept)")
            judge = Elsewhere(self.bench.worker).judge
            self.aside(lambda: self.session.judge_step(name, judge), self._judged, "judge")
        else:
            findings.show(self.step.check, None, "Comparing with the model … (Esc: stop)")
            work = partial(self.session.judge_step, name)
            send_to_worker(
                self, self.bench.worker, lambda e: work(e.judge), self._compared, "comparing", self._not_compared
            )

    def _judged(self, _: StepJudgement) -> None:
        self.judging = False
        self.show()
        if self._is_bad and not self.query(".doubted, .refused"):  # what is asked about or refused stays at the foot
            self.say(self.what_now, "bad")

    @property
    def _is_bad(self) -> bool:
        return self.session.status(self.step) in (Status.FAIL, Status.NO_RESULT)

    def _compared(self, _: StepJudgement) -> None:
        self.judging = False
        self.say(*((self.complete_words, "bad") if self._is_bad else (f"Compared. {self.enter_words}", "good")))
        self.show()

    def _not_compared(self, why: str) -> None:
        self.judging = False
        self.show()
        self.query_one(Findings).show(self.step.check, None, "Not compared. F3: compare again, Esc: back")
        self.say("Stopped. F3: compare again" if why == STOPPED else why, "doubt" if why == STOPPED else "bad")

    def check_action(self, action: str, _: tuple[object, ...]) -> bool | None:
        """Leave keys without a meaning at present out of the footer."""
        return action != "picture" or not self.is_mounted or bool(self.session.panels(self.step.name))

    async def action_to_summary(self) -> None:
        """Open the summary from a complete step, once all is saved."""
        await self.saved()
        if self.complete:
            self.stop_or(lambda: self.leave(None))
        else:
            self.say("F9 keeps a value that is asked about; none is. Summary: Esc, then F9", "doubt")

    async def action_note(self) -> None:
        await ask_note(self, self.session, self.step, self.bench.records, self._noted)

    def _noted(self, event: Event) -> None:
        if not self.judging:
            self.show()  # a nonconformance holds the step that is shown
        self.say(note_saved(event), "good")

    def help_text(self) -> str:
        asked = self.step.asked
        bounds = [
            f"  {label_of(name)}: {limit_words(limit)}\n      {name}; {limit.source}"
            for name, limit in asked.limits.items()
        ]
        told = f"{self.step.guide.words}\n{setup(self.step).plain}\n\n{self.step.guide.picture}\n"
        return "\n".join([told, *self.more_help(), "Limits", *bounds])

    def more_help(self) -> list[str]:
        return []


def limit_words(limit: Limit) -> str:
    """Return a limit with its unit, as the screen writes it."""
    ends = limits(limit.lower, limit.upper)
    return f"{ends} {limit.unit}, {limit.rule}"
