"""The checks' pictures in the terminal. textual-plot has no logarithmic axis: log10 is plotted, the ticks say what."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.events import Mount, Resize
from textual.widgets import Static
from textual_plot import HiResMode, NumericAxisFormatter, PlotWidget
from textual_plot.axis_formatter import AxisFormatter

from accept.tui.widgets.heat_map import map_left, map_text
from checks.arrays import Array
from checks.picture import Band, Heights, Image, Line, Mark, Panel, PanelKind, Span

ROLES = {
    "data": "bright_cyan",
    "model": "yellow",
    "before": "magenta",
    "good": "green",
    "bad": "bright_red",
    "limit": "red",
    "quiet": "bright_black",
}
SERIES = ("bright_cyan", "yellow", "magenta", "green", "bright_blue", "bright_red", "white")
_MOST_POINTS = 600  # a terminal is no wider
WIDE_FROM = 110  # columns, as in the app's breakpoints
_APART = {True: 40, False: 14}  # points on top of curves on a whole screen, beside others: so few that both are seen
_FEW = 60  # points by themselves: more of them are drawn small
_MARGIN = 0.02  # of what is drawn, on either side of it
_X_TICKS = 6  # numbers that never run into each other at 40 columns
_NARROWEST = 30  # columns of a map with its names
MAP_ROWS = 14  # of a map beside other parts of a screen


class Decades(AxisFormatter):
    """Ticks of log10 of a quantity: whole decades, with 2 and 5 between them if it spans at most `few`. rows: how many
    rows the axis has, so that no two numbers stand on one; None if it lies."""

    def __init__(self, few: int, rows: Callable[[], int] | None = None) -> None:
        super().__init__()
        self._few, self._rows = few, rows

    def get_ticks(self, min_: float, max_: float, _: int = 8) -> list[float]:
        first, last = math.floor(min_), math.ceil(max_)
        steps = (1,) if last - first > self._few else (1, 2, 5)
        ticks = self._seen([math.log10(m) + d for d in range(first, last + 1) for m in steps], min_, max_)
        if self._rows is None or legible(ticks, min_, max_, self._rows()):
            return ticks
        return every(self._seen(range(first, last + 1), min_, max_), min_, max_, self._rows())

    @staticmethod
    def _seen(ticks: Iterable[float], min_: float, max_: float) -> list[float]:
        return [float(t) for t in ticks if min_ - 1e-9 <= t <= max_ + 1e-9]

    def get_labels_for_ticks(self, ticks: Sequence[float]) -> list[str]:
        return [f"{10.0**t:.4g}" for t in ticks]


class Few(NumericAxisFormatter):
    """Ticks at round numbers, few enough that their numbers do not run into each other."""

    def get_ticks(self, min_: float, max_: float, _: int = 8) -> list[float]:
        ticks = super().get_ticks(min_, max_)
        return ticks[:: math.ceil(len(ticks) / _X_TICKS)]


class Upright(NumericAxisFormatter):
    """Ticks at round numbers of an axis that stands, each on a row of its own."""

    def __init__(self, rows: Callable[[], int]) -> None:
        super().__init__()
        self._rows = rows

    def get_ticks(self, min_: float, max_: float, _: int = 8) -> list[float]:
        return every(super().get_ticks(min_, max_), min_, max_, self._rows())


class Degrees(Upright):
    """Ticks of a phase: quarters of a turn, or as many of them as have rows of their own, with zero in the middle."""

    def get_ticks(self, min_: float, max_: float, _: int = 8) -> list[float]:
        quarters = [90.0 * n for n in range(math.ceil(min_ / 90.0), math.floor(max_ / 90.0) + 1)]
        if legible(quarters, min_, max_, self._rows()):
            return quarters
        return [t for t in quarters if t % 180.0 == 0.0]

    def get_labels_for_ticks(self, ticks: Sequence[float]) -> list[str]:
        return [f"{t:.0f}" for t in ticks]


def legible(ticks: Sequence[float], min_: float, max_: float, rows: int) -> bool:
    """Return whether the numbers beside an axis of so many rows stand on rows of their own."""
    return all((b - a) * (rows - 1) >= max_ - min_ for a, b in pairwise(ticks))


def every(ticks: Sequence[float], min_: float, max_: float, rows: int) -> list[float]:
    """Return every tick, every second, every third ..., so that they are legible."""
    steps = (step for step in range(1, len(ticks)) if legible(ticks[::step], min_, max_, rows))
    return list(ticks[:: next(steps, max(1, len(ticks)))])


class PanelPlot(PlotWidget):
    """One panel of axes; keys of its own (+, -, arrows) would be taken from the form, so it takes no focus."""

    can_focus = False

    def __init__(self, panel: Panel, *, large: bool = True) -> None:
        super().__init__(allow_pan_and_zoom=False)
        self._panel, self._most = panel, _APART[large]
        self._has_curves = any(isinstance(i, Line) and i.style != "points" for i in panel.items)
        self._reach: tuple[list[float], list[float]] = ([], [])  # lowest and highest of what was drawn, along x and y

    def on_mount(self, event: Mount) -> None:  # type: ignore[override]  # textual passes the event to who takes it
        """Draw after the base class's handler, which textual calls later: it would clear what was drawn."""
        super().on_mount()
        event.prevent_default()
        self.margin_top = 1
        panel = self._panel
        self.set_x_formatter(Decades(few=4) if panel.x_log else Few())
        self.set_y_formatter(_vertical(panel, self._rows))
        self.set_xlabel(panel.x_label.replace("[", "\\["))  # "[s]" would be taken for a style
        ends = _span(panel)
        colours = iter(SERIES * 4)
        for item in sorted(panel.items, key=_layer):
            self._draw(item, ends, colours)  # what comes later hides what was there
        if panel.x_range is not None:
            self.set_xlimits(*(_logged(np.array(panel.x_range), panel.x_log)))
        elif self._reach[0]:
            self.set_xlimits(*_with_margin(self._reach[0]))
        if panel.y_range is not None:
            lo, hi = panel.y_range
            self.set_ylimits(*(_logged(np.array([lo, hi]), panel.y_log)))
        elif panel.kind is PanelKind.PHASE:
            self.set_ylimits(-195.0, 195.0)
        elif self._reach[1]:
            self.set_ylimits(*_with_margin(self._reach[1]))

    def _rows(self) -> int:
        return max(2, self.size.height - self.margin_top - self.margin_bottom - 2)

    def _draw(self, item: object, ends: tuple[float, float], colours: Iterator[str]) -> None:
        match item:
            case Line():
                colour = ROLES.get(item.role) or next(colours)
                self._curve(item.x, item.y, colour, points=item.style == "points", label=item.label)
            case Band():
                for edge in (item.lo, item.hi):
                    self._curve(item.x, edge, ROLES["quiet"], points=item.x.size > _FEW, label="")
            case Heights():
                self._curve(item.x, item.y, ROLES["data"], points=True, label="")
            case Mark() | Span():
                for at in (item.at,) if isinstance(item, Mark) else (item.lo, item.hi):
                    self._straight(at, item.axis, ROLES.get(item.role, "white"), ends)

    def _curve(self, x: Array, y: Array, colour: str, points: bool, label: str) -> None:
        panel = self._panel
        kept = thin(y)
        x, y = _logged(x[kept], panel.x_log), _logged(y[kept], panel.y_log)
        known = np.isfinite(x) & np.isfinite(y)
        if not known.any():
            return
        x, y = x[known], y[known]
        for reach, values in zip(self._reach, (x, y), strict=True):
            reach += [float(values.min()), float(values.max())]
        if points and (self._has_curves or x.size <= _FEW):
            few = apart(x, self._most) if self._has_curves else slice(None)
            self.scatter(x[few], y[few], marker="•", marker_style=colour, label=label or None)
        elif points:
            self.scatter(x, y, marker_style=colour, hires_mode=HiResMode.BRAILLE, label=label or None)
        else:
            for part in unbroken(x, y, 180.0 if panel.kind is PanelKind.PHASE else math.inf):
                self.plot(*part, line_style=colour, hires_mode=HiResMode.BRAILLE, label=label or None)

    def _straight(self, at: float, axis: str, colour: str, ends: tuple[float, float]) -> None:
        if not math.isfinite(at):
            return
        panel = self._panel
        if axis == "x":
            shown = _logged(np.array([at]), panel.x_log)
            if np.isfinite(shown).all():
                self.add_v_line(float(shown[0]), line_style=colour)
        elif all(map(math.isfinite, ends)):
            self._curve(np.array(ends), np.array([at, at]), colour, points=False, label="")


