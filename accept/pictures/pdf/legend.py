"""The legend of a panel, in the corner where it hides least, or beside the axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from reportlab.lib.colors import HexColor
from reportlab.pdfbase.pdfmetrics import stringWidth

from accept.pictures.colours import INK
from accept.pictures.pdf.fonts import REGULAR
from accept.pictures.pdf.plot_area import Area
from checks.arrays import Array
from checks.picture import Band, Heights, Item, Line, Mark, Text

_SIZE, _LEADING = 5.8, 7.6  # pt
_HANDLE, _GAP, _EDGE = 9.3, 4.6, 2.0  # pt


@dataclass(frozen=True)
class LegendEntry:
    """An entry of a legend. kind: "line", "dot" or "zone"."""

    words: str
    kind: str
    tint: str
    dash: tuple[float, float] | None = None


def legend(area: Area, entries: Sequence[LegendEntry], items: Sequence[Item], *, beside: bool = False) -> None:
    """Draw the legend if there is anything to explain; beside: at the right of the axes, so that it hides nothing."""
    if not entries:
        return
    canvas = area.canvas
    width = _HANDLE + _GAP + max(stringWidth(e.words, REGULAR, _SIZE) for e in entries) + 2 * _EDGE
    height = len(entries) * _LEADING + 2 * _EDGE - 1.5
    left, bottom = (area.right + _GAP, area.top - height) if beside else _place(area, width, height, items)
    canvas.saveState()
    canvas.setFillColor(HexColor("#ffffff"))
    canvas.setFillAlpha(0.85)
    canvas.rect(left, bottom, width, height, stroke=0, fill=1)
    canvas.setFillAlpha(1.0)
    for nth, entry in enumerate(entries):
        y = bottom + height - _EDGE - (nth + 1) * _LEADING + 3.4
        _handle(area, entry, left + _EDGE, y)
        area.text(left + _EDGE + _HANDLE + _GAP, y - 2.0, entry.words, _SIZE, INK, halo=False)
    canvas.restoreState()


def _handle(area: Area, entry: LegendEntry, x: float, y: float) -> None:
    canvas = area.canvas
    canvas.setStrokeColor(HexColor(entry.tint))
    canvas.setFillColor(HexColor(entry.tint))
    if entry.kind == "dot":
        canvas.circle(x + _HANDLE / 2, y, 1.25, stroke=0, fill=1)
    elif entry.kind == "zone":
        canvas.setFillAlpha(0.35)
        canvas.rect(x, y - 2.0, _HANDLE, 4.0, stroke=0, fill=1)
        canvas.setFillAlpha(1.0)
    else:
        canvas.setLineWidth(0.9)
        canvas.setDash(*(entry.dash or ()))
        canvas.line(x, y, x + _HANDLE, y)
        canvas.setDash()


def _place(area: Area, width: float, height: float, items: Sequence[Item]) -> tuple[float, float]:
    """Return the lower left corner of the box that covers the fewest points: corners first, then sides."""
    x, y = _points(area, items)
    columns = (area.right - _EDGE - width, area.left + _EDGE, area.left + (area.width - width) / 2)
    rows = (area.top - _EDGE - height, area.bottom + _EDGE, area.bottom + (area.height - height) / 2)
    places = [(columns[c], rows[r]) for c, r in ((0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (2, 1), (0, 2), (1, 2))]

    def covered(place: tuple[float, float]) -> int:
        left, bottom = place
        inside = (x >= left - 2) & (x <= left + width + 2) & (y >= bottom - 2) & (y <= bottom + height + 2)
        return int(np.count_nonzero(inside))

    return min(places, key=covered)


def _points(area: Area, items: Sequence[Item]) -> tuple[Array, Array]:
    """Return the points that a legend should not cover, also between the points of curves."""
    xs, ys = [np.empty(0)], [np.empty(0)]
    for item in items:
        match item:
            case Line():
                x, y = area.x_of(item.x), area.y_of(item.y)
                xs += [x] if item.style == "points" else [x, *_between(x)]
                ys += [y] if item.style == "points" else [y, *_between(y)]
            case Band():
                xs += [area.x_of(item.x)] * 2
                ys += [area.y_of(item.lo), area.y_of(item.hi)]
            case Heights():
                xs.append(area.x_of(item.x))
                ys.append(area.y_of(item.y))
            case Text():
                start = float(area.x_of(item.x))
                xs.append(start + np.arange(0.0, stringWidth(item.words, REGULAR, _SIZE), 4.0))
                ys.append(np.full(xs[-1].size, float(area.y_of(item.y)) + 4.0))
            case Mark() if item.label:
                along = np.arange(0.0, stringWidth(item.label, REGULAR, _SIZE), 4.0)  # its words, as they are drawn
                if item.axis == "x":
                    xs.append(np.full(along.size, float(area.x_of(item.at)) - 4.0))
                    ys.append(area.top - 0.03 * area.height - along)
                else:
                    xs.append(area.right - 0.015 * area.width - along)
                    ys.append(np.full(along.size, float(area.y_of(item.at)) + 4.0))
    return np.concatenate(xs), np.concatenate(ys)


def _between(values: Array) -> list[Array]:
    """Return five places between neighbours if they are few."""
    if values.size > 200:
        return []
    return [values[:-1] + (values[1:] - values[:-1]) * part for part in np.arange(1, 6) / 6.0]
