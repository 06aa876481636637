"""Panels drawn straight onto a page, as vectors, and in a flow of text, beside or below each other. The look is that of
`accept.pictures`, which draws panels into files of their own."""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from PIL import Image as Pixels
from reportlab.lib.colors import Color, HexColor
from reportlab.lib.units import mm
from reportlab.lib.utils import ImageReader
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from accept.pictures.colours import GREY, GRID, INK, MAP_STEPS, tinted
from accept.pictures.pdf import page_style
from accept.pictures.pdf.fonts import BOLD, REGULAR, fitting_size
from accept.pictures.pdf.legend import LegendEntry, legend
from accept.pictures.pdf.plot_area import Area, dots, lines, polygon, polyline
from accept.pictures.scale import LARGEST, Scale, edges, runs, scales
from accept.pictures.words import pretty
from checks.arrays import Array
from checks.picture import Band, Heights, Image, Item, Line, Mark, Panel, Span, Text

LEFT, RIGHT, BOTTOM, TOP = 13.0 * mm, 2.5 * mm, 8.5 * mm, 6.0 * mm  # around the axes of each panel
_MAP_RIGHT = 13.0 * mm  # where a colour bar stands there
_TITLE, _LABEL, _TICK = 7.5, 6.5, 6.0  # pt
_TICK_LENGTH, _PAD = 2.0, 2.0  # pt
_X_TICK_ROOM, _Y_TICK_ROOM = 19.0, 13.0  # pt of the axis for each tick, at least


@dataclass(frozen=True)
class Room:
    """Margins [pt] about the axes of a panel. x_words: numbers and label under the axis, which the lowest of several
    panels that stand on one axis has for all. legend_right: in the margin instead of over the curves."""

    right: float = RIGHT
    bottom: float = BOTTOM
    top: float = TOP
    x_words: bool = True
    legend_right: bool = False


def draw_panel(
    canvas: Canvas, panel: Panel, x: float, y: float, width: float, height: float, room: Room | None = None
) -> None:
    """Draw a panel into the rectangle with its lower left corner at x, y [pt]."""
    has_bar = any(isinstance(item, Heights | Image) for item in panel.items)
    around = room or Room(right=_MAP_RIGHT if has_bar else RIGHT)
    left = LEFT + _room_for_names(panel, width)
    wide, tall = max(width - left - around.right, 3.0), max(height - around.bottom - around.top, 3.0)
    area = Area(canvas, x + left, y + around.bottom, wide, tall, *scales(panel, wide, tall))
    canvas.saveState()
    canvas.setLineJoin(1)
    numbers = _axes(area, not any(isinstance(item, Image) for item in panel.items), around.x_words, left)
    entries = draw_items(area, panel.items)
    _words(area, panel, numbers, around.x_words)
    legend(area, entries, panel.items, beside=around.legend_right)
    canvas.restoreState()


def _room_for_names(panel: Panel, width: float) -> float:
    """Return the extra room [pt] for long row names, which would otherwise be half as large as numbers."""
    room = LEFT - _TICK_LENGTH - _PAD - _LABEL
    longest = max((stringWidth(name, REGULAR, _TICK) for name in panel.y_names), default=0.0)
    return min(longest - room, width / 3) if longest > 2 * room else 0.0


def _axes(area: Area, grid: bool, x_numbers: bool, left: float) -> float:
    """Draw grid, both axes, ticks and numbers; return the width [pt] of the left numbers. left: the room for them."""
    canvas = area.canvas
    x_ticks = area.x_scale.ticks(max(2, int(area.width / _X_TICK_ROOM)))
    y_ticks = area.y_scale.ticks(max(2, int(area.height / _Y_TICK_ROOM)))
    xs = [(float(area.x_of(value)), words) for value, words in x_ticks]
    ys = [(float(area.y_of(value)), words) for value, words in y_ticks]
    if grid:
        canvas.setStrokeColor(HexColor(GRID))
        canvas.setLineWidth(0.5)
        canvas.drawPath(lines([(x, area.bottom, x, area.top) for x, _ in xs]))
        canvas.drawPath(lines([(area.left, y, area.right, y) for y, _ in ys]))
    canvas.setStrokeColor(HexColor(GREY))
    canvas.setLineWidth(0.6)
    corner = (area.left, area.bottom)
    canvas.drawPath(lines([(*corner, area.right, area.bottom), (*corner, area.left, area.top)]))
    canvas.setLineWidth(0.5)
    canvas.drawPath(lines([(x, area.bottom - _TICK_LENGTH, x, area.bottom) for x, _ in xs]))
    canvas.drawPath(lines([(area.left - _TICK_LENGTH, y, area.left, y) for y, _ in ys]))
    canvas.setFillColor(HexColor(INK))
    canvas.setFont(REGULAR, _TICK)
    end = -1e9  # where the number before ends: one that would touch it is left out
    for x, words in xs if x_numbers else ():
        half = stringWidth(words, REGULAR, _TICK) / 2
        if x - half > end + 3.0:
            canvas.drawCentredString(x, area.bottom - _TICK_LENGTH - _PAD - 4.6, words)
            end = x + half
    room, widest = left - _TICK_LENGTH - _PAD - _LABEL, 0.0
    for y, words in ys:
        size = fitting_size(words, REGULAR, _TICK, room)
        canvas.setFont(REGULAR, size)
        canvas.drawRightString(area.left - _TICK_LENGTH - _PAD, y - 2.1, words)
        widest = max(widest, stringWidth(words, REGULAR, size))
    return widest


