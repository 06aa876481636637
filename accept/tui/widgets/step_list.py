"""On every screen of a unit: the bar on top and the steps on the left, each with its mark; a step in words."""

import re
from collections.abc import Sequence

from rich.text import Text
from textual.coordinate import Coordinate
from textual.events import Click
from textual.message import Message
from textual.widgets import DataTable, Static

from accept.pictures import signs
from accept.pictures.labels import check_label
from accept.pictures.words import pretty
from accept.store.payloads import without_hashes
from accept.tui.widgets.card import entitle
from accept.tui.widgets.limit_bar import after_number
from accept.workflow.session import Session
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.section import counted, missing_labels
from accept.workflow.steps.status import UNFINISHED, Status
from checks.rounding import rounded
from checks.verdict import Verdict

HELD = Status.HELD.style  # of what quality assurance must decide
GAP = "gap"  # the row that no check stands behind
GAP_TITLE = "Gap analysis"
GAP_ROW = "Gap (optional)"  # not among the steps that are counted
WIDE_FROM = 100  # columns of a terminal, as in the app's breakpoints
_SENTENCE = re.compile(r"(?<=[.!]) (?=[A-Z])")
_MARK, _TITLE, _ROOM = 2, 16, 22  # columns of the list: mark, title alone, title with what was found


class StepList(DataTable[Text]):
    """A row per step: mark, short title and, on a wide terminal, what it showed. live: whether keys move in it; beside
    a step that is open a small terminal has room for the marks."""

    def __init__(self, session: Session, *, live: bool) -> None:
        super().__init__(id="steps", cursor_type="row", show_header=False, cell_padding=0, classes="card")
        self._session, self._live = session, live
        self.can_focus = live

    class Wanted(Message):
        """A step was pointed at."""

        def __init__(self, name: str) -> None:
            super().__init__()
            self.name = name

    def on_click(self, event: Click) -> None:
        """Ask for a step beside which another one is open."""
        row = event.style.meta.get("row", -1)
        if not self._live and 0 <= row < self.row_count:
            event.prevent_default().stop()
            self.post_message(self.Wanted(str(self.coordinate_to_cell_key(Coordinate(row, 0)).row_key.value)))

    def on_mount(self) -> None:
        self.add_column("", key="mark", width=_MARK)
        self.add_column("step", key="title", width=self._room())
        for step in self._session.steps:
            self.add_row(Text(), Text(step.short), key=step.name)
        if self._session.gap.responses is not None:
            self.add_row(Text(), Text(GAP_ROW), key=GAP)
        self.show()

    def show(self) -> None:
        if not self.row_count:
            return
        done = 0
        for step in self._session.steps:
            status = self._session.judgements.status(step)
            held = any(note.nonconformance for note in self._session.state(step.name).notes)
            self._put(step.name, status, step.short, result_words(self._session, step, status), held)
            done += status not in UNFINISHED
        if self._session.gap.responses is not None:
            found = self._session.gap.found  # it has no verdict, but a mark all the same
            if found is None:
                self._put(GAP, Status.NOT_DONE, GAP_ROW, ())
            else:
                word = signs.GAP[str(found["verdict"])].word
                self._put(GAP, Status.TAKEN, "Gap", (word, word.replace("possible ", "")))
        entitle(self, *(("Steps", f"{done} of {len(self._session.steps)}") if self._room() else ("",)))

    def _put(self, row: str, status: Status, title: str, more: Sequence[str], held: bool = False) -> None:
        """Fill a row. more: what was found, the longest first; held: a nonconformance was noted there, which is red
        whatever was measured."""
        marked = Status.HELD if held and status in UNFINISHED else status
        # With few colours the cursor turns them round: quiet words would be grey on grey.
        quiet, room = "" if self.app.has_class("-few-colours") else "dim", self._room()
        plain = quiet if status is Status.NOT_DONE else ""
        self._set(row, "mark", Text(marked.mark, plain or marked.style.replace("dim", "")))
        text = Text(title, HELD if held else plain)
        fits = next((words for words in more if len(title) + 1 + len(words) <= room), "")
        text.append(fits.rjust(room - len(title)), "" if status is Status.PASS else status.style)
        text.truncate(room, overflow="ellipsis")
        self._set(row, "title", text)

    def _set(self, row: str, column: str, text: Text) -> None:
        """Draw a cell only if it has changed: the list stands beside what is typed."""
        if self.get_cell(row, column) != text:
            self.update_cell(row, column, text)

    def stand_at(self, name: str) -> None:
        if name in {str(key.value) for key in self.rows}:
            self.move_cursor(row=self.get_row_index(name))

    def on_resize(self) -> None:
        for column in self.ordered_columns:
            if column.key.value == "title":
                column.width = self._room()
        self.show()
        self.refresh()

    def _room(self) -> int:
        wide = self.app.size.width >= WIDE_FROM
        return _ROOM if wide else _TITLE if self._live else 0


