"""Cells of a terminal to draw on: a cell holds a letter, or 2 x 4 dots of braille, which all curves share."""

from itertools import groupby

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rich.text import Text

from checks.arrays import Array

ACROSS, DOWN = 2, 4  # dots of a cell: as a cell is twice as high as wide, they lie as far apart both ways
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])  # of a braille letter
_BRAILLE, _BLANK = 0x2800, " "
GRID = "dim bright_black"
_DASH, _GAP = 5, 4  # dots of a dashed curve


class Raster:
    """Places are columns and rows from the left upper corner, as fractions too; what lies outside is not drawn. Letters
    hide dots unless they are a grid; a cell of several curves has the colour of the last one and the dots of all, which
    are its bits."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.bits: NDArray[np.bool_] = np.zeros((height * DOWN, width * ACROSS), dtype=bool)
        self._inks = np.full((height, width), "", dtype=object)
        self._letters = np.full((height, width), "", dtype=object)
        self._styles = np.full((height, width), "", dtype=object)
        self._below = np.full((height, width), False)
        self._grounds = np.full((height, width), "", dtype=object)

    def dots(self, columns: ArrayLike, rows: ArrayLike, style: str) -> None:
        """Set a dot at each place."""
        x, y = np.asarray(columns, float) * ACROSS, np.asarray(rows, float) * DOWN
        seen = np.isfinite(x) & np.isfinite(y)
        along, down = np.floor(x[seen]).astype(int), np.floor(y[seen]).astype(int)
        inside = (along >= 0) & (along < self.width * ACROSS) & (down >= 0) & (down < self.height * DOWN)
        along, down = along[inside], down[inside]
        self.bits[down, along] = True
        self._inks[down // DOWN, along // ACROSS] = style

    def curve(self, columns: Array, rows: Array, style: str, *, dashed: bool = False) -> None:
        """Join places by straight lines; NaN interrupts them."""
        ends = np.column_stack([columns, rows])
        far = 4.0 * (self.width + self.height)  # a line that is longer than the drawing by so much is not seen
        near = np.abs(ends).max(axis=1, initial=0.0) < far  # NaN is not
        seen = np.flatnonzero(near[:-1] & near[1:])
        begin, end = ends[seen], ends[seen + 1]
        dots = 1 + np.ceil(np.abs((end - begin) * (ACROSS, DOWN)).max(axis=1, initial=0.0)).astype(int)
        step = (end - begin) / np.maximum(dots - 1, 1)[:, None]
        line = np.repeat(np.arange(seen.size), dots)
        behind = np.arange(line.size) - np.repeat(np.cumsum(dots) - dots, dots)
        is_end = ((behind > 0) & (behind == (dots - 1)[line])).reshape(-1, 1)
        along, down = np.where(is_end, end[line], behind[:, None] * step[line] + begin[line]).T
        shown = np.arange(line.size) % (_DASH + _GAP) < (_DASH if dashed else _DASH + _GAP)
        self.dots(along[shown], down[shown], style)

    def write(self, row: int, column: int, words: str, style: str = "", *, below: bool = False) -> None:
        """Write letters from a place on; what has no room is cut. below: dots hide them, not they the dots."""
        if 0 <= row < self.height:
            for at, letter in enumerate(words, column):
                if 0 <= at < self.width:
                    self._letters[row, at], self._styles[row, at], self._below[row, at] = letter, style, below

    def tint(self, rows: slice, columns: slice, style: str) -> None:
        """Give cells a background, such as `on #202020`."""
        self._grounds[rows, columns] = style

    @property
    def free(self) -> NDArray[np.bool_]:
        """Return which cells (height, width) hold no dot, and no letter but those of a grid, which are dim."""
        dotted = self.bits.reshape(self.height, DOWN, self.width, ACROSS).any(axis=(1, 3))
        written = (self._letters != "") & (self._styles != GRID)
        return np.asarray(~(dotted | written))

    def text(self) -> Text:
        cells = self.bits.reshape(self.height, DOWN, self.width, ACROSS)
        codes = np.einsum("hdwa,da->hw", cells, _BITS)
        whole = Text(no_wrap=True, end="")
        for row in range(self.height):
            drawn = [self._cell(row, column, int(codes[row, column])) for column in range(self.width)]
            for style, alike in groupby(drawn, key=lambda cell: cell[1]):
                whole.append("".join(letter for letter, _ in alike), style)
            whole.append("\n" if row + 1 < self.height else "")
        return whole

    def _cell(self, row: int, column: int, code: int) -> tuple[str, str]:
        letter, style, ground = (str(a[row, column]) for a in (self._letters, self._styles, self._grounds))
        if code and (not letter or self._below[row, column]):
            letter, style = chr(_BRAILLE + code), str(self._inks[row, column])
        return letter or _BLANK, f"{style} {ground}".strip()
