"""What every step shows: where it stands, its findings, what to do about them, its pictures."""

from functools import partial

from textual.widgets import Static

from accept.pictures.labels import label_of
from accept.store import Event
from accept.tui.background.process_work import send_to_worker
from accept.tui.screens.notes import ask_note
from accept.tui.screens.page import Page
from accept.tui.widgets.findings import Findings, missing_words
from accept.tui.widgets.limit_bar import limits
from accept.tui.widgets.pictures import Pictures
from accept.tui.widgets.step_words import head, setup
from accept.workflow.bench import Workbench
from accept.workflow.session import Session
from accept.workflow.state.unit_state import StepJudgement, StepState
from accept.workflow.steps.section import missing_labels, ready
from accept.workflow.worker.judging import Elsewhere
from accept.workflow.worker.process import STOPPED
from specs.spec import Limit


class StepView(Page):
    """Judges in the other process; what a model takes part in is shown with a clock, and stopped with Escape."""

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

    def show(self) -> None:
        """Show everything from the state of the session."""
        if not self.alive:
            return
        self.query_one("#head", Static).update(head(self.session, self.step))
        self.query_one("#setup", Static).update(setup(self.step))
        self.query_one("#main").set_class(self.complete, "complete")
        judgement = self.session.judgement(self.step.name) if self.complete else None
        self.query_one(Findings).show(self.step.check, judgement, self.lacking())
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

    def _compared(self, _: StepJudgement) -> None:
        self.judging = False
        self.say("Compared. Enter: next step", "good")
        self.show()

    def _not_compared(self, why: str) -> None:
        self.judging = False
        self.show()
        self.query_one(Findings).show(self.step.check, None, "Not compared. F3: compare again, Esc: back")
        self.say("Stopped. F3: compare again" if why == STOPPED else why, "doubt" if why == STOPPED else "bad")

    def check_action(self, action: str, _: tuple[object, ...]) -> bool | None:
        """Leave keys without a meaning at present out of the footer."""
        return action != "picture" or not self.is_mounted or bool(self.session.panels(self.step.name))

    def action_note(self) -> None:
        ask_note(self, self.session, self.step, self._noted)

    def _noted(self, _: Event) -> None:
        self.say("Note saved; it appears on the certificate", "good")

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
