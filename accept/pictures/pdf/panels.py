"""Panels drawn straight onto a page, as vectors, and in a flow of text, beside or below each other. The look is that of
`accept.pictures`, which draws panels into files of their own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from reportlab.lib.colors import HexColor
from reportlab.lib.units import mm
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from accept.pictures.colours import GREY, GRID, INK
from accept.pictures.pdf import page_style
from accept.pictures.pdf.fonts import BOLD, REGULAR, fitting_size
from accept.pictures.pdf.legend import legend
from accept.pictures.pdf.panel_items import draw_items
from accept.pictures.pdf.plot_area import Area, lines
from accept.pictures.scale import scales
from accept.pictures.words import pretty
from checks.picture import Heights, Image, Panel

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
