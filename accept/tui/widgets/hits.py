"""A hammer test while it is recorded: what to do now, every hit with force and verdict, and what the good ones show."""

import math
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Static

from accept.tui.widgets.card import Card
from accept.tui.widgets.limit_bar import block, share_bar
from accept.tui.widgets.plot import PanelView
from checks.picture import Line, Panel, PanelKind

if TYPE_CHECKING:
    from checks.acceptance import HitsSoFar

HIT, WAIT, ENOUGH = "H I T   N O W", "W A I T ,  it decays", "E N O U G H"
_GOOD, _BAD, _OPEN = ("✓", "green"), ("✗", "bold red"), ("○", "dim")
_COHERENCE_BAR = 20  # columns
_BARS, _HIGH_FROM = 6, 32  # rows of the force of each hit, and of a terminal that has room for them
_ROOMY_FROM, _OTHER_ROWS = 45, 26  # rows of a terminal with room for higher ones, and of all else there
_NARROW_BAR, _WIDE_BAR, _WORDS = 2, 8, 30  # columns: from bar to bar, and of the words behind them


class Hits(Horizontal):
    """Takes the place of the step while its hits are recorded. where: the drawing of the places."""

    def __init__(self, where: str) -> None:
        super().__init__(id="hits")
        self._where = where
        self._last: tuple[str, HitsSoFar] | None = None  # shown

    def compose(self) -> ComposeResult:
        with Vertical(id="struck", classes="card live"):
            yield Static("", id="cue", markup=False)
            yield Static("", id="marks", markup=False)
        with Vertical(id="beside"):
            with Card(title="Where", id="where"):
                yield Static(self._where, markup=False)
            yield PanelView(Panel("Response so far", "", "", ()))

    def on_mount(self) -> None:
        self.query_one(PanelView).display = False

    def on_resize(self) -> None:
        if self._last is not None:
            self.show(*self._last)

    def show(self, place: str, so_far: "HitsSoFar") -> None:
        self._last = place, so_far
        struck, cue = self.query_one("#struck"), cue_of(so_far)
        struck.border_title, struck.border_subtitle = f"{place}: hits", "● recording"
        shown = self.query_one("#cue", Static)
        shown.update(Text(cue, "bold"))
        shown.set_class(cue == HIT, "now")
        high, marks = self.app.size.height, self.query_one("#marks", Static)
        rows = high - _OTHER_ROWS if high >= _ROOMY_FROM else _BARS if high >= _HIGH_FROM else 1
        room = (marks.size.width - _WORDS) // max(1, len(so_far.hits) + so_far.more)
        marks.update(hits_text(so_far, rows, room if high >= _ROOMY_FROM else _NARROW_BAR))
        panel, view = response_panel(so_far), self.query_one(PanelView)
        view.display = panel is not None
        if panel is not None:
            view.show(panel)


def cue_of(so_far: "HitsSoFar") -> str:
    """Return what is to be done at this moment."""
    if so_far.coming:
        return WAIT
    return HIT if so_far.more else ENOUGH


def hits_text(so_far: "HitsSoFar", rows: int = 1, wide: int = _NARROW_BAR) -> Text:
    """Return a mark and a bar of its force for each hit, what is still needed, the last hit, and the coherence if
    it is known. rows: of the highest bar; wide: columns from one bar to the next."""
    wide = max(_NARROW_BAR, min(wide, _WIDE_BAR))
    hits, forces = so_far.hits, np.array([hit.force_N for hit in so_far.hits])
    signs = [*(_GOOD if hit.good else _BAD for hit in hits), *[_OPEN] * so_far.more]
    text = Text("\n")
    for mark, style in signs:
        text.append(mark.ljust(wide), style)
    more = f"{so_far.more} to go" if so_far.more else "enough"
    text.append(f"  {so_far.good} good, {more}\n", "bold")
    if not hits:
        return text
    for row in reversed(range(rows)):
        for hit, share in zip(hits, rows * forces / forces.max() - row, strict=True):
            bar = block(min(share, 1.0), 0.0, 1.0) if share > 0.0 else " "
            text.append(f"{bar * (wide - 1)} ", (_GOOD if hit.good else _BAD)[1])
        text.append("" if row else f"  force, {forces.min():.3g} to {forces.max():.3g} N", "dim").append("\n")
    last = hits[-1]
    mark, style = _GOOD if last.good else _BAD
    told = "single hit" if last.good else f"{last.fault} ({last.detail})" if last.detail else str(last.fault)
    text.append(f"\nlast   {mark} {last.force_N:.3g} N  ", style).append(told, style)
    if math.isfinite(so_far.coherence):
        text.append("\n\ncoherence  ", "dim").append_text(share_bar([(so_far.coherence, "green")], 1.0, _COHERENCE_BAR))
        text.append(f"  {so_far.coherence:.3f}", "bold")
    return text


def response_panel(so_far: "HitsSoFar") -> Panel | None:
    """Return the response of the good hits in the band that they are asked for, None before there are two."""
    if so_far.frf is None:
        return None
    f, size = so_far.frf.f, np.abs(so_far.frf.H)
    inside = (f >= so_far.band_Hz[0]) & (f <= so_far.band_Hz[1]) & (f > 0.0)
    if np.count_nonzero(inside) < 2:
        return None
    line = Line(f[inside], size[inside], f"{so_far.good} hits", role="data")
    return Panel("Response so far", "frequency [Hz]", "response / force", (line,), y_log=True, kind=PanelKind.RESPONSE)
