"""The checks' pictures in the terminal, on the scales of the page: light axes, a dotted grid, words at the curves."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from textwrap import wrap

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from textual.geometry import Size
from textual.widgets import Static

from accept.pictures.scale import Scale, scales
from accept.pictures.words import pretty
from accept.tui.widgets.heat_map import side_by_side
from accept.tui.widgets.plan import plan
from accept.tui.widgets.raster import DOWN, GRID, Raster
from checks.arrays import Array
from checks.picture import Band, Heights, Image, Item, Line, Mark, Panel, PanelKind, Span, Text

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
_AXIS = "bright_black"
_MOST_POINTS = 600  # a terminal is no wider
WIDE_FROM = 100  # columns, as in the app's breakpoints
HUGE_FROM, TALL_FROM = 170, 45  # columns and rows with room for more
_FEW = 60  # points by themselves: more of them are drawn small
_BESIDE = 5  # columns of a curve for each point that is drawn upon it: so few that both are seen
_ABOVE, _BELOW = 1, 2  # rows: the unit, and the axis with its numbers
_ROWS_PER_TICK, _COLUMNS_PER_TICK = 3, 10
_NEAR = 3.0  # rows: words that are farther from their curve are not at it
_LEAST = 12, 6  # columns and rows of a drawing that says anything
_NARROWEST = 30  # columns of a map with its names
_SIGNS = {"points": "•", "dashed": "╌", "solid": "━"}


def has_room(size: Size) -> bool:
    """Return whether a screen has room for large drawings and for the units before."""
    return size.width >= HUGE_FROM and size.height >= TALL_FROM


@dataclass
class Axes:
    """The axes of a panel on a raster. labels: words that belong to a curve: its cells, words, style."""

    raster: Raster
    x: Scale
    y: Scale
    left: int
    labels: list[tuple[Array, str, str]] = field(default_factory=list)

    @property
    def width(self) -> int:
        return self.raster.width - self.left

    @property
    def height(self) -> int:
        return self.raster.height - _ABOVE - _BELOW

    def columns(self, values: Array | float) -> Array:
        """Return the columns of values along x, as fractions of a cell too; both ends of the axis lie on the raster."""
        return self.left + _inside(self.x.at(values), self.width)

    def rows(self, values: Array | float) -> Array:
        return _ABOVE + _inside(1.0 - self.y.at(values), self.height)

    def cells(self, lo: float, hi: float, axis: str) -> slice:
        """Return the cells of an interval of an axis; without an end it goes on to that of the axis."""
        scale, place, first, count = (
            (self.x, self.columns, self.left, self.width) if axis == "x" else (self.y, self.rows, _ABOVE, self.height)
        )
        inner = [v if math.isfinite(v) and not math.isnan(float(scale.at(v))) else end
                 for v, end in ((lo, min(scale.lo, scale.hi)), (hi, max(scale.lo, scale.hi)))]  # fmt: skip
        at = sorted(int(np.clip(math.floor(float(place(v))), first, first + count - 1)) for v in inner)
        return slice(at[0], at[1] + 1)


def _inside(fraction: Array, count: int) -> Array:
    return fraction * (count - 1.0 / DOWN) + 0.5 / DOWN


def draw(panel: Panel, width: int, height: int, ground: str = "") -> Raster:
    """Draw a panel of axes. ground: style of the background of zones, "" where a terminal has no shades."""
    raster = Raster(width, height)
    if width < _LEAST[0] or height < _LEAST[1]:
        return raster
    axes = _axes(panel, raster)
    _frame(axes, panel)
    colours = iter(SERIES * 9)
    plain = any(isinstance(i, Line) and i.style != "points" for i in panel.items)
    for item in sorted(panel.items, key=_layer):
        _draw_item(axes, item, colours, plain=plain, panel=panel, ground=ground)
    _write_labels(axes, pretty(panel.y_label))
    return raster


def _axes(panel: Panel, raster: Raster) -> Axes:
    tall = raster.height - _ABOVE - _BELOW
    left = 2
    for _ in range(2):  # how wide the numbers are is known once they are
        x, y = scales(panel, float(raster.width - left), 2.0 * tall)
        left = 2 + max((len(words) for _, words in y.ticks(_most(tall, _ROWS_PER_TICK))), default=0)
    return Axes(raster, x, y, left)


def _most(cells: int, each: int) -> int:
    return max(3, cells // each)


def _frame(axes: Axes, panel: Panel) -> None:
    """Draw axes, ticks, grid and units."""
    raster, left, foot = axes.raster, axes.left, _ABOVE + axes.height
    right = pretty(panel.x_label)
    if len(right) > axes.width // 4:  # the numbers are to have the room
        right = right.rpartition("[")[2].removesuffix("]")
    raster.write(0, 0, pretty(panel.y_label), _AXIS)
    for row in range(_ABOVE, foot):
        raster.write(row, left - 1, "│", _AXIS)
    raster.write(foot, left - 1, "└" + "─" * axes.width, _AXIS)
    free = raster.width - len(right) - 2
    raster.write(foot + 1, free + 2, right, _AXIS)
    last = -1
    for value, words in axes.x.ticks(_most(axes.width, _COLUMNS_PER_TICK)):
        column = math.floor(float(axes.columns(value)))
        for row in range(_ABOVE, foot):
            raster.write(row, column, "┊", GRID, below=True)
        raster.write(foot, column, "┴", _AXIS)
        first = max(0, column - len(words) // 2)
        if first > last and first + len(words) <= free + 1:
            raster.write(foot + 1, first, words, _AXIS)
            last = first + len(words)
    used: set[int] = set()
    for value, words in axes.y.ticks(_most(axes.height, _ROWS_PER_TICK)):
        row = math.floor(float(axes.rows(value)))
        if row in used:
            continue
        used |= {row}
        raster.write(row, left - 2 - len(words), f"{words} ┤", _AXIS)
        raster.write(row, left, "┈" * axes.width, GRID, below=True)


def _layer(item: Item) -> int:
    """Return which items are drawn first: zones, then what is no longer so, curves, and what was measured on top."""
    if isinstance(item, Band | Span):
        return 0
    if getattr(item, "role", "") == "before":
        return 1
    return 3 if isinstance(item, Text) or (isinstance(item, Line) and item.style == "points") else 2


def _draw_item(axes: Axes, item: Item, colours: Iterator[str], *, plain: bool, panel: Panel, ground: str) -> None:
    raster = axes.raster
    match item:
        case Line():
            colour = ROLES.get(item.role) or next(colours)
            _draw_line(axes, item, colour, plain=plain, turns=panel.kind is PanelKind.PHASE)
        case Band():
            for edge in (item.lo, item.hi):
                raster.curve(axes.columns(item.x), axes.rows(edge), ROLES["quiet"])
            for column in range(axes.left, raster.width) if ground else ():
                inside = np.abs(axes.columns(item.x) - column - 0.5) <= max(1.0, axes.width / item.x.size)
                if inside.any():
                    raster.tint(axes.cells(float(item.lo[inside].min()), float(item.hi[inside].max()), "y"),
                                slice(column, column + 1), ground)  # fmt: skip
        case Span():
            cells, whole = axes.cells(item.lo, item.hi, item.axis), slice(_ABOVE, _ABOVE + axes.height)
            rows, columns = (cells, slice(axes.left, raster.width)) if item.axis == "y" else (whole, cells)
            raster.tint(rows, columns, ground)
            for at in (item.lo, item.hi):
                _straight(axes, at, item.axis, ROLES.get(item.role, "white"), item.label if at == item.hi else "")
        case Mark():
            _straight(axes, item.at, item.axis, ROLES.get(item.role, "white"), item.label)
        case Text():
            _write_words(axes, item)


def _write_words(axes: Axes, item: Text) -> None:
    """Write words at their place; one beyond the axes is at their end, and words that have no room go on below."""
    x, y = float(axes.columns(item.x)), float(axes.rows(item.y))
    lines = wrap(pretty(item.words), axes.width)
    if math.isnan(x) or math.isnan(y) or not lines:
        return
    longest = max(map(len, lines))
    column = math.floor(min(max(x, axes.left), axes.raster.width - longest))
    row = math.floor(min(max(y, _ABOVE), _ABOVE + axes.height - len(lines)))
    for n, words in enumerate(lines):
        axes.raster.write(row + n, column, words, ROLES.get(item.role, "white"))


def _draw_line(axes: Axes, item: Line, colour: str, *, plain: bool, turns: bool) -> None:
    """plain: curves are drawn too, upon which few points are. turns: it goes on at the other end after a turn."""
    kept = thin(item.y)
    x, y = axes.columns(item.x[kept]), axes.rows(item.y[kept])
    known = np.isfinite(x) & np.isfinite(y)
    x, y, values = x[known], y[known], item.y[kept][known]
    if not x.size:
        return
    if item.style != "points":
        for a, b in _unbroken(values, 180.0 if turns else math.inf):
            axes.raster.curve(x[a:b], y[a:b], colour, dashed=item.style == "dashed")
    elif plain or x.size <= _FEW:
        for n in apart(x, axes.width // _BESIDE) if plain else range(x.size):
            axes.raster.write(math.floor(y[n]), math.floor(x[n]), "•", colour)
    else:
        axes.raster.dots(x, y, colour)
    if item.label:
        axes.labels.append((np.array([x, y]), f"{_SIGNS[item.style]} {pretty(item.label)}", colour))


def _straight(axes: Axes, at: float, axis: str, colour: str, label: str) -> None:
    """Draw a dashed line across, with its words at its end."""
    place, raster = float((axes.columns if axis == "x" else axes.rows)(at)), axes.raster
    inside = axes.left <= place < raster.width if axis == "x" else _ABOVE <= place < _ABOVE + axes.height
    if not inside:
        return
    words = pretty(label)
    for row in range(_ABOVE, _ABOVE + axes.height) if axis == "x" else ():
        raster.write(row, math.floor(place), "╎", colour, below=True)
    if axis == "y":
        raster.write(math.floor(place), axes.left, "╌" * axes.width, colour, below=True)
    if words and axis == "x":
        column = math.floor(place) + 1
        room = column + len(words) <= raster.width
        raster.write(_ABOVE, column if room else max(axes.left, column - len(words) - 2), words, colour)
    elif words:
        row = math.floor(place)
        raster.write(row - 1 if row > _ABOVE else row + 1, raster.width - len(words), words, colour)


def _write_labels(axes: Axes, unit: str) -> None:
    """Write the words of each curve beside it, where nothing else is and no other curve is as near; those for which
    there is no such place in the row above the axes, beside its unit, or wherever there is room."""
    raster, above = axes.raster, []
    for n, (own, words, style) in enumerate(axes.labels):
        others = [curve for m, (curve, *_) in enumerate(axes.labels) if m != n]
        place = _beside(axes, own, others, len(words) + 2)
        if place is not None:
            raster.write(place[0], place[1] + 1, words, style)
        else:
            above.append((words, style))
    column = raster.width
    for words, style in reversed(above):  # the first one stands first
        column -= len(words) + 2
        place = (0, column) if column >= len(unit) else _beside(axes, None, (), len(words) + 2)
        if place is not None:
            raster.write(place[0], place[1] + 1, words, style)


def _beside(axes: Axes, own: Array | None, others: Sequence[Array], length: int) -> tuple[int, int] | None:
    """Return row and column of `length` free cells beside a curve, or anywhere, as far right as there are such."""
    area = slice(_ABOVE, _ABOVE + axes.height), slice(axes.left, axes.raster.width)
    free = axes.raster.free[area]
    if length > free.shape[1]:
        return None
    clear = sliding_window_view(free, length, axis=1).all(axis=-1)
    rows = np.arange(free.shape[0])[:, None] + _ABOVE
    near = np.zeros(clear.shape) if own is None else _distance(own, rows, axes, length)
    rival = np.min([np.full(clear.shape, np.inf), *(_distance(o, rows, axes, length) for o in others)], axis=0)
    fits = clear & (near <= _NEAR) & (rival > near + 0.5)
    if not fits.any():
        return None
    cost = near - 0.08 * np.arange(clear.shape[1])
    row, column = np.unravel_index(int(np.argmin(np.where(fits, cost, np.inf))), clear.shape)
    return int(row) + _ABOVE, int(column) + axes.left


def _distance(curve: Array, rows: NDArray[np.int_], axes: Axes, length: int) -> Array:
    """Return (rows, columns) how many rows lie between a curve and words that begin in a cell."""
    by_column = np.full((rows.size, axes.width), np.inf)
    for column, row in {(math.floor(x) - axes.left, math.floor(y)) for x, y in curve.T}:
        if 0 <= column < axes.width:
            by_column[:, column] = np.minimum(by_column[:, column], np.abs(rows[:, 0] - row))
    return np.asarray(sliding_window_view(by_column, length, axis=1).min(axis=-1))


def _unbroken(values: Array, jump: float) -> Iterable[tuple[int, int]]:
    """Return ends of the parts of a curve that go on without a jump of this height: from -180 to 180 degrees a phase
    moved by nothing."""
    edges = [0, *(np.flatnonzero(np.abs(np.diff(values)) > jump) + 1), values.size]
    return pairwise(map(int, edges))


def apart(x: Array, most: int) -> NDArray[np.intp]:
    """Return places in x (N,) of at most so many values, one of each equal part of its range, or all."""
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


class PanelPlot(Static):
    """One panel, drawn anew for the room that there is."""

    DEFAULT_CSS = "PanelPlot { width: 1fr; height: 1fr; }"

    def __init__(self, panel: Panel) -> None:
        super().__init__(markup=False)
        self._panel = panel

    def show(self, panel: Panel) -> None:
        self._panel = panel
        self._draw()

    def on_mount(self) -> None:
        self.app.theme_changed_signal.subscribe(self, lambda _: self._draw())

    def on_resize(self) -> None:
        self._draw()

    def _draw(self) -> None:
        width, height = self.size
        kept = next((item for item in self._panel.items if isinstance(item, Image | Heights)), None)
        few = self.app.has_class("-few-colours")
        if isinstance(kept, Image):
            wide, tall = max(_NARROWEST, width), max(3, height - 4)
            self.update(side_by_side(kept, self._panel, wide, tall, coloured=not few))
        elif kept is not None:
            self.update(plan(kept, width, height).text())
        else:
            ground = "" if few else f"on {self.app.theme_variables['panel']}"
            self.update(draw(self._panel, width, height, ground).text())


class PanelView(PanelPlot):
    """A panel in a card: its title stands in the border."""

    def __init__(self, panel: Panel, *, titled: bool = True) -> None:
        """Make the card. titled: False if its title stands above already."""
        super().__init__(panel)
        self.add_class("panel", "card")
        self._titled = titled

    def _draw(self) -> None:
        title = pretty(self._panel.title)
        if len(title) > self.size.width - 2:  # what it means stands on the whole screen
            title = title.partition(" (")[0]
        self.border_title = title.replace("[", r"\[") if self._titled else None
        super()._draw()
