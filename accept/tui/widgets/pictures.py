"""Pictures of a step: as many as the screen is wide for, the others behind a key."""

from collections.abc import Mapping

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Label

from accept.tui.widgets.plot import WIDE_FROM, PanelView
from checks.picture import Panel


class Pictures(Vertical):
    """Shows panels beside each other, from the chosen one on."""

    def __init__(self) -> None:
        super().__init__(id="pictures")
        self._panels: tuple[Panel, ...] = ()
        self._first = 0

    def compose(self) -> ComposeResult:
        yield Label("", classes="quiet", id="which")
        yield Horizontal(classes="panels")

    def show(self, panels: Mapping[str, Panel]) -> None:
        """Show these from now on; the chosen place stays."""
        given = tuple(panels.values())
        if len(given) == len(self._panels) and all(a is b for a, b in zip(given, self._panels, strict=True)):
            return
        self._panels = given
        self._draw()

    def next(self) -> None:
        """The next one first."""
        self._first += 1
        self._draw()

    def on_resize(self) -> None:
        """Another width may have room for another number."""
        if len(self.query(PanelView)) != len(self._shown()):
            self._draw()

    def _shown(self) -> list[Panel]:
        many = 2 if self.app.size.width >= WIDE_FROM else 1
        count = len(self._panels)
        return [self._panels[(self._first + i) % count] for i in range(min(many, count))]

    def _draw(self) -> None:
        """As a message to itself, one after the other; not as a worker: to cancel one that waits for the old panels to
        go would cancel their tasks, and with them those of the screen and of the whole program."""
        if self.is_attached and self.query("#which"):
            self.call_later(self._redraw)

    async def _redraw(self) -> None:
        shown, count = self._shown(), len(self._panels)
        self.display = bool(shown)
        words = f"picture {self._first % count + 1} of {count}, F7: next" if count > len(shown) else ""
        self.query_one("#which", Label).update(words)
        holder = self.query_one(".panels")
        await holder.remove_children()
        if holder.is_attached:  # left while the old ones went
            await holder.mount(*(PanelView(panel) for panel in shown))