def held_words(nonconformances: Sequence[str]) -> Text:
    """Return what holds a unit, in red; empty if nothing does."""
    if not nonconformances:
        return Text()
    return Text().append(f"HELD by a nonconformance at {where_held(nonconformances)}. Quality assurance decides.", HELD)


def where_held(nonconformances: Sequence[str]) -> str:
    """Return what nonconformances say, each with its step as people read it in place of the code name in front."""
    parts = (without_hashes(words).partition(": ") for words in nonconformances)
    return "; ".join(f"{check_label(step)}{colon}{words}" for step, colon, words in parts)


def result_words(session: Session, step: WorkflowStep, status: Status) -> Sequence[str]:
    """Return what a step showed, the longest form first: every value, then the first that is no pass, else the first,
    in fewer and fewer letters. Before that, how many of its entries are there."""
    judgement = session.judgements.of_step(step.name)
    note = "✎ " if session.state(step.name).notes else ""
    if judgement is None or status in UNFINISHED:
        state = session.state(step.name)
        taken, wanted = counted(step.form(state.form), state)
        word = status.word if status is Status.REFUSED else f"{taken} of {wanted}" if taken and not step.derived else ""
        return f"{note}{word}", note
    found = judgement.findings
    first = next((f for f in found if f.verdict is not Verdict.PASS), found[0] if found else None)
    if first is None:
        return (note,)
    if first.value is None:
        return f"{note}{status.word}", note
    short, of = min(f"{first.value:.3g}", rounded(first.value, first.U), key=len), after_number(first.unit)
    every = [f"{f.value:.3g}" for f in found if f.value is not None]
    together = [" · ".join(every)] if len(every) == len(found) == 2 and found[0].unit == found[1].unit else []
    return tuple(f"{note}{words}" for words in (*together, f"{short}{of}", short))


def head(session: Session, step: WorkflowStep) -> tuple[str, Sequence[tuple[str, str]]]:
    """Return the title of a step, and its state and number for the other end of the same line."""
    status = session.judgements.status(step)
    number = 1 + [s.name for s in session.steps].index(step.name)
    state = (f"{status.mark} {status.word}", status.style), (f" · {number} of {len(session.steps)}", "not bold dim")
    return step.title if step.asked.required else f"{step.title} (not required)", state


def what_to_do(words: str) -> Text:
    """Return instructions as numbered lines, one for each sentence."""
    sentences = _SENTENCE.split(words)
    text = Text()
    for number, sentence in enumerate(sentences, 1):
        text.append(f"{number} " if len(sentences) > 1 else "", "bold yellow").append(f"{sentence}\n")
    text.rstrip()
    return text


def setup(step: WorkflowStep) -> Text:
    """Return with which instrument, and who starts the drive at which amplitude."""
    text = Text()
    for label, words in (("Instrument", step.asked.instrument or ""), ("Drive", step.guide.drive)):
        if words:
            text.append(f"{label}: {pretty(words)}\n", "dim")
    text.rstrip()
    return text


def standing(session: Session, step: WorkflowStep) -> str:
    """Return where a step stands that is not judged: what is missing, why it is measured again."""
    status, state = session.judgements.status(step), session.state(step.name)
    if status is Status.NOT_DONE:
        return f"Measure again ({state.reasons[-1]})" if state.reasons else ""
    if session.judgements.of_step(step.name) is None or status is Status.TAKEN:
        wanted = ", ".join(missing_labels(step, state))
        refused = [f"{record.line}\n→ {record.action}" for record in state.refused.values()]
        done = (
            "Complete, not judged yet"
            if step.check.model is None
            else "Not compared yet. Enter: compare with the model"
        )
        return "\n".join([*refused, f"Missing: {wanted}" if wanted else done])
    return ""


class UnitBar(Static):
    """One line. Where the spec's title does not fit, its name stands there, or nothing; what is still longer than the
    screen is cut at the end."""

    def __init__(self, session: Session, where: str = "") -> None:
        super().__init__("", id="unit", markup=False)
        self._session, self._where = session, where

    def show(self) -> None:
        spec = self._session.spec
        lines = [self._line(words) for words in (spec.title, f"spec {spec.name}", "")]
        room = self.size.width or self.app.size.width - self.gutter.width  # before the first layout
        self.update(next((line for line in lines if line.cell_len <= room), lines[-1]))

    on_mount = on_resize = show

    def _line(self, spec: str) -> Text:
        session = self._session
        done = sum(session.judgements.status(step) not in UNFINISHED for step in session.steps)
        count = f"{done} of {len(session.steps)} steps{'' if session.gap.responses is None else ', gap optional'}"
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append("◆ accept  " if self.app.size.width >= WIDE_FROM else "", "bold yellow")
        text.append(f" {session.serial} ", "reverse bold").append(f"  attempt {session.attempt.number}")
        for words in (self._where, count, session.operator, spec):
            text.append("  ·  ", "dim").append(words) if words else None
        return text