def _words(area: Area, panel: Panel, numbers: float, x_words: bool) -> None:
    """Write title and labels, smaller if they would leave the panel. numbers: width of the left axis's numbers."""
    canvas = area.canvas
    canvas.setFillColor(HexColor(INK))
    title, x_label, y_label = (pretty(text) for text in (panel.title, panel.x_label, panel.y_label))
    canvas.setFont(BOLD, fitting_size(title, BOLD, _TITLE, area.width + 8.0))
    canvas.drawString(area.left, area.top + 5.0, title)
    if x_words:
        canvas.setFont(REGULAR, fitting_size(x_label, REGULAR, _LABEL, area.width + 8.0))
        canvas.drawCentredString(area.left + area.width / 2, area.bottom - BOTTOM + 5.0, x_label)
    canvas.setFont(REGULAR, fitting_size(y_label, REGULAR, _LABEL, area.height + 20.0))
    canvas.saveState()
    canvas.translate(
        max(area.left - LEFT + _LABEL, area.left - _TICK_LENGTH - 2 * _PAD - numbers - 1.5),
        area.bottom + area.height / 2,
    )
    canvas.rotate(90)
    canvas.drawCentredString(0, 0, y_label)
    canvas.restoreState()


class FigureRow(Flowable):  # type: ignore[misc]  # reportlab has no types
    """A row of panels on a page. columns: of the row, if it has more columns than panels; space_above in pt."""

    def __init__(
        self, panels: Sequence[Panel], height_mm: float, columns: int | None = None, space_above: float = 0.0
    ) -> None:
        super().__init__()
        self.panels = panels
        self.columns = columns or len(panels)
        self.width, self.height = page_style.INNER, height_mm * mm
        self.spaceBefore = space_above

    def draw(self) -> None:
        width = self.width / self.columns
        for nth, panel in enumerate(self.panels):
            draw_panel(self.canv, panel, nth * width, 0.0, width, self.height)


LEGEND = 38.0 * mm  # beside the axes
BETWEEN = 2.2 * mm  # two panels on one axis


class FigureStack(Flowable):  # type: ignore[misc]
    """Panels below each other on one horizontal axis, with numbers under the last only; legends at the right.
    heights_mm: of the axes of each. The first has a title."""

    def __init__(self, panels: Sequence[Panel], heights_mm: Sequence[float]) -> None:
        super().__init__()
        self.panels, self.heights = panels, [h * mm for h in heights_mm]
        self.width = page_style.INNER
        self.height = TOP + sum(self.heights) + BETWEEN * (len(panels) - 1) + BOTTOM

    def draw(self) -> None:
        top = self.height - TOP
        for nth, (panel, height) in enumerate(zip(self.panels, self.heights, strict=True)):
            shown = panel if nth == 0 else replace(panel, title="")
            last = nth == len(self.panels) - 1
            room = Room(right=LEGEND, bottom=BOTTOM, top=TOP, x_words=last, legend_right=True)
            draw_panel(self.canv, shown, 0.0, top - height - BOTTOM, self.width, height + BOTTOM + TOP, room)
            top -= height + BETWEEN


FEW_POINTS = 60  # above this they are a cloud and drawn small
_CURVE, _LARGE_DOT, _SMALL_DOT = 0.9, 2.5, 1.2  # pt
_SMALL = 5.8  # pt of words among the curves
_DASHES = {"dashed": (3.6, 1.8), "again": (1.8, 0.9), "mark": (4.0, 1.6)}
_ORDER = {Image: 0, Span: 1, Band: 2, Line: 4, Mark: 5, Heights: 6, Text: 7}
_BAR = 2.0 * mm


