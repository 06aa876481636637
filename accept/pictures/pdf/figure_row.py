"""Pictures in a flow of text, beside or below each other, drawn onto the page as vectors at their final position."""

from collections.abc import Sequence
from dataclasses import replace

from reportlab.lib.units import mm
from reportlab.platypus import Flowable

from accept.pictures.pdf import page_style
from accept.pictures.pdf.panel_drawing import BOTTOM, TOP, Room, draw_panel
from checks.picture import Panel


class FigureRow(Flowable):  # type: ignore[misc]  # reportlab has no types
    """columns: of the row, if it has more columns than panels; space_above in pt."""

    def __init__(
        self, panels: Sequence[Panel], height_mm: float, columns: int | None = None, space_above: float = 0.0
    ) -> None:
        super().__init__()
        self.panels = panels
        self.columns = columns or len(panels)
        self.size = (page_style.INNER, height_mm * mm)
        self.spaceBefore = space_above

    def wrap(self, *_: float) -> tuple[float, float]:
        """Return width and height [pt]."""
        return self.size

    def draw(self) -> None:
        """Draw every panel in its cell."""
        width, height = self.size[0] / self.columns, self.size[1]
        for nth, panel in enumerate(self.panels):
            draw_panel(self.canv, panel, nth * width, 0.0, width, height)


LEGEND = 38.0 * mm  # beside the axes
BETWEEN = 2.2 * mm  # two panels on one axis


class FigureStack(Flowable):  # type: ignore[misc]
    """Panels below each other on one horizontal axis, with numbers under the last only; legends at the right.
    heights_mm: of the axes of each. The first has a title."""

    def __init__(self, panels: Sequence[Panel], heights_mm: Sequence[float]) -> None:
        super().__init__()
        self.panels, self.heights = panels, [h * mm for h in heights_mm]
        self.size = (page_style.INNER, TOP + sum(self.heights) + BETWEEN * (len(panels) - 1) + BOTTOM)

    def wrap(self, *_: float) -> tuple[float, float]:
        """Return width and height [pt]."""
        return self.size

    def draw(self) -> None:
        """Draw every panel over the width, the first on top."""
        top = self.size[1] - TOP
        for nth, (panel, height) in enumerate(zip(self.panels, self.heights, strict=True)):
            shown = panel if nth == 0 else replace(panel, title="")
            last = nth == len(self.panels) - 1
            room = Room(right=LEGEND, bottom=BOTTOM, top=TOP, x_words=last, legend_right=True)
            draw_panel(self.canv, shown, 0.0, top - height - BOTTOM, self.size[0], height + BOTTOM + TOP, room)
            top -= height + BETWEEN
