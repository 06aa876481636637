"""The bar on top of every screen of a unit: which unit, which attempt, under which spec, by whom, how far."""

from rich.text import Text
from textual.widgets import Static

from accept.workflow.session import Session
from accept.workflow.status import Status


class UnitBar(Static):
    """One line; what is longer than the screen is cut behind the operator's name."""

    def __init__(self, session: Session, where: str = "") -> None:
        super().__init__("", id="unit", markup=False)
        self._session, self._where = session, where

    def on_mount(self) -> None:
        self.show()

    def show(self) -> None:
        """As it is now."""
        session = self._session
        done = sum(session.status(step) not in (Status.NOT_DONE, Status.TAKEN) for step in session.steps)
        text = Text.assemble((f" {session.serial} ", "reverse bold"), "  ", (f"attempt {session.attempt.number}", ""))
        for words in (self._where, f"{done} of {len(session.steps)} steps", session.operator, session.spec.title):
            text.append("  ·  ", "dim").append(words) if words else None
        text.no_wrap, text.overflow = True, "ellipsis"
        self.update(text)