def draw_items(area: Area, items: Sequence[Item]) -> list[LegendEntry]:
    """Draw the items of a panel, zones below curves below words, and return the entries of its legend."""
    drawn = tinted(items)
    drawn.sort(key=lambda one: _ORDER[type(one[0])] - (getattr(one[0], "role", "") in ("quiet", "before")))
    for item, tint, again in drawn:
        area.canvas.saveState()
        _DRAWERS[type(item)](area, item, HexColor(tint), again)
        area.canvas.restoreState()
    shown = [one for one in drawn if isinstance(one[0], Line | Band | Span) and one[0].label]
    order = {id(item): place for place, item in enumerate(items)}
    shown.sort(key=lambda one: order[id(one[0])])
    return [LegendEntry(pretty(item.label), _key_shape(item), tint, _dash(item, again)) for item, tint, again in shown]  # type: ignore[union-attr]


def _key_shape(item: Item) -> str:
    if isinstance(item, Line):
        return "dot" if item.style == "points" else "line"
    return "zone"


def _dash(item: Item, again: bool) -> tuple[float, float] | None:
    if not isinstance(item, Line) or item.style == "points":
        return None
    return _DASHES["dashed"] if item.style == "dashed" else _DASHES["again"] if again else None


def _line(area: Area, item: Line, tint: Color, again: bool) -> None:
    canvas, x, y = area.canvas, area.x_of(item.x), area.y_of(item.y)
    area.clip()
    canvas.setStrokeColor(tint)
    if item.style == "points":
        canvas.setLineCap(1)
        canvas.setLineWidth(_LARGE_DOT if len(item.x) <= FEW_POINTS else _SMALL_DOT)
        canvas.drawPath(dots(x, y))
        return
    canvas.setLineWidth(_CURVE)
    dash = _dash(item, again)
    if dash:
        canvas.setDash(*dash)
    canvas.drawPath(polyline(x, y))


def _band(area: Area, item: Band, tint: Color, again: bool) -> None:  # noqa: ARG001 - as every drawer
    x, lo, hi = area.x_of(item.x), area.y_of(item.lo), area.y_of(item.hi)
    area.clip()
    _zone_colour(area, tint, 0.35)
    for part in runs(x, lo, hi):
        there_and_back = np.concatenate([x[part], x[part][::-1]]), np.concatenate([hi[part], lo[part][::-1]])
        area.canvas.drawPath(polygon(*there_and_back), stroke=0, fill=1)


def _span(area: Area, item: Span, tint: Color, again: bool) -> None:  # noqa: ARG001
    place, first, last = (area.x_of, area.left, area.right) if item.axis == "x" else (area.y_of, area.bottom, area.top)
    ends = [
        min(max(float(place(v)), first), last) if math.isfinite(v) else edge
        for v, edge in ((item.lo, first), (item.hi, last))
    ]
    _zone_colour(area, tint, 0.28)
    if item.axis == "x":
        area.canvas.rect(ends[0], area.bottom, ends[1] - ends[0], area.height, stroke=0, fill=1)
    else:
        area.canvas.rect(area.left, ends[0], area.width, ends[1] - ends[0], stroke=0, fill=1)


def _zone_colour(area: Area, tint: Color, alpha: float) -> None:
    area.canvas.setFillColor(tint)
    area.canvas.setFillAlpha(alpha)


def _mark(area: Area, item: Mark, tint: Color, again: bool) -> None:  # noqa: ARG001
    canvas, words = area.canvas, pretty(item.label)
    across = item.axis == "y"
    at = float(area.y_of(item.at) if across else area.x_of(item.at))
    first, last = (area.bottom, area.top) if across else (area.left, area.right)
    if not first - 1e-6 <= at <= last + 1e-6:
        return
    canvas.setStrokeColor(tint)
    canvas.setLineWidth(0.8)
    canvas.setDash(*_DASHES["mark"])
    canvas.line(*((area.left, at, area.right, at) if across else (at, area.bottom, at, area.top)))
    canvas.setDash()
    if not words:
        return
    if across:
        below = at - first > 0.88 * (last - first)
        x = area.right - 0.015 * area.width - stringWidth(words, REGULAR, _SMALL)
        area.text(x, at - 5.5 if below else at + 1.6, words, _SMALL, INK)
        return
    beyond = at - first < 0.08 * (last - first)
    size = fitting_size(words, REGULAR, _SMALL, 0.94 * area.height)
    canvas.translate(at + 5.5 if beyond else at - 1.6, area.top - 0.03 * area.height)
    canvas.rotate(90)
    area.text(-stringWidth(words, REGULAR, size), 0.0, words, size, INK)


def _text(area: Area, item: Text, tint: Color, again: bool) -> None:  # noqa: ARG001
    x, y = float(area.x_of(item.x)) + 2.0, float(area.y_of(item.y)) + 2.0
    if math.isfinite(x) and math.isfinite(y):
        area.text(x, y, pretty(item.words), _SMALL, "#" + tint.hexval()[2:])


