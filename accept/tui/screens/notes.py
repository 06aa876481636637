"""A note on a step."""

from collections.abc import Callable

from accept.store import Event
from accept.tui.background.busy_screen import Working
from accept.tui.screens.ask import Question, QuestionLine
from accept.workflow.session import Session
from accept.workflow.state.unit_state import Note
from accept.workflow.steps.plan import WorkflowStep

_LINES = (
    QuestionLine("Note"),
    QuestionLine("Nonconformance of the part? y or n", value="n"),
)


def ask_note(screen: Working[bool], session: Session, step: WorkflowStep, then: Callable[[Event], None]) -> None:
    """Ask for a note on a step and keep it. A nonconformance is what was found wrong with the part."""

    def keep(answer: list[str] | None) -> None:
        if answer is not None:
            wrong = answer[1].strip().lower().startswith("y")
            screen.send(lambda: session.note(step.name, answer[0], wrong), then)

    earlier = "\n".join(map(_words, session.state(step.name).notes))
    screen.app.push_screen(Question(f"Note on {step.title}", earlier or "No notes yet.", _LINES), keep)


def _words(note: Note) -> str:
    return f"{'! ' if note.nonconformance else ''}{note.text} ({note.who})"
