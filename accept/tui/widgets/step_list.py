"""On every screen of a unit: the bar on top and the steps on the left, each with its mark; a step in words."""

from collections.abc import Sequence

from rich.text import Text
from textual.widgets import DataTable, Static

from accept.pictures import signs
from accept.pictures.labels import check_label
from accept.store.payloads import without_hashes
from accept.tui.widgets.limit_bar import after_number, numbers
from accept.workflow.session import Session
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.section import missing_labels
from accept.workflow.steps.status import UNFINISHED, Status
from checks.rounding import rounded
from checks.verdict import Finding, Verdict

HELD = Status.HELD.style  # of what quality assurance must decide
GAP = "gap"  # the row that no check stands behind
GAP_TITLE = "Gap analysis"
GAP_ROW = "Gap (optional)"  # not among the steps that are counted
_TITLE, _RESULT = 16, 20  # columns
WIDE_FROM = 110  # columns of a terminal, as in the app's breakpoints


class StepList(DataTable[Text]):
    """A row per step: mark and short title; on a wide terminal also what it showed. live: whether keys move in it."""

    def __init__(self, session: Session, *, live: bool) -> None:
        super().__init__(id="steps", cursor_type="row", show_header=False, cell_padding=0)
        self._session = session
        self.can_focus = live

    def on_mount(self) -> None:
        self.add_column("", key="mark", width=3)
        self.add_column("step", key="title", width=_TITLE)
        self.add_column("result", key="more", width=self._room())
        for step in self._session.steps:
            self.add_row(Text(), Text(step.short), Text(), key=step.name)
        if self._session.gap.responses is not None:
            self.add_row(Text(), Text(GAP_ROW), Text(), key=GAP)
        self.show()

    def show(self) -> None:
        if not self.row_count:
            return
        for step in self._session.steps:
            status = self._session.judgements.status(step)
            held = any(note.nonconformance for note in self._session.state(step.name).notes)
            self._put(step.name, status, step.short, result_words(self._session, step, status), held)
        if self._session.gap.responses is not None:
            found = self._session.gap.found  # it has no verdict, but a mark all the same
            word = "" if found is None else signs.GAP[str(found["verdict"])].word
            self._put(GAP, Status.NOT_DONE if found is None else Status.TAKEN, GAP_ROW, word)

    def _put(self, row: str, status: Status, title: str, more: str, held: bool = False) -> None:
        """held: a nonconformance was noted there, which is red whatever was measured."""
        marked = Status.HELD if held and status in UNFINISHED else status
        mark, style = f" {marked.mark}", marked.style
        self.update_cell(row, "mark", Text(mark, style))
        plain = "dim" if status is Status.NOT_DONE else ""
        self.update_cell(row, "title", _cut(Text(title, HELD if held else plain), _TITLE))
        self.update_cell(row, "more", _cut(Text(more, "dim"), _RESULT))

    def stand_at(self, name: str) -> None:
        if name in {str(key.value) for key in self.rows}:
            self.move_cursor(row=self.get_row_index(name))

    def on_resize(self) -> None:
        for column in self.ordered_columns:
            if column.key.value == "more":
                column.width = self._room()
        self.refresh()

    def _room(self) -> int:
        return _RESULT if self.app.size.width >= WIDE_FROM else 0


def held_words(nonconformances: Sequence[str]) -> Text:
    """Return what holds a unit, in red; empty if nothing does."""
    if not nonconformances:
        return Text()
    return Text().append(f"HELD by a nonconformance at {where_held(nonconformances)}. Quality assurance decides.", HELD)


def where_held(nonconformances: Sequence[str]) -> str:
    """Return what nonconformances say, each with its step as people read it in place of the code name in front."""
    parts = (without_hashes(words).partition(": ") for words in nonconformances)
    return "; ".join(f"{check_label(step)}{colon}{words}" for step, colon, words in parts)


def result_words(session: Session, step: WorkflowStep, status: Status) -> str:
    """Return the first finding that is no pass, else the first: its number."""
    judgement = session.judgements.of_step(step.name)
    notes = "✎ " if session.state(step.name).notes else ""
    if judgement is None or status in UNFINISHED:
        return f"{notes}{status.word if status is Status.REFUSED else ''}"
    worst = [f for f in judgement.findings if f.verdict is not Verdict.PASS] or list(judgement.findings)
    return notes + "".join(_number(f, status) for f in worst[:1])


def _number(f: Finding, status: Status) -> str:
    """Return what was found; without its U where both have no room."""
    if f.value is None:
        return status.word
    whole = numbers(f.value, f.U, f.unit)
    return whole if len(whole) <= _RESULT else f"{rounded(f.value, f.U)}{after_number(f.unit)}"


def _cut(text: Text, width: int) -> Text:
    text.truncate(width, overflow="ellipsis")
    return text


def head(session: Session, step: WorkflowStep) -> Text:
    """Return number, state and title, which is never cut."""
    status = session.judgements.status(step)
    number = 1 + [s.name for s in session.steps].index(step.name)
    text = Text().append(f"{number}/{len(session.steps)}  ", "dim")
    text.append(f"{status.mark} {status.word}", status.style)
    text.append("  ·  ", "dim").append(step.title, "bold")
    return text if step.asked.required else text.append("  (not required)", "dim")


def setup(step: WorkflowStep) -> Text:
    """Return with which instrument, and who starts the drive at which amplitude."""
    text = Text()
    for label, words in (("Instrument", step.asked.instrument or ""), ("Drive", step.guide.drive)):
        if words:
            text.append(f"{label}: ", "bold").append(f"{words}\n", "")
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
        self.update(next((line for line in lines if line.cell_len <= self.size.width), lines[-1]))

    on_mount = on_resize = show

    def _line(self, spec: str) -> Text:
        session = self._session
        done = sum(session.judgements.status(step) not in UNFINISHED for step in session.steps)
        count = f"{done} of {len(session.steps)} steps{'' if session.gap.responses is None else ', gap optional'}"
        text = Text.assemble((f" {session.serial} ", "reverse bold"), "  ", (f"attempt {session.attempt.number}", ""))
        for words in (self._where, count, session.operator, spec):
            text.append("  ·  ", "dim").append(words) if words else None
        text.no_wrap, text.overflow = True, "ellipsis"
        return text
