"""A note on a step, with a photo or another file."""

from collections.abc import Callable

from textual.widget import AwaitMount

from accept.store import Event
from accept.store.payloads import StepNoted
from accept.tui.background.scanning import Scanning
from accept.tui.screens.ask import Question, QuestionLine
from accept.workflow.dialogue.turn import Toast
from accept.workflow.effects.serve_step import saved_title
from accept.workflow.entry.parse_entry import parse_path
from accept.workflow.entry.record_folder import new_photo
from accept.workflow.session.entries import entry_words
from accept.workflow.steps.plan import WorkflowStep

_TEXT, _WRONG, _FILE, _SHOWN = range(4)
_ANSWERS = {_WRONG: ("y", "n", "yes", "no"), _SHOWN: ("y", "n", "p", "yes", "no")}


def note_saved(screen: Scanning, event: Event) -> None:
    """Tell what became of a note; that it holds the unit stays at the foot."""
    screen.tell(Toast(saved_title(event, "Note saved"), entry_words(event)))
    if event.data.get("nonconformance"):
        screen.say("The unit is held until quality assurance decides", "doubt")


def ask_note(screen: Scanning, step: WorkflowStep, then: Callable[[Event], None]) -> AwaitMount:
    """Ask for a note on a step and keep it; awaited, keys that follow wait for the question. A nonconformance is what
    was found wrong with the part. A photo that was just taken is proposed."""
    session, records = screen.session, screen.bench.records
    noted = {f.name for each in session.steps for note in session.state(each.name).notes for f in note.files}
    photo = new_photo(records)
    lines = (
        QuestionLine("Note"),
        QuestionLine("Nonconformance of the part? y or n", value="n"),
        QuestionLine("Photo or file: path, pasted or dropped here; empty: none", value="" if photo in noted else photo),
        QuestionLine("On the certificate? y, n, or p: with the picture printed", value="y"),
    )

    def problem(place: int, given: list[str]) -> str:
        if place == _FILE and given[_FILE].strip() and not (path := parse_path(given[_FILE], records)).is_file():
            return f"{path}: no such file"
        shown, file = given[_SHOWN].strip().lower()[:1], given[_FILE].strip()
        if place in _ANSWERS and given[place].strip().lower() not in _ANSWERS[place]:
            return f"'{given[place].strip()}': expected {', '.join(a for a in _ANSWERS[place] if len(a) == 1)}"
        if place == _SHOWN and _is_yes(given[_WRONG]) and shown not in ("y", "p"):
            return "A nonconformance is always on the certificate"
        if place == _SHOWN and shown == "p" and not file:
            return "There is no picture to print"
        return "" if place != _TEXT or given[_TEXT].strip() else "Type the note first"

    def keep(answer: list[str] | None) -> None:
        if answer is not None:
            files = [parse_path(answer[_FILE], records)] if answer[_FILE].strip() else []
            wrong, shown = _is_yes(answer[_WRONG]), answer[_SHOWN].strip().lower()[:1]
            internal, printed = shown not in ("y", "p"), shown == "p"
            screen.send(lambda: session.entries.note(step.name, answer[_TEXT], wrong, files, internal, printed), then)

    earlier = "\n".join(map(note_words, session.state(step.name).notes))
    return screen.app.push_screen(Question(f"Note on {step.title}", earlier or "No notes yet.", lines, problem), keep)


def note_words(note: StepNoted) -> str:
    """Return a note as the screens show it, with the names of its files."""
    files = f" [{', '.join(file.name for file in note.files)}]" if note.files else ""
    internal = ", not on the certificate" if note.internal else ""
    internal += ", printed on the certificate" if note.pictures else ""
    return f"{'! ' if note.nonconformance else '✎ '}{note.text}{files} ({note.who}{internal})"


def _is_yes(answer: str) -> bool:
    return answer.strip().lower().startswith("y")
