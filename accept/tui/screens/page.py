"""The common parts of the screens of a step: unit and steps around, the instruction, entries and findings beside the
drawing or the plot, a line for the next key."""

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.events import Resize
from textual.widget import Widget
from textual.widgets import Label, Static

from accept.tui.background.scanning import Scanning
from accept.tui.screens.plots import Plots
from accept.tui.widgets.card import Card, entitle
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.pictures import Pictures
from accept.tui.widgets.step_list import WIDE_FROM, StepList, UnitBar, what_to_do
from accept.workflow.bench import Workbench
from accept.workflow.session import Session

_SLIM = 76  # columns below which nothing stands beside a form


class Page(Scanning):
    """A screen of a step. words: what to do here; row: its place in the list of steps."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("pageup", "page(-1)", show=False),
        Binding("pagedown", "page(1)", show=False),
    ]

    def __init__(self, bench: Workbench, session: Session, words: str, row: str) -> None:
        super().__init__(bench, session)
        self._words, self._row = words, row
        self.pictures = Pictures()
        self._behind: Widget | None = None  # what had the focus before the plot took the place of the form

    def compose(self) -> ComposeResult:
        yield UnitBar(self.session)
        with Horizontal(id="main"):
            yield StepList(self.session, live=False)
            with Vertical(id="pane"):
                with Card(title="", id="todo"):
                    yield Hanging(what_to_do(self._words), id="words")
                    yield Static("", id="setup", markup=False)
                with Horizontal(id="columns"):
                    with Vertical(id="form"):
                        yield from self.above()
                        with VerticalScroll(id="body", can_focus=False):
                            yield from self.parts()
                    with Vertical(id="side"):
                        yield from self.drawings()
                        with Vertical(id="plot"):
                            yield self.pictures
        yield Static("", id="said", markup=False)
        yield Label("", id="status")
        yield KeyRow()

    def above(self) -> ComposeResult:
        """Return the widgets above the body, which are always in sight."""
        yield from ()

    def parts(self) -> ComposeResult:
        raise NotImplementedError

    def drawings(self) -> ComposeResult:
        """Return the widgets beside the body before there is a plot."""
        yield from ()

    def entitle(self, title: str, state: Sequence[tuple[str, str]] | str = "") -> None:
        """Show the title of the page and its state."""
        entitle(self.query_one("#todo"), title, state)

    def show_around(self) -> None:
        """Show unit and steps, as they are now."""
        for bar in self.query(UnitBar):
            bar.show()
        for rail in self.query(StepList):
            rail.show()
            rail.stand_at(self._row)
        self.refresh_bindings()

    async def on_step_list_wanted(self, event: StepList.Wanted) -> None:
        if event.name != self._row:
            await self.bench_app.go_to_step(event.name)

    def on_resize(self, event: Resize) -> None:
        self.set_class(event.size.width < _SLIM, "-slim")
        self.pictures.on_resize()  # which hears of none itself while it is hidden

    def action_picture(self) -> None:
        """Show the pictures on the whole screen; on a small one first in place of the form."""
        panels = self.pictures.panels
        if not panels:
            self.say("No plot yet")
        elif self.app.size.width < WIDE_FROM and not self.pictures.is_tab:
            self._behind = self.focused
            self._show_tab(shown=True)
            self.say(f"F7: {'all plots' if len(panels) > 1 else 'it'} on the whole screen. Esc: back to the form")
        else:
            self.app.push_screen(Plots(panels, self.session.folder / "pictures", self.bench.services.draw))

    def leave_tab(self) -> bool:
        """Put the form back in the place of the plot. Returns whether the plot was there."""
        if not self.pictures.is_tab:
            return False
        self._show_tab(shown=False)
        self.set_focus(self._behind)
        return True

    def _show_tab(self, *, shown: bool) -> None:
        self.query_one("#main").set_class(shown, "tab")
        self.pictures.be_tab(shown)

    async def action_leave(self) -> None:
        if not self.leave_tab():
            await super().action_leave()
