"""A dossier as an unsigned PDF. Equal dossiers give equal bytes."""

import io
import math
from collections.abc import Sequence
from typing import Any

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Flowable, Frame, PageTemplate

from accept.certificate import look, page, story
from accept.certificate.assemble import Placed, assemble
from accept.certificate.dossier import Dossier
from accept.certificate.fonts import register
from accept.pictures import picture, reduced
from checks.picture import Panel

COLUMNS, ROWS = 3, 4  # of panels in one figure
_ROW_HEIGHTS = (58.0, 42.0)  # mm of a row of panels: wanted, and the least that can be read
_LARGEST_ROW = 64.0
_SPACE_ABOVE = 5.0  # pt


class _Gap(Flowable):
    """Room for a figure; remembers where it came to stand."""

    def __init__(self, panels: Sequence[Panel], row_height: float) -> None:
        super().__init__()
        self.panels = panels
        self.row_height = row_height
        self.place: tuple[int, float, float] | None = None

    def getSpaceBefore(self) -> float:
        return _SPACE_ABOVE

    @property
    def size(self) -> tuple[float, float]:
        return look.INNER, self.row_height * mm * math.ceil(len(self.panels) / COLUMNS)

    def wrap(self, available_width: float, available_height: float) -> tuple[float, float]:
        return self.size

    def draw(self) -> None:
        x, y = self.canv.absolutePosition(0, 0)
        self.place = (self.canv.getPageNumber() - 1, x, y)


class _Canvas(Canvas):
    """Holds the pages back until their number is known, for "page x of y"."""

    dossier: Dossier

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._held: list[dict[str, Any]] = []

    def showPage(self) -> None:
        self._held.append(dict(self.__dict__))
        self._startPage()

    def save(self) -> None:
        for number, held in enumerate(self._held, 1):
            self.__dict__.update(held)
            page.footer(self, self.dossier, number, len(self._held))
            super().showPage()
        super().save()


def render(dossier: Dossier) -> bytes:
    """The unsigned certificate: one A4 page if all fits, its attachments and two empty signature fields."""
    register()
    panels = [reduced(panel) for panel in dossier.panels.values()]
    above = [*story.identity(dossier), *story.findings(dossier)]
    below = [*story.information(dossier), *story.remarks(dossier)]
    row = _row_height(above + below, math.ceil(len(panels) / COLUMNS))
    step = COLUMNS * ROWS
    gaps = [_Gap(panels[start : start + step], row) for start in range(0, len(panels), step)]
    text = _build(dossier, [*above, *gaps, *below])
    figures = [_placed(gap) for gap in gaps]
    return assemble(text, figures, dossier.attachments(), page.field_rectangles(), _title(dossier))


def _build(dossier: Dossier, flowables: list[Flowable]) -> bytes:
    buffer = io.BytesIO()
    document = BaseDocTemplate(buffer, pagesize=(look.WIDTH, look.HEIGHT), invariant=1, pageCompression=1)
    first = PageTemplate("first", [_frame(_first_frame())], onPage=lambda c, _: page.first_page(c, dossier))
    later = PageTemplate("later", [_frame(_later_frame())], onPage=lambda c, _: page.later_page(c, dossier))
    first.autoNextPageTemplate = "later"
    document.addPageTemplates([first, later])
    document.build(flowables, canvasmaker=type("_C", (_Canvas,), {"dossier": dossier}))
    return buffer.getvalue()


def _first_frame() -> tuple[float, float]:
    """(bottom, height) of the text on the first page."""
    bottom = look.MARGIN + look.FOOTER + look.BAND
    return bottom, look.HEIGHT - look.MARGIN - look.HEADER - bottom


def _later_frame() -> tuple[float, float]:
    bottom = look.MARGIN + look.FOOTER
    return bottom, look.HEIGHT - look.MARGIN - look.RUNNING_HEAD - bottom


def _frame(place: tuple[float, float]) -> Frame:
    bottom, height = place
    return Frame(look.MARGIN, bottom, look.INNER, height, 0, 0, 0, 0)


def _row_height(flowables: Sequence[Flowable], rows: int) -> float:
    """Height [mm] of a row of panels: what the first page leaves, when that is enough to read them."""
    if rows == 0:
        return _ROW_HEIGHTS[0]
    used = _SPACE_ABOVE + sum(f.wrap(look.INNER, 1e6)[1] + f.getSpaceBefore() + f.getSpaceAfter() for f in flowables)
    left = (_first_frame()[1] - used - 1.0) / mm / rows
    return min(left, _LARGEST_ROW) if left >= _ROW_HEIGHTS[1] else _ROW_HEIGHTS[0]


def _placed(gap: _Gap) -> Placed:
    if gap.place is None:
        raise RuntimeError("a figure of the certificate found no place on any page")
    number, x, y = gap.place
    size = (gap.size[0] / mm, gap.size[1] / mm)
    columns = min(COLUMNS, max(len(gap.panels), 2))
    return Placed(number, x, y, picture(gap.panels, "pdf", size, columns))


def _title(dossier: Dossier) -> str:
    return f"Acceptance certificate {dossier.serial}: {dossier.result['verdict']}"
