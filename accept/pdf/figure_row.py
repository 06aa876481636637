"""Room for a row of pictures in a flow of text: they are drawn to where it came to stand."""

from collections.abc import Sequence

from reportlab.lib.units import mm
from reportlab.platypus import Flowable

from accept.pdf import page_style
from accept.pdf.assemble import Placed
from accept.pictures.draw import picture
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
        self.place: tuple[int, float, float] | None = None

    def wrap(self, *_: float) -> tuple[float, float]:
        return self.size

    def draw(self) -> None:
        x, y = self.canv.absolutePosition(0, 0)
        self.place = (self.canv.getPageNumber() - 1, x, y)

    def placed(self) -> Placed:
        """The pictures at their place, once the text stands. Raises RuntimeError when they have none."""
        if self.place is None:
            raise RuntimeError("a row of pictures found no place on any page")
        width, height = self.size
        return Placed(*self.place, picture(self.panels, "pdf", (width / mm, height / mm), self.columns))
