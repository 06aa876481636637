"""What every step shows: where it stands, its findings, what to do about them, its pictures."""

from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Label

from accept.store import Event
from accept.tui.findings import COLOURS, Findings, missing_words
from accept.tui.notes import ask_note
from accept.tui.pictures import Pictures
from accept.tui.strip import limits
from accept.tui.working import Working
from accept.workflow.bench import Bench
from accept.workflow.judgement import StepJudgement
from accept.workflow.judging import Elsewhere
from accept.workflow.section import missing, ready
from accept.workflow.session import Session
from accept.workflow.state import StepState
from specs import Limit

_HEAD = {"bold red": "red", "dim": "white"}


class StepView(Working[bool]):
    """Holds `#head`, `Findings` and `Pictures`. What a model takes part in is judged in a process of its own, with a
    clock, and stopped with Escape; anything else in a thread."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("pageup", "page(-1)", show=False),
        Binding("pagedown", "page(1)", show=False),
    ]

    def __init__(self, bench: Bench, session: Session, name: str) -> None:
        super().__init__()
        self.bench, self.session = bench, session
        self.step = session.step(name)

    @property
    def state(self) -> StepState:
        return self.session.state(self.step.name)

    @property
    def complete(self) -> bool:
        return ready(self.step, self.state)

    def show(self) -> None:
        """Everything from the state of the session."""
        if not self.alive:
            return
        status = self.session.status(self.step)
        number = 1 + [s.name for s in self.session.steps].index(self.step.name)
        words = f"{status.mark} {status.word}  ·  {self.session.serial}  ·  {self.step.title}"
        head = self.query_one("#head", Label)
        head.update(f"{number}/{len(self.session.steps)}  {words}")  # a long title is what may be cut
        head.styles.color = _HEAD.get(COLOURS[status], COLOURS[status])
        judgement = self.session.judgement(self.step.name) if self.complete else None
        self.query_one(Findings).show(self.step.check, judgement, self.lacking())
        self.query_one(Pictures).show(self.session.panels(self.step.name))

    def lacking(self) -> str:
        """What is still to be given, in words."""
        return missing_words([i.label for i in missing(self.step, self.state)]) if self.state.entries else ""

    def judge(self) -> None:
        """Judge what was taken; the findings appear when they are there."""
        name = self.step.name
        if self.step.check.model is None:
            self.query_one(Findings).show(self.step.check, None, "judging … (Esc goes back, the entries are kept)")
            self.aside(lambda: self.session.judge_step(name), self.judged, "judge")
            return
        self.query_one(Findings).show(self.step.check, None, "comparing with the model … (Esc stops it)")
        elsewhere = Elsewhere(lambda words: setattr(self, "progress", words))
        self.stop = elsewhere.cancel
        self.send(lambda: self.session.judge_step(name, elsewhere.judge), self.judged, "comparing", self.not_judged)

    def judged(self, judgement: StepJudgement) -> None:
        if self.stop is not None:
            self.stop = None
            self.say("done", "good")
        self.show()

    def not_judged(self, words: str) -> None:
        """Stopped, or refused: the reason stands at the foot of the screen."""
        self.stop = None
        self.show()

    def action_note(self) -> None:
        ask_note(self, self.session, self.step, self._noted)

    def _noted(self, event: Event) -> None:
        self.say(f"note kept as event {event.seq}; it goes on the certificate", "good")

    def action_picture(self) -> None:
        self.query_one(Pictures).next()
        self.call_after_refresh(self.query_one("#body", VerticalScroll).scroll_end, animate=False)

    def action_page(self, way: int) -> None:
        body = self.query_one("#body", VerticalScroll)
        body.scroll_relative(y=way * max(1, body.size.height - 2), animate=False)

    def action_leave(self) -> None:
        """Back; what takes long is stopped first."""
        self.stop_or(lambda: self.leave(True))

    def help_text(self) -> str:
        asked = self.step.asked
        bounds = [f"  {name}: {limit_words(limit)}\n      {limit.source}" for name, limit in asked.limits.items()]
        measured_with = f"\nMeasured with: {asked.instrument}" if asked.instrument else ""
        told = f"{self.step.guide.words}\n{self.step.guide.picture}{measured_with}\n"
        return "\n".join([told, *self.more_help(), "Limits", *bounds])

    def more_help(self) -> list[str]:
        return []


def limit_words(limit: Limit) -> str:
    ends = limits({"lower": limit.lower, "upper": limit.upper})
    return f"{ends} {limit.unit}, {limit.rule}"
