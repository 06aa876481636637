"""Points with their heights over the interfaces of a unit, seen from above."""

import math

import numpy as np

from accept.pictures.words import pretty
from accept.tui.widgets.limit_bar import BLOCKS, block
from accept.tui.widgets.raster import Raster
from checks.arrays import Array
from checks.picture import Heights

_HIGH, _LOW, _PAD, _QUIET, _NEXT = "bright_cyan", "yellow", "bright_black", "dim", "bold bright_blue"
_NONE, _DUE = "·", "◉"
_AROUND = 7  # rows of frames, of heights below their numbers, and of the label


def plan(item: Heights, width: int = 56, height: int = 11) -> Raster:
    """Draw numbered points at their places within their pads: a bar as high as the point among the others, below it
    its height, with the decimal points below each other. The first point without a height is the next one."""
    words, longest = height_words(item.z), len(str(len(item.z)))
    due = next((n for n, z in enumerate(item.z) if not math.isfinite(z)), None)
    each = max(longest + 2, *map(len, words))
    # A cell is twice as high as wide: about to scale, with room for two rows a point.
    span = float(np.ptp(item.x)) or 1.0
    height = min(height, _AROUND + round(width / 2 * float(np.ptp(item.y)) / span))
    places = _places(item, each, width, height - 1)
    raster = Raster(width, max(height, 4 + max(row for row, _ in places)))
    for left, right, top, foot in _pads(item, places, each):
        raster.write(top, left, f"┌{'─' * (right - left - 1)}┐", _PAD)
        raster.write(foot, left, f"└{'─' * (right - left - 1)}┘", _PAD)
        for row in range(top + 1, foot):
            raster.write(row, left, "│", _PAD)
            raster.write(row, right, "│", _PAD)
    for n, ((row, column), z) in enumerate(zip(places, item.z, strict=True)):
        bar, style = (_DUE, _NEXT) if n == due else bar_of(z, item.z)
        raster.write(row, column, f"{n + 1:>{each - 2}} ", _NEXT if n == due else "bold")
        raster.write(row, column + each - 1, bar, style)
        raster.write(row + 1, column, words[n].rjust(each), style)
    label, scale = pretty(item.label), _scale_words(item.z)
    if len(label) + 2 + len(scale) > width:
        label = label.rpartition("[")[2].removesuffix("]")  # its unit
    raster.write(raster.height - 1, 0, f"{label}  {scale}".strip(), _QUIET)
    return raster


def bar_of(z: float, among: Array) -> tuple[str, str]:
    """Return a bar as high as a height among the others, and its colour: above zero or below."""
    known = among[np.isfinite(among)]
    if not math.isfinite(z):
        return _NONE, _QUIET
    return block(z, float(known.min()), float(known.max())), _HIGH if z >= 0 else _LOW


def height_words(z: Array) -> list[str]:
    """Return heights with their decimal points below each other; nothing for one that is not known."""
    written = [f"{v:+z.1f}" if math.isfinite(v) else "" for v in z]
    longest = max(map(len, written), default=0)
    return [words.rjust(longest) for words in written]


def _scale_words(z: Array) -> str:
    known = z[np.isfinite(z)]
    return f"{BLOCKS[0]} {known.min():+z.1f}  {BLOCKS[-1]} {known.max():+z.1f}" if known.size > 1 else ""


def _places(item: Heights, each: int, width: int, height: int) -> list[tuple[int, int]]:
    """Return row and column of every point; one that would run into another stands on the next free row."""
    taken: set[tuple[int, int]] = set()
    found = []
    for x, y in zip(item.x, item.y, strict=True):
        column = 2 + round((width - each - 4) * _fraction(x, item.x))
        wanted = 1 + round((height - 4) * (1 - _fraction(y, item.y)))
        rows = sorted(range(1, max(height, 2 * len(item.x)) + 2), key=lambda row: abs(row - wanted))
        columns = range(column - 1, column + each + 1)
        row = next(r for r in rows if not taken & {(down, c) for down in (r, r + 1) for c in columns})
        taken |= {(down, c) for down in (row, row + 1) for c in columns}
        found.append((row, column))
    return found


def _pads(item: Heights, places: list[tuple[int, int]], each: int) -> list[tuple[int, int, int, int]]:
    """Return left, right, top and foot of the frame about the points at either end of x."""
    found = []
    for side in (item.x < 0, item.x >= 0):
        own = [place for place, here in zip(places, side, strict=True) if here]
        if own and not side.all():
            columns, rows = [c for _, c in own], [r for r, _ in own]
            found.append((min(columns) - 2, max(columns) + each + 1, min(rows) - 1, max(rows) + 2))
    return found


def _fraction(value: float, among: Array) -> float:
    lo, hi = float(np.min(among)), float(np.max(among))
    return 0.5 if hi == lo else (float(value) - lo) / (hi - lo)
