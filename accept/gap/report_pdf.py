"""gap.pdf: the gap report for people. Equal answers give equal bytes."""

import io
from collections.abc import Mapping, Sequence

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    BaseDocTemplate,
    Flowable,
    Frame,
    KeepTogether,
    PageBreak,
    PageTemplate,
    Spacer,
    Table,
    TableStyle,
)

from accept.gap.document import to_json
from accept.gap.improved_model import AddedElement
from accept.gap.report import MAP, pictures, report
from accept.gap.text import headline_of_document
from accept.pictures import blocks
from accept.pictures.blocks import Block, Heading, Picture, Role, Sentence
from accept.pictures.pdf import page_style
from accept.pictures.pdf.assemble import assemble
from accept.pictures.pdf.fonts import BOLD, REGULAR, fitting_size, register
from accept.pictures.pdf.page_style import words
from accept.pictures.pdf.panels import FigureRow, FigureStack
from accept.pictures.reduce import reduce_panel
from checks.gap import Result
from checks.picture import Panel

HEAD = 20 * mm
MAP_HEIGHT = 40.0  # mm
BODE = 27.0, 14.0, 15.5  # mm: axes of magnitude, phase and what is left, of three channels on a page
COLUMNS: dict[str, dict[int, tuple[int, ...]]] = {  # mm, by the head
    "Channel": {7: (24, 24, 24, 28, 24, 30, 28), 4: (46, 46, 46, 44), 6: (18, 20, 20, 18, 56, 50)},
    "With": {n: (80, *[34] * (n - 1)) for n in range(2, 5)},
    "Explanation tried": {4: (66, 22, 24, 70)},
    "Named value": {5: (50, 36, 36, 16, 44)},
    "Model value": {4: (56, 44, 44, 38)},
}
STRONG = (Role.FOUND, Role.RIVAL, Role.UNNAMED)


def render(serial: str, result: Result, added: Sequence[AddedElement] = ()) -> bytes:
    """Return the report as a PDF. added: elements that were added to the improved model without a name."""
    register()
    drawn, shown = pictures(result, added), report(result, added)
    scale = min(3.0 / len(result.before.data.channels), 1.6)
    story: list[Flowable] = []
    for above, block in zip([None, *shown], shown, strict=False):
        if isinstance(above, blocks.Table) and isinstance(block, Sentence):
            story.append(Spacer(1, 4))
        story += _flowables(block, drawn, scale)
    buffer = io.BytesIO()
    document = BaseDocTemplate(buffer, pagesize=(page_style.WIDTH, page_style.HEIGHT), invariant=1, pageCompression=1)
    bottom = page_style.MARGIN + page_style.FOOTER
    frame = Frame(
        page_style.MARGIN, bottom, page_style.INNER, page_style.HEIGHT - page_style.MARGIN - HEAD - bottom, 0, 0, 0, 0
    )
    document.addPageTemplates([PageTemplate("page", [frame], onPage=lambda c, _: _head(c, serial, result))])
    document.build(story)
    return assemble(buffer.getvalue(), {}, {}, f"Gap report {serial}")


def _head(canvas: Canvas, serial: str, result: Result) -> None:
    top = page_style.HEIGHT - page_style.MARGIN
    canvas.setFillColor(page_style.GREY_COLOUR)
    canvas.setFont(BOLD, 8)
    canvas.drawString(page_style.MARGIN, top - 8, "GAP ANALYSIS")
    canvas.setFillColor(page_style.INK_COLOUR)
    canvas.setFont(BOLD, fitting_size(serial, BOLD, 24, 80 * mm))
    canvas.drawString(page_style.MARGIN, top - 34, serial)
    canvas.setFont(REGULAR, 7)
    canvas.drawString(page_style.MARGIN, top - 46, f"model {result.model}, damping {result.damping}")
    sign = page_style.GAP_SIGNS[result.verdict]
    left, width, height = page_style.WIDTH - page_style.MARGIN - 100 * mm, 100 * mm, 13 * mm
    canvas.setFillColor(sign.fill)
    canvas.setStrokeColor(page_style.GREY_COLOUR)
    canvas.roundRect(left, top - height, width, height, 2 * mm, stroke=int(sign.fill == page_style.WHITE), fill=1)
    canvas.setFillColor(sign.ink)
    line = headline_of_document(to_json(serial, result))
    canvas.setFont(BOLD, fitting_size(line, BOLD, 15, width - 8 * mm))
    canvas.drawCentredString(left + width / 2, top - height / 2 - 5, line)
    canvas.setFillColor(page_style.GREY_COLOUR)
    canvas.setFont(REGULAR, 6)
    canvas.drawRightString(page_style.WIDTH - page_style.MARGIN, page_style.MARGIN, f"page {canvas.getPageNumber()}")


def _flowables(block: Block, drawn: Mapping[str, Panel], scale: float) -> list[Flowable]:
    match block:
        case Heading():
            return [*([PageBreak()] if block.new_page else []), words(block.words, page_style.HEADING)]
        case Sentence():
            quiet = page_style.QUIET if block.role is Role.LEGEND else page_style.SMALL
            said = words(block.words, page_style.STRONG if block.role in STRONG else quiet)
            return [said, *([words(block.more, page_style.SMALL)] if block.more else [])]
        case Picture():
            panels = [reduce_panel(drawn[name]) for name in block.panels if name in drawn]
            beside = block.panels[0] == MAP
            return [FigureRow(panels, MAP_HEIGHT) if beside else FigureStack(panels, [h * scale for h in BODE])]
    return [_table(block)]


def _table(table: blocks.Table) -> Flowable:
    widths_mm = COLUMNS[table.head[0]][len(table.head)]
    cells = [[words(h, page_style.TABLE_HEAD) for h in table.head]]
    cells += [[words(value, page_style.SMALL) for value in row] for row in table.rows]
    drawn = Table(cells, colWidths=[w * mm for w in widths_mm], hAlign="LEFT")
    every = ((0, 0), (-1, -1))
    drawn.setStyle(
        TableStyle(
            [
                ("LINEBELOW", (0, 0), (-1, 0), 0.6, page_style.GREY_COLOUR),
                ("LINEBELOW", (0, 1), (-1, -1), 0.25, page_style.PALE_COLOUR),
                ("VALIGN", *every, "TOP"),
                ("TOPPADDING", *every, 0.8),
                ("BOTTOMPADDING", *every, 1.2),
                ("LEFTPADDING", *every, 2),
            ]
        )
    )
    return KeepTogether([words(table.title, page_style.HEADING), words(table.note, page_style.QUIET), drawn])