def unbroken(x: Array, y: Array, jump: float) -> Iterator[tuple[Array, Array]]:
    """Yield a curve in parts that go on without a jump of this height: from -180 to 180 degrees a phase moved by
    nothing."""
    edges = [0, *(np.flatnonzero(np.abs(np.diff(y)) > jump) + 1), x.size]
    yield from ((x[a:b], y[a:b]) for a, b in pairwise(edges))


def _layer(item: object) -> int:
    """Return which items are drawn first: bands, then what is no longer so, curves, and the points of a measurement on
    top."""
    if isinstance(item, Band):
        return 0
    if getattr(item, "role", "") == "before":
        return 1
    return 3 if isinstance(item, Line) and item.style == "points" else 2


def _vertical(panel: Panel, rows: Callable[[], int]) -> AxisFormatter:
    if panel.kind is PanelKind.PHASE:
        return Degrees(rows)
    return Decades(few=2, rows=rows) if panel.y_log else Upright(rows)


def apart(x: Array, most: int) -> NDArray[np.intp]:
    """Return places in x (N,) of at most so many values, one of each equal part of its range; all if there are
    fewer."""
    if x.size <= most or float(np.ptp(x)) == 0.0:
        return np.arange(x.size)
    part = np.floor(most * (x - x.min()) / np.ptp(x) * (1.0 - 1e-12))
    return np.sort(np.unique(part, return_index=True)[1])


