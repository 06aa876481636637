"""A row of pictures in a flow of text, drawn onto the page as vectors where it comes to stand."""

from collections.abc import Sequence

from reportlab.lib.units import mm
from reportlab.platypus import Flowable

from accept.pictures.pdf import page_style
from accept.pictures.pdf.panel_drawing import draw_panel
from checks.picture import Panel


class FigureRow(Flowable):  # type: ignore[misc]  # reportlab has no types
    """columns: of the row, where it has more than there are panels; space_above in pt."""

    def __init__(
        self, panels: Sequence[Panel], height_mm: float, columns: int | None = None, space_above: float = 0.0
    ) -> None:
        super().__init__()
        self.panels = panels
        self.columns = columns or len(panels)
        self.size = (page_style.INNER, height_mm * mm)
        self.spaceBefore = space_above

    def wrap(self, *_: float) -> tuple[float, float]:
        """Width and height [pt]."""
        return self.size

    def draw(self) -> None:
        """Every panel in its cell."""
        width, height = self.size[0] / self.columns, self.size[1]
        for nth, panel in enumerate(self.panels):
            draw_panel(self.canv, panel, nth * width, 0.0, width, height)
