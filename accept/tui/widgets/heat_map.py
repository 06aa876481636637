"""A map in the terminal: shades, which tell without colour too, and upon them an estimate and its region."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from rich.text import Text

from accept.pictures.colours import MAP_STEPS
from accept.pictures.words import pretty
from checks.arrays import Array
from checks.picture import Image, Line, Mark, Panel

SHADES = " ·░▒▓█"
REGION, PLACE = "o", "●"
_LEFT = 9  # columns for the numbers of the y axis
_HALVES = "before", "after"  # at the end of the names of rows
_BETWEEN = 2  # columns between both
_NARROWEST = 16  # columns of cells that say anything


def map_text(item: Image, panel: Panel, width: int = 58, height: int = 10, *, coloured: bool = False) -> Text:
    """Return the map in a frame, with y upwards (downwards where its panel says so), the largest value fullest, numbers
    or names on both axes and what marks say on top. coloured: cells have the colours of the page too."""
    return _framed(item, panel, width, height, _limits(item), coloured)


def side_by_side(item: Image, panel: Panel, width: int, height: int, *, coloured: bool = False) -> Text:
    """Return a map of `width` columns, with its rows before and after beside each other on one scale if there is room
    for both: what is different then stands at the same height."""
    halves = [_half(item, panel, name) for name in _HALVES]
    each = (width - _BETWEEN) // 2
    if any(half is None for half in halves) or each - map_left(panel) < _NARROWEST:
        return map_text(item, panel, width - map_left(panel) - 2, height, coloured=coloured)
    drawn = [
        _framed(*half, each - map_left(half[1]) - 2, height - 1, _limits(item), coloured).split("\n")
        for half in halves
        if half is not None
    ]
    text = Text()
    for name in _HALVES:
        text.append(
            f"{name:^{each + _BETWEEN}}".rstrip() if name == _HALVES[-1] else f"{name:^{each + _BETWEEN}}", "bold"
        )
    for before, after in zip(*drawn, strict=True):
        before.truncate(each, pad=True)
        text.append("\n").append_text(before).append(" " * _BETWEEN).append_text(after)
    return text


def _half(item: Image, panel: Panel, name: str) -> tuple[Image, Panel] | None:
    """Return the rows whose names end in a word, named without it; None if no name does."""
    own = [n for n, row in enumerate(panel.y_names) if row.endswith(f" {name}")]
    if not own:
        return None
    names = tuple(panel.y_names[n].removesuffix(f" {name}") for n in own)
    return replace(item, y=np.arange(float(len(own))), z=item.z[own]), replace(panel, y_names=names)


def _framed(item: Image, panel: Panel, width: int, height: int, limits: tuple[float, float], coloured: bool) -> Text:
    names = panel.y_names
    if panel.y_range is not None and panel.y_range[0] > panel.y_range[1]:
        item, names = replace(item, y=item.y[::-1], z=item.z[::-1]), names[::-1]
    left, level = map_left(panel), _levels(item, width, height, limits)
    region, place = _region(item, panel, width, height), _place(item, panel, width, height)
    text = Text()
    text.append(" " * (left - 1) + f"┌{'─' * width}┐\n", "dim")
    for n, row in enumerate(level):
        label = _name(names, n, height) if names else _y_label(item, n, height)
        text.append(f"{label:>{left - 2}} │", "dim")
        cells = [_cell_of(n, column, int(value), region, place, coloured) for column, value in enumerate(row)]
        for style, alike in groupby(cells, key=lambda cell: cell[1]):
            text.append("".join(letter for letter, _ in alike), style)
        text.append("│\n", "dim")
    text.append(" " * (left - 1) + f"└{'─' * width}┘\n", "dim")
    text.append(" " * left + _x_labels(item, width, panel.x_log) + "\n", "dim")
    upwards = f"up: {pretty(panel.y_label)}" if panel.y_label else ""
    words = [w for w in (pretty(panel.x_label), upwards, scale_words(item, limits)) if w]
    if len("; ".join(words)) > width + 1:
        words[0] = words[0].rpartition("[")[2].removesuffix("]")
    before, shades, behind = "; ".join(words).rpartition(SHADES)
    text.append(" " * left + before, "dim")
    for n, shade in enumerate(shades):
        text.append(*_shade(n, coloured) if coloured else (shade, "dim"))
    return text.append(behind, "dim")


def _cell_of(
    row: int, column: int, level: int, region: set[tuple[int, int]], place: tuple[int, int] | None, coloured: bool
) -> tuple[str, str]:
    """Return letter and style of a cell; the estimate stands upon its region, and this upon the map."""
    if (row, column) == place or (row, column) in region:
        ground = f"red on {_ground(level)}" if coloured else "yellow"
        return PLACE if (row, column) == place else REGION, f"bold {ground}"
    return _shade(level, coloured)


def _shade(level: int, coloured: bool) -> tuple[str, str]:
    return SHADES[level], f"{_ground(level)} on {_ground(level)}" if coloured else "bright_blue"


def _ground(level: int) -> str:
    return MAP_STEPS[level * (len(MAP_STEPS) - 1) // (len(SHADES) - 1)]


def scale_words(item: Image, limits: tuple[float, float]) -> str:
    """Return what the shades mean: the least value, the shades, and the largest."""
    return f"{pretty(item.label)} {limits[0]:.3g} [{SHADES}] {limits[1]:.3g}".lstrip()


def _limits(item: Image) -> tuple[float, float]:
    known = item.z[np.isfinite(item.z)]
    return (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)


def map_left(panel: Panel) -> int:
    """Return how many columns the names or numbers of the y axis need."""
    return max([_LEFT, *(len(name) + 3 for name in panel.y_names)])


def _levels(item: Image, width: int, height: int, limits: tuple[float, float]) -> NDArray[np.int_]:
    """Return which shade each of height x width cells has; a column that stands for several has that of the largest, so
    that no narrow peak is lost."""
    z = _columns(item.z[_rows(item.z.shape[0], height)], width)
    lo, hi = limits
    level = np.zeros(z.shape) if hi == lo else (np.where(np.isfinite(z), z, lo) - lo) / (hi - lo)
    return np.asarray(np.clip((level * len(SHADES)).astype(int), 0, len(SHADES) - 1))


def _columns(z: Array, width: int) -> Array:
    """Return z (rows, N) as (rows, width)."""
    count = z.shape[1]
    if count <= width:
        return z[:, np.linspace(0, count - 1, width).round().astype(int)]
    first = np.floor(np.arange(width) * count / width).astype(int)
    largest = np.maximum.reduceat(np.where(np.isnan(z), -np.inf, z), first, axis=1)
    return np.where(np.isneginf(largest), np.nan, largest)


def _rows(count: int, height: int) -> NDArray[np.int_]:
    """Return which row of a map each line shows, the last one on top."""
    return np.linspace(count - 1, 0, height).round().astype(int)


def _name(names: Sequence[str], line: int, height: int) -> str:
    """Return the name of the row that a line shows, beside the first of its lines."""
    rows = _rows(len(names), height)
    return names[rows[line]] if line == 0 or rows[line] != rows[line - 1] else ""


def _cell(value: float, axis: Array, count: int) -> int | None:
    """Return which of `count` cells along an axis, None outside it."""
    lo, hi = float(axis[0]), float(axis[-1])
    if not math.isfinite(value) or hi == lo:
        return None
    at = round((count - 1) * (value - lo) / (hi - lo))
    return at if 0 <= at < count else None


def _place(item: Image, panel: Panel, width: int, height: int) -> tuple[int, int] | None:
    """Return row and column where a mark on x and one on y cross."""
    marks = {mark.axis: mark.at for mark in panel.items if isinstance(mark, Mark)}
    if set(marks) != {"x", "y"}:
        return None
    return _row_column(marks["x"], marks["y"], item, width, height)


def _region(item: Image, panel: Panel, width: int, height: int) -> set[tuple[int, int]]:
    outline = [line for line in panel.items if isinstance(line, Line)]
    found = {
        _row_column(float(x), float(y), item, width, height)
        for line in outline
        for x, y in zip(line.x, line.y, strict=True)
    }
    return {cell for cell in found if cell is not None}


def _row_column(x: float, y: float, item: Image, width: int, height: int) -> tuple[int, int] | None:
    column, up = _cell(x, item.x, width), _cell(y, item.y, height)
    return None if column is None or up is None else (height - 1 - up, column)


def _y_label(item: Image, row: int, height: int) -> str:
    """Return the numbers at top, middle and bottom."""
    shown = {0: item.y[-1], height // 2: _middle(item.y), height - 1: item.y[0]}
    return f"{float(shown[row]):.3g}" if row in shown else ""


def _x_labels(item: Image, width: int, log: bool) -> str:
    """Return the places of three ticks; columns follow the map, so the middle is logarithmic if its axis is."""
    halfway = item.x[item.x.size // 2] if log else _middle(item.x)
    left, middle, right = (f"{float(v):.3g}" for v in (item.x[0], halfway, item.x[-1]))
    gap = max(1, width // 2 - len(left) - len(middle) // 2)
    first = f"{left}{' ' * gap}{middle}"
    return first + right.rjust(max(len(right) + 1, width - len(first)))


def _middle(axis: NDArray[np.float64]) -> float:
    return (float(axis[0]) + float(axis[-1])) / 2
