"""The pictures of a step on the whole screen, one after the other; a phase stands under its magnitude."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import Screen
from textual.widgets import Label

from accept.base.atomic_files import write_atomic
from accept.pictures.words import pretty
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.plot import PanelView
from checks.picture import Line, Panel, PanelKind

_DRAWN = "plots.svg"


class Plots(Screen[None]):
    """Shows the panels of one step; arrows go from one to the next."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("right,pagedown,space", "turn(1)", "Next plot"),
        Binding("f7", "turn(1)", "Plot", show=False),
        Binding("left,pageup,backspace", "turn(-1)", "Previous plot"),
        Binding("f2", "draw_large", "File"),
        Binding("escape,enter", "leave", "Back"),
        Binding("f1", "app.help", "Help"),
    ]

    def __init__(
        self, panels: Mapping[str, Panel], folder: Path, draw: Callable[[Sequence[Panel], int], bytes]
    ) -> None:
        """Make the screen. folder: for pictures at full resolution; draw: returns one, from panels in columns."""
        super().__init__()
        self._panels, self._folder, self._drawing = panels, folder, draw
        self._pages, self._at = pages(panels), 0

    def compose(self) -> ComposeResult:
        yield Label("", classes="title", id="which", markup=False)
        yield Vertical(id="drawn")
        yield KeyRow()

    async def on_mount(self) -> None:
        await self._draw()

    async def action_turn(self, way: int) -> None:
        self._at = (self._at + way) % len(self._pages)
        await self._draw()

    async def _draw(self) -> None:
        shown = self._pages[self._at]
        self.query_one("#which", Label).update(f"Plot {self._at + 1} of {len(self._pages)}: {pretty(shown[0].title)}")
        holder = self.query_one("#drawn")
        await holder.remove_children()
        if holder.is_attached:  # left while the old ones went
            await holder.mount(*(PanelView(panel, titled=n > 0) for n, panel in enumerate(shown)))

    def check_action(self, action: str, _: tuple[object, ...]) -> bool:
        """Leave the keys to other plots out if there are none."""
        return action != "turn" or len(self._pages) > 1

    def action_draw_large(self) -> None:
        """Draw the panels as the certificate has them: in a browser they are shown there, else written to a file."""
        self.run_worker(self._draw_large, thread=True, exclusive=True)

    def _draw_large(self) -> None:
        panels = list(self._panels.values())
        content = self._drawing(panels, min(2, len(panels)))  # in a thread: it takes a second to load
        path = self._folder / _DRAWN
        if not self.app.is_web:
            write_atomic(path, content)
        self.app.call_from_thread(self._deliver, content, path)

    def _deliver(self, content: bytes, path: Path) -> None:
        if self.app.is_web:
            kind = "image/svg+xml"
            self.app.deliver_binary(BytesIO(content), save_filename=_DRAWN, open_method="browser", mime_type=kind)
        for label in self.query("#which").results(Label):
            label.update("Full resolution: in its own tab" if self.app.is_web else f"Written to {path}")

    def action_leave(self) -> None:
        if self.is_current:
            self.dismiss(None)

    def help_text(self) -> str:
        return (
            "The plots of this step. Arrow keys or F7: next plot. F2: all at full resolution, in a file or in the "
            "browser. The phase is drawn below its magnitude."
        )


def pages(panels: Mapping[str, Panel]) -> list[tuple[Panel, ...]]:
    """Return what is seen at once: a response with the phase of its record below it, everything else alone."""
    phase = next((panel for panel in panels.values() if panel.kind is PanelKind.PHASE), None)
    found = []
    for name, panel in panels.items():
        channel = name.removesuffix(" magnitude")
        lines = () if phase is None else tuple(i for i in phase.items if not isinstance(i, Line) or i.label == channel)
        own = any(isinstance(item, Line) for item in lines) and panel.kind is PanelKind.RESPONSE
        under = (replace(phase, title=f"phase of {channel}", items=lines),) if own and phase is not None else ()
        found.append((panel, *under))
    return found
