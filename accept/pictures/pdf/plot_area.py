"""The area within the axes of a panel on a page: from values to points of the page, and paths of many points."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from reportlab.lib.colors import HexColor
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject
from reportlab.pdfgen.textobject import PDFTextObject

from accept.pictures.pdf.fonts import REGULAR
from accept.pictures.scale import Scale, runs
from checks.arrays import Array

FAR = 10_000.0  # pt: points farther away are drawn there; viewers need not support larger numbers
_HALO = 1.5  # pt of white around words, so that they can be read across a curve


@dataclass(frozen=True, eq=False)
class Area:
    """Place [pt] of the axes on a page, and the scales along them."""

    canvas: Canvas
    left: float
    bottom: float
    width: float
    height: float
    x_scale: Scale
    y_scale: Scale

    @property
    def right(self) -> float:
        return self.left + self.width

    @property
    def top(self) -> float:
        return self.bottom + self.height

    def x_of(self, values: Array | float) -> Array:
        """Return the places [pt] of values along x."""
        return np.asarray(np.clip(self.left + self.width * self.x_scale.at(values), -FAR, FAR))

    def y_of(self, values: Array | float) -> Array:
        """Return the places [pt] of values along y."""
        return np.asarray(np.clip(self.bottom + self.height * self.y_scale.at(values), -FAR, FAR))

    def clip(self) -> None:
        """Let nothing be drawn outside the axes, until the canvas is restored."""
        path = self.canvas.beginPath()
        path.rect(self.left, self.bottom, self.width, self.height)
        self.canvas.clipPath(path, stroke=0, fill=0)

    def text(self, x: float, y: float, words: str, size: float, colour: str, *, halo: bool = True) -> None:
        """Write words from x, y [pt] to the right, with white around them."""
        text: PDFTextObject = self.canvas.beginText(x, y)
        text.setFont(REGULAR, size)
        text.setFillColor(HexColor(colour))
        if halo:
            self.canvas.setLineWidth(_HALO)
            text.setStrokeColor(HexColor("#ffffff"))
            text.setTextRenderMode(1)
            text.textOut(words)
            text.setTextOrigin(x, y)
            text.setTextRenderMode(0)
        text.textOut(words)
        self.canvas.drawText(text)


def polyline(x: Array, y: Array) -> PDFPathObject:
    """Return a path through the points [pt], interrupted at NaN. It is written at once: reportlab's own way, a call a
    point, takes ten times as long as all else on a page."""
    code = []
    for part in runs(x, y):
        code.append(_joined(x[part], y[part]))
    return PDFPathObject(code=code)


def polygon(x: Array, y: Array) -> PDFPathObject:
    """Return a closed path through the points [pt]."""
    return PDFPathObject(code=[_joined(x, y) + " h"])


def dots(x: Array, y: Array) -> PDFPathObject:
    """Return lines of no length, which round caps make into dots."""
    good = np.isfinite(x) & np.isfinite(y)
    pairs = np.stack([x[good], y[good], x[good], y[good]], axis=1)
    return PDFPathObject(code=[("%.2f %.2f m %.2f %.2f l " * len(pairs)) % tuple(pairs.ravel().tolist())])


def lines(ends: Iterable[tuple[float, float, float, float]]) -> PDFPathObject:
    """Return lines from x, y to x, y [pt] as one path."""
    return PDFPathObject(code=[f"{x:.2f} {y:.2f} m {to_x:.2f} {to_y:.2f} l" for x, y, to_x, to_y in ends])


def _joined(x: Array, y: Array) -> str:
    numbers = tuple(np.stack([x, y], axis=1).ravel().tolist())
    return ("%.2f %.2f m" + " %.2f %.2f l" * (len(x) - 1)) % numbers