def _heights(area: Area, item: Heights, tint: Color, again: bool) -> None:  # noqa: ARG001
    """Draw numbered dots; the height is written outside, away from the other dots."""
    canvas, scale = area.canvas, _map_scale(item.z)
    valid = item.z[np.abs(item.z) < LARGEST]
    spread = float(np.ptp(valid)) if valid.size else 0.0
    decimals = max(0, 1 - math.floor(math.log10(spread))) if spread > 0 else 1
    canvas.setStrokeColor(HexColor(INK))
    canvas.setLineWidth(0.5)
    places = item.y[np.abs(item.y) < LARGEST]
    middle = float(np.median(places)) if places.size else 0.0
    for number, (x, y, z) in enumerate(zip(item.x, item.y, item.z, strict=True), 1):
        at, level = (float(area.x_of(x)), float(area.y_of(y))), float(scale.at(z))
        shade = _shades(np.array([level]))[0]
        canvas.setFillColorRGB(*(shade / 255.0))
        if not math.isfinite(at[0] + at[1]):
            continue
        if math.isfinite(level):
            canvas.circle(*at, 4.0, stroke=1, fill=1)
        _centre(area, *at, str(number), 5.0, INK if level > 0.5 or not math.isfinite(level) else "#ffffff")
        _centre(area, at[0], at[1] + (9.0 if y >= middle else -9.0), f"{z:.{decimals}f}", _SMALL, INK)
    _colour_bar(area, scale, item.label)


def _centre(area: Area, x: float, y: float, words: str, size: float, ink: str) -> None:
    area.text(x - stringWidth(words, REGULAR, size) / 2, y - 0.36 * size, words, size, ink, halo=False)


def _image(area: Area, item: Image, tint: Color, again: bool) -> None:  # noqa: ARG001
    """Draw a map as pixels: cells of equal width become one each."""
    scale, z = _map_scale(item.z), np.asarray(item.z, float)
    x, y = (f(edges(c)) for f, c in ((area.x_of, item.x), (area.y_of, item.y)))
    if not np.isfinite([*x, *y]).all():
        return
    order = z[:: -1 if y[-1] > y[0] else 1, :: 1 if x[-1] > x[0] else -1]
    area.clip()
    left, bottom = min(x[0], x[-1]), min(y[0], y[-1])
    _pixels(area, _shades(scale.at(order)), left, bottom, abs(x[-1] - x[0]), abs(y[-1] - y[0]))
    area.canvas.restoreState()
    area.canvas.saveState()
    _colour_bar(area, scale, item.label)


def _pixels(area: Area, shades: Array, left: float, bottom: float, width: float, height: float) -> None:
    content = io.BytesIO()
    Pixels.fromarray(shades.astype(np.uint8), "RGB").save(content, "PNG")
    area.canvas.drawImage(ImageReader(content), left, bottom, width, height)


def _map_scale(z: Array) -> Scale:
    values = np.asarray(z, float)
    values = values[np.abs(values) < LARGEST]  # no NaN, no inf
    lo, hi = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    return Scale(lo, hi if hi > lo else lo + 1.0)


def _shades(level: Array) -> Array:
    """Return (..., 3) colours 0..255 of levels 0..1; white if a level is missing."""
    steps = np.array([[int(step[k : k + 2], 16) for k in (1, 3, 5)] for step in MAP_STEPS], float)
    places = np.linspace(0.0, 1.0, len(steps))
    finite = np.isfinite(level)
    safe = np.where(finite, level, 0.0)
    found = np.stack([np.interp(safe, places, steps[:, k]) for k in range(3)], axis=-1)
    return np.asarray(np.where(finite[..., None], np.rint(found), 255.0))


def _colour_bar(area: Area, scale: Scale, label: str) -> None:
    canvas, left = area.canvas, area.right + 1.5 * mm
    _pixels(area, _shades(np.linspace(1.0, 0.0, 64)[:, None]), left, area.bottom, _BAR, area.height)
    canvas.setFillColor(HexColor(INK))
    canvas.setFont(REGULAR, 5.5)
    widest = 0.0
    for value, words in scale.ticks(max(2, int(area.height / 13.0))):
        canvas.drawString(left + _BAR + 2.0, area.bottom + area.height * float(scale.at(value)) - 2.0, words)
        widest = max(widest, stringWidth(words, REGULAR, 5.5))
    if label:
        size = fitting_size(pretty(label), REGULAR, _SMALL, area.height + 10.0)
        canvas.setFont(REGULAR, size)
        canvas.translate(left + _BAR + 3.5 + widest + size, area.bottom + area.height / 2)
        canvas.rotate(90)
        canvas.drawCentredString(0, 0, pretty(label))


_DRAWERS: dict[type, Callable[[Area, Any, Color, bool], None]] = {
    Line: _line,
    Band: _band,
    Span: _span,
    Mark: _mark,
    Text: _text,
    Heights: _heights,
    Image: _image,
}
