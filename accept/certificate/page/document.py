"""A certificate's content as an unsigned PDF. Equal contents give equal bytes."""

import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Flowable, Frame, PageTemplate

from accept.base.documents.results import SIMULATED
from accept.certificate.contents.content import CertificateContent
from accept.certificate.page import body, fixed_parts
from accept.pictures.pdf import page_style
from accept.pictures.pdf.assemble import assemble
from accept.pictures.pdf.fonts import register
from accept.pictures.pdf.panels import FigureRow

_ROW_HEIGHTS = (42.0, 64.0)  # mm of a row of panels: the least that can be read, the most that is of use
_SPACE_ABOVE = 5.0  # pt


class _Canvas(Canvas):  # type: ignore[misc]  # reportlab has no types
    """A canvas that keeps the pages until their number is known, for "page x of y"."""

    contents: CertificateContent

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._held: list[dict[str, Any]] = []

    def showPage(self) -> None:
        self._held.append(dict(self.__dict__))
        self._startPage()

    def save(self) -> None:
        for number, held in enumerate(self._held, 1):
            self.__dict__.update(held)
            fixed_parts.footer(self, self.contents, number, len(self._held))
            super().showPage()
        super().save()


def render(contents: CertificateContent) -> bytes:
    """Return the unsigned certificate: one A4 page if all fits, its attachments and two empty signature fields."""
    register()
    panels = list(contents.pictures.values())
    above = [*body.identity(contents), *body.findings(contents)]
    more = [*_explanation(contents.result), *body.information(contents), *body.budgets(contents)]
    below = [*more, *body.remarks(contents), *body.compared(contents)]
    shown = body.pictures(contents)  # behind everything else: they take no room from the findings
    columns = 2 if len(panels) in (1, 2, 4) else 3
    rows = [panels[start : start + columns] for start in range(0, len(panels), columns)]
    heights = _row_heights(_height(above), _height(below), len(rows))
    figures = [FigureRow(row, height, columns, _SPACE_ABOVE) for row, height in zip(rows, heights, strict=True)]
    text = _build(contents, [*above, *figures, *below, *shown])
    fields = fixed_parts.field_rectangles()
    return assemble(text, contents.attachments(), fields, _title(contents), fixed_parts.open_fields())


def _build(contents: CertificateContent, flowables: list[Flowable]) -> bytes:
    buffer = io.BytesIO()
    document = BaseDocTemplate(buffer, pagesize=(page_style.WIDTH, page_style.HEIGHT), invariant=1, pageCompression=1)
    first = PageTemplate("first", [_frame(_first_frame())], onPage=lambda c, _: fixed_parts.first_page(c, contents))
    later = PageTemplate("later", [_frame(_later_frame())], onPage=lambda c, _: fixed_parts.later_page(c, contents))
    first.autoNextPageTemplate = "later"
    document.addPageTemplates([first, later])
    document.build(flowables, canvasmaker=type("_C", (_Canvas,), {"contents": contents}))
    return buffer.getvalue()


def _first_frame() -> tuple[float, float]:
    bottom = page_style.MARGIN + page_style.FOOTER + page_style.BAND
    return bottom, page_style.HEIGHT - page_style.MARGIN - page_style.HEADER - bottom


def _later_frame() -> tuple[float, float]:
    bottom = page_style.MARGIN + page_style.FOOTER
    return bottom, page_style.HEIGHT - page_style.MARGIN - page_style.RUNNING_HEAD - bottom


def _frame(place: tuple[float, float]) -> Frame:
    bottom, height = place
    return Frame(page_style.MARGIN, bottom, page_style.INNER, height, 0, 0, 0, 0)


def _explanation(result: Mapping[str, Any]) -> list[Flowable]:
    if result.get("gap") is None:
        return []
    from accept.certificate.page.gap_section import explanation

    return explanation(result)


def _row_heights(above: float, below: float, rows: int) -> list[float]:
    """Return the height [mm] of each row of panels between text of these heights [pt]. All rows go on the first page if
    they stay legible; otherwise as many as fill it, and the others in equal parts on as few pages as hold them."""
    least, most = _ROW_HEIGHTS
    free, later = ((room - 1.0) / mm for room in (_first_frame()[1] - above, _later_frame()[1]))
    space = _SPACE_ABOVE / mm
    if rows and ((free - below / mm) / rows - space) >= least:
        return [min((free - below / mm) / rows - space, most)] * rows
    fitting = max(min(int(free / (least + space)), rows), 0)
    rest = rows - fitting
    first = [min(free / fitting - space, most)] * fitting if fitting else []
    on_a_page = math.ceil(rest / math.ceil(rest / int(later / (least + space)))) if rest else 1
    return first + [min(later / on_a_page - space, most)] * rest


def _height(flowables: Sequence[Flowable]) -> float:
    """Return an upper bound of the height of the text [pt]: neighbours share some of the space between them."""
    height: float = sum(f.wrap(page_style.INNER, 1e6)[1] + f.getSpaceBefore() + f.getSpaceAfter() for f in flowables)
    return height


def _title(contents: CertificateContent) -> str:
    title = SIMULATED if contents.simulated else "Acceptance certificate"
    return f"{title} {contents.serial}: {contents.result['verdict']}"
