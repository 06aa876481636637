"""Pictures of a step beside each other where the screen is wide; the whole screen shows them behind a key."""

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
        self.panels: Mapping[str, Panel] = {}
        self._panels: tuple[Panel, ...] = ()

    def compose(self) -> ComposeResult:
        yield Label("", classes="quiet", id="which")
        yield Horizontal(classes="panels")

    def show(self, panels: Mapping[str, Panel]) -> None:
        self.panels = dict(panels)
        given = tuple(panels.values())
        if len(given) == len(self._panels) and all(a is b for a, b in zip(given, self._panels, strict=True)):
            return
        self._panels = given
        self._draw()

    def on_resize(self) -> None:
        """Draw again: another width may have room for another number."""
        if len(self.query(PanelView)) != len(self._shown()):
            self._draw()

    def _shown(self) -> list[Panel]:
        return list(self._panels[:2]) if self.app.size.width >= WIDE_FROM else []

    def _draw(self) -> None:
        """Draw by a message to itself, one after the other; not as a worker: to cancel one that waits for the old
        panels to go would cancel their tasks, and with them those of the screen and of the whole program."""
        if self.is_attached and self.query("#which"):
            self.call_later(self._redraw)

    async def _redraw(self) -> None:
        shown, count = self._shown(), len(self._panels)
        self.display = bool(shown)
        words = f"F7: all {count} plots, on the whole screen" if count > len(shown) else "F7: plots on the whole screen"
        self.query_one("#which", Label).update(words)
        holder = self.query_one(".panels")
        await holder.remove_children()
        if holder.is_attached:  # left while the old ones went
            await holder.mount(*(PanelView(panel) for panel in shown))
