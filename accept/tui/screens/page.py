"""What the screens of a step share: head, words, a body that scrolls, pictures, a line that says what goes on."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Footer, Label, Static

from accept.tui.background.busy_screen import Working
from accept.tui.widgets.findings import Findings
from accept.tui.widgets.pictures import Pictures
from accept.workflow.bench import Workbench
from accept.workflow.session import Session


class Page(Working[bool]):
    """Its head is set through `#head`; words: what to do here."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("pageup", "page(-1)", show=False),
        Binding("pagedown", "page(1)", show=False),
    ]

    def __init__(self, bench: Workbench, session: Session, words: str) -> None:
        super().__init__()
        self.bench, self.session, self._words = bench, session, words

    def compose(self) -> ComposeResult:
        yield Label("", id="head", classes="title", markup=False)
        yield Static(self._words, id="words", markup=False)
        with VerticalScroll(id="body", can_focus=False):
            yield from self.parts()
            yield Pictures()
        yield Label("", id="status")
        yield Footer(compact=True)

    def parts(self) -> ComposeResult:
        """What stands in the body, above the pictures."""
        yield Findings(id="findings")

    def action_picture(self) -> None:
        self.query_one(Pictures).next()
        self.call_after_refresh(self.query_one("#body", VerticalScroll).scroll_end, animate=False)

    def action_page(self, way: int) -> None:
        body = self.query_one("#body", VerticalScroll)
        body.scroll_relative(y=way * max(1, body.size.height - 2), animate=False)

    def action_leave(self) -> None:
        """Back; what takes long is stopped first."""
        self.stop_or(lambda: self.leave(True))
