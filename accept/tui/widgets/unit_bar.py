"""The bar on top of every screen of a unit: which unit, which attempt, under which spec, by whom, how far."""

from rich.text import Text
from textual.widgets import Static

from accept.workflow.session import Session
from accept.workflow.status import UNFINISHED


class UnitBar(Static):
    """One line. Where the spec's title does not fit, its name stands there, or nothing; what is still longer than the
    screen is cut at the end."""

    def __init__(self, session: Session, where: str = "") -> None:
        super().__init__("", id="unit", markup=False)
        self._session, self._where = session, where

    def on_mount(self) -> None:
        self.show()

    def on_resize(self) -> None:
        self.show()

    def show(self) -> None:
        """Show the unit as it is now."""
        spec = self._session.spec
        lines = [self._line(words) for words in (spec.title, f"spec {spec.name}", "")]
        self.update(next((line for line in lines if line.cell_len <= self.size.width), lines[-1]))

    def _line(self, spec: str) -> Text:
        session = self._session
        done = sum(session.status(step) not in UNFINISHED for step in session.steps)
        count = f"{done} of {len(session.steps)} steps{'' if session.responses is None else ', gap optional'}"
        text = Text.assemble((f" {session.serial} ", "reverse bold"), "  ", (f"attempt {session.attempt.number}", ""))
        for words in (self._where, count, session.operator, spec):
            text.append("  ·  ", "dim").append(words) if words else None
        text.no_wrap, text.overflow = True, "ellipsis"
        return text
