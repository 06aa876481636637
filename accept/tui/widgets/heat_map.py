"""A map in the terminal: shades, which tell without colour too, and upon them an estimate and its region."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from rich.text import Text

from checks.arrays import Array
from checks.picture import Image, Line, Mark, Panel

SHADES = " ·░▒▓█"
REGION, PLACE = "o", "●"
_LEFT = 9  # columns for the numbers of the y axis


def map_text(item: Image, panel: Panel, width: int = 58, height: int = 10) -> Text:
    """Return the map with y upwards (downwards where its panel says so), the largest value fullest, numbers or names on
    both axes and what marks say on top."""
    names = panel.y_names
    if panel.y_range is not None and panel.y_range[0] > panel.y_range[1]:
        item, names = replace(item, y=item.y[::-1], z=item.z[::-1]), names[::-1]
    left = map_left(panel)
    cells = shaded(item, width, height)
    for up, along in _region(item, panel, width, height):
        cells[up][along] = REGION
    place = _place(item, panel, width, height)
    if place is not None:
        cells[place[0]][place[1]] = PLACE
    text = Text()
    for n, row in enumerate(cells):
        label = _name(names, n, height) if names else _y_label(item, n, height)
        text.append(f"{label:>{left - 1}} ", "dim")
        for marked, cells_alike in groupby(row, key=(REGION, PLACE).__contains__):
            text.append("".join(cells_alike), "bold yellow" if marked else "bright_blue")
        text.append("\n")
    text.append(" " * left + _x_labels(item, width, panel.x_log) + "\n", "dim")
    upwards = f"up: {panel.y_label}" if panel.y_label else ""
    text.append(" " * left + "; ".join(w for w in (panel.x_label, upwards, scale_words(item)) if w), "dim")
    return text


def scale_words(item: Image) -> str:
    """Return what the shades mean: the least value, the shades, and the largest."""
    known = item.z[np.isfinite(item.z)]
    return f"{item.label} {known.min():.3g} [{SHADES}] {known.max():.3g}".lstrip() if known.size else item.label


def map_left(panel: Panel) -> int:
    """Return how many columns the names or numbers of the y axis need."""
    return max([_LEFT, *(len(name) + 2 for name in panel.y_names)])


def shaded(item: Image, width: int, height: int) -> list[list[str]]:
    """Return a map of height x width characters; a column that stands for several shows the largest, so that no narrow
    peak is lost."""
    z = _columns(item.z[_rows(item.z.shape[0], height)], width)
    known = np.isfinite(z)
    lo, hi = (float(z[known].min()), float(z[known].max())) if known.any() else (0.0, 0.0)
    level = np.zeros(z.shape) if hi == lo else (np.where(known, z, lo) - lo) / (hi - lo)
    return [[SHADES[min(int(v * len(SHADES)), len(SHADES) - 1)] for v in row] for row in level]


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
