"""The list of steps of a unit: what is done, what it showed, what comes next."""

from importlib import import_module
from types import ModuleType
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import DataTable, Footer, Label, Static

from accept.store import Event
from accept.tui.background.busy_screen import Working
from accept.tui.screens.derived_step import DerivedScreen
from accept.tui.screens.gap import TITLE, Explain, headline
from accept.tui.screens.notes import ask_note
from accept.tui.screens.step import StepScreen
from accept.tui.widgets.limit_bar import numbers
from accept.tui.widgets.plot import WIDE_FROM
from accept.workflow.bench import Workbench
from accept.workflow.session import Session
from accept.workflow.status import Status
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.section import missing_labels
from checks.verdict import Verdict

GAP = "gap"  # the row that no check stands behind
_OTHER_COLUMNS = 1 + 11 + 2 * 4  # mark, status, and the padding of all four


class Steps(Working[bool]):
    """Dismisses True when the next unit is wanted, False when this one is left as it is."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f5", "note", "Note"),
        Binding("ctrl+z", "undo", "Undo"),  # no letter: a serial that is scanned here must not undo anything
        Binding("f9,s", "summary", "Summary"),
        Binding("escape", "leave", "Other unit"),
        Binding("home", "to_row(0)", show=False, priority=True),  # a table's own go to the first and last column
        Binding("end", "to_row(-1)", show=False, priority=True),
    ]

    def __init__(self, bench: Workbench, session: Session, words: str = "") -> None:
        """words: what the start has to say, such as a record that could not be taken."""
        super().__init__()
        self.bench, self.session, self._words = bench, session, words

    def compose(self) -> ComposeResult:
        attempt = self.session.attempt
        spec = self.session.spec
        words = f"{self.session.serial}  attempt {attempt.number}  ·  {spec.title}  ·  {self.session.operator}"
        yield Label(words, classes="title", markup=False)
        yield DataTable(id="steps", cursor_type="row", zebra_stripes=True)
        yield Static("", id="detail", markup=False)
        yield Label("", id="status")
        yield Footer(compact=True)

    def on_mount(self) -> None:
        if not self.alive:
            return
        table = self.query_one(DataTable)
        table.add_column("", key="mark", width=1)
        table.add_column("step", key="title", width=self._for_titles())
        table.add_column("status", key="status", width=11)
        table.add_column("result", key="more", width=self._room())
        for step in self.session.steps:
            table.add_row("", step.title, "", "", key=step.name)
        if self.session.responses is not None:
            table.add_row("", TITLE, "", "", key=GAP)
        self._show()
        self._stand_at_next()
        self.say(self._words or "Enter: open the step", "bad" if self._words else "quiet")
        self.aside(lambda: import_module("accept.tui.screens.summary"), lambda _: None, "import")

    def on_screen_resume(self) -> None:
        self._show()

    def _show(self) -> None:
        if not self.alive or not self.query_one(DataTable).row_count:
            return
        table = self.query_one(DataTable)
        for step in self.session.steps:
            status = self.session.status(step)
            colour = status.style
            required = "" if step.required else " (not required)"
            table.update_cell(step.name, "mark", Text(status.mark, colour))
            table.update_cell(step.name, "title", _cut(Text(step.title + required), self._for_titles()))
            table.update_cell(step.name, "status", Text(status.word, colour))
            table.update_cell(step.name, "more", _cut(Text(self._more(step, status), "dim"), self._room()))
        self._show_gap(table)

    def _show_gap(self, table: DataTable[object]) -> None:
        """The row of what is missing from the model: it has no verdict, but a mark and words all the same."""
        if self.session.responses is None:
            return
        found = self.session.gap
        status = Status.NOT_DONE if found is None else Status.TAKEN
        table.update_cell(GAP, "mark", Text(status.mark, status.style))
        table.update_cell(GAP, "status", Text("not run" if found is None else "done", status.style))
        table.update_cell(GAP, "more", Text("") if found is None else _cut(headline(found), self._room()))

    def _for_titles(self) -> int:
        return 32 if self.app.size.width < WIDE_FROM else 64

    def _room(self) -> int:
        """Columns for what a step showed: what is longer is cut there and stands below in full."""
        return max(16, self.app.size.width - self._for_titles() - _OTHER_COLUMNS)

    def on_resize(self) -> None:
        for table in self.query(DataTable):
            for column in table.ordered_columns:
                widths = {"more": self._room(), "title": self._for_titles()}
                column.width = widths.get(str(column.key.value), column.width)
        self._show()

    def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        """The whole of what a narrow table cuts off."""
        if event.row_key.value == GAP:
            self.query_one("#detail", Static).update("names what the model does not explain; for information")
            return
        step = self.session.steps[event.cursor_row]
        more = self._more(step, self.session.status(step))
        self.query_one("#detail", Static).update(f"{step.title}{': ' if more else ''}{more}")

    def _more(self, step: WorkflowStep, status: Status) -> str:
        judgement = self.session.judgement(step.name)
        state = self.session.state(step.name)
        notes = " ✎" if state.notes else ""
        if status is Status.NOT_DONE:
            return f"measure again: {state.reasons[-1]}{notes}" if state.reasons else notes
        if judgement is None or status is Status.TAKEN:
            wanted = ", ".join(missing_labels(step, state))
            return (f"missing: {wanted}" if wanted else "complete, not judged yet") + notes
        worst = [f for f in judgement.findings if f.verdict is not Verdict.PASS] or list(judgement.findings)
        shown = (f.quantity if f.value is None else numbers(f.value, f.U, f.unit) for f in worst[:2])
        return ", ".join(shown) + notes

    def _stand_at_next(self) -> None:
        step = self.session.next_step()
        table = self.query_one(DataTable)
        if step is not None:
            table.move_cursor(row=table.get_row_index(step.name))

    def _current(self) -> WorkflowStep:
        row = self.query_one(DataTable).cursor_row
        return self.session.steps[row] if row < len(self.session.steps) else self.session.step("frf")

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        name = str(event.row_key.value)
        if name == GAP:
            self.app.push_screen(Explain(self.bench, self.session), self._back)
        else:
            kind = DerivedScreen if self.session.step(name).derived else StepScreen
            self.app.push_screen(kind(self.bench, self.session, name), self._back)

    def _back(self, _: bool | None) -> None:
        self._show()
        self._stand_at_next()

    def action_to_row(self, row: int) -> None:
        table = self.query_one(DataTable)
        table.move_cursor(row=row % table.row_count)

    def action_note(self) -> None:
        step = self._current()
        ask_note(self, self.session, step, self._noted)

    def _noted(self, _: Event) -> None:
        self._show()
        self.say("Note saved", "good")

    def action_undo(self) -> None:
        self.send(self.session.undo, self._undone, "undoing")

    def _undone(self, _: Event) -> None:
        self._show()
        self.say("Last entry undone; the record keeps both", "good")

    def action_summary(self) -> None:
        """Drawing and signing take a second to import: in a thread, while the screen answers."""
        self.send(lambda: import_module("accept.tui.screens.summary"), self._sum_up, "one moment")

    def _sum_up(self, module: ModuleType) -> None:
        if self.is_current:
            self.app.push_screen(module.Summary(self.bench, self.session), self._summed)

    def _summed(self, finished: bool | None) -> None:
        self._show()
        if finished:
            self.leave(True)

    def action_leave(self) -> None:
        self.leave(False)

    def help_text(self) -> str:
        marks = "\n".join(f"  {status.mark}  {status.word}" for status in Status)
        return f"You can do the steps in any order. The cursor is on the first incomplete step.\n\n{marks}"


def _cut(text: Text, width: int) -> Text:
    text.truncate(width, overflow="ellipsis")
    return text