def thin(y: Array) -> NDArray[np.intp]:
    """Return places in y (N,) of at most `_MOST_POINTS` values: of each run of samples the lowest and the highest, so
    that no peak is lost."""
    if y.size <= _MOST_POINTS:
        return np.arange(y.size)
    edges = np.linspace(0, y.size, _MOST_POINTS // 2 + 1).astype(int)
    low, high = np.where(np.isnan(y), np.inf, y), np.where(np.isnan(y), -np.inf, y)
    ends = [(a + np.argmin(low[a:b]), a + np.argmax(high[a:b])) for a, b in pairwise(edges)]
    return np.unique(ends)


def _with_margin(reach: Sequence[float]) -> tuple[float, float]:
    """Return what lies on the edge of the axes may be lost to rounding: a little more than what is drawn."""
    lo, hi = min(reach), max(reach)
    margin = _MARGIN * (hi - lo) or abs(hi) * _MARGIN or _MARGIN
    return lo - margin, hi + margin


def _logged(values: Array, log: bool) -> Array:
    """Return log10 of values if the axis is logarithmic, NaN without a logarithm."""
    if not log:
        return np.asarray(values, dtype=float)
    out = np.full(np.shape(values), np.nan)
    positive = np.asarray(values) > 0
    out[positive] = np.log10(np.asarray(values)[positive])
    return out


def _span(panel: Panel) -> tuple[float, float]:
    xs = [item.x for item in panel.items if isinstance(item, Line | Band | Heights) and item.x.size]
    return (min(float(np.nanmin(x)) for x in xs), max(float(np.nanmax(x)) for x in xs)) if xs else (math.nan, math.nan)


class MapView(Static):
    """A map as wide as there is room for it: a row that is too long would go on in the next line."""

    def __init__(self, item: Image, panel: Panel, rows: int) -> None:
        super().__init__(classes="map")
        self._item, self._panel, self._rows = item, panel, rows

    def on_mount(self) -> None:
        self._draw(_NARROWEST)

    def on_resize(self, event: Resize) -> None:
        self._draw(event.size.width)

    def _draw(self, columns: int) -> None:
        room = max(_NARROWEST, columns) - map_left(self._panel) - 1
        self.update(map_text(self._item, self._panel, width=room, height=self._rows))


class PanelView(Vertical):
    """Title, what the colours mean, and the axes; a map as shades."""

    def __init__(self, panel: Panel, *, large: bool = False, titled: bool = True) -> None:
        """Make the plot. large: on a screen of its own; titled: False if its title stands above already."""
        super().__init__(classes="panel")
        self._panel, self._large, self._titled = panel, large, titled

    def compose(self) -> ComposeResult:
        yield Static(panel_head(self._panel, titled=self._titled), classes="panel-head")
        drawn = next((item for item in self._panel.items if isinstance(item, Image | Heights)), None)
        if isinstance(drawn, Image):
            yield MapView(drawn, self._panel, self.app.size.height - 8 if self._large else MAP_ROWS)
        elif drawn is not None:
            yield Static(plan(drawn, 56 if self._large else 32), markup=False)
        else:
            yield PanelPlot(self._panel, large=self._large)


def panel_head(panel: Panel, *, titled: bool = True) -> Text:
    """Return the title of a panel with the colours of its curves."""
    text = Text.assemble((f"{panel.title}  " if titled else "", "bold"), panel.y_label)
    colours = iter(SERIES * 4)
    for item in panel.items:
        if isinstance(item, Line):
            colour = ROLES.get(item.role) or next(colours)
            if item.label:
                text.append(_entry("•" if item.style == "points" else "━", item.label), colour)
        elif isinstance(item, Mark) and item.label and item.axis == "x":
            text.append(_entry("│", item.label), ROLES.get(item.role, "white"))
    return text


def _entry(sign: str, label: str) -> str:
    """Return an entry of a legend; its words stay in the line of their sign."""
    return "  " + f"{sign} {label}".replace(" ", "\N{NO-BREAK SPACE}")


def plan(item: Heights, width: int = 56, height: int = 9) -> str:
    """Draw numbered points with their heights, seen from above. A number for which there is no room beside another one
    stands on the next free row."""
    words = [f"{number}:{z:+.1f}" for number, z in enumerate(item.z, 1)]
    longest = max(map(len, words), default=0)
    rows = [" " * (width + longest)] * max(height, len(words))
    for word, x, y in zip(words, item.x, item.y, strict=True):
        start = round((width - 1) * _fraction(x, item.x))
        end = start + len(word)
        wanted = round((height - 1) * (1 - _fraction(y, item.y)))
        nearest = sorted(range(len(rows)), key=lambda row: abs(row - wanted))
        row = next(r for r in nearest if not rows[r][max(0, start - 1) : end + 1].strip())
        rows[row] = rows[row][:start] + word + rows[row][end:]
    return "\n".join(row.rstrip() for row in rows).rstrip() + f"\n{item.label}"


def _fraction(value: float, among: Array) -> float:
    lo, hi = float(np.min(among)), float(np.max(among))
    return 0.5 if hi == lo else (float(value) - lo) / (hi - lo)
