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

from accept.gap.empirical import AddedElement, elements_of
from accept.gap.report_tables import tables
from accept.gap.text import (
    chance,
    experiment_line,
    gap_number,
    headline_of_result,
    parameter_line,
    poles_of,
    value_words,
    words_of,
)
from accept.pictures.interactive import PageTable
from accept.pictures.pdf import page_style
from accept.pictures.pdf.assemble import assemble
from accept.pictures.pdf.figure_row import FigureRow, FigureStack
from accept.pictures.pdf.fonts import BOLD, REGULAR, fitting_size, register
from accept.pictures.pdf.page_style import words
from accept.pictures.reduce import reduce_panel
from checks.gap import GapVerdict, Result, bode_panels
from checks.picture import Panel

HEAD = 20 * mm
BODE = 27.0, 14.0, 15.5  # mm: axes of magnitude, phase and what is left, of three channels on a page
BEFORE = (
    "Before: the fitted model without the effects that were named; after: with them. Both on records that were not "
    "fitted."
)
BANDS = (
    "Bands hold 95 % at each frequency: of the measurement by its noise; of the model after by its stated tolerance "
    "and the covariance of its fitted values, the scatter of the APA's modes among them; of units as the model's file "
    "describes them, drawn from its priors and scatter."
)


def render(serial: str, result: Result, added: Sequence[AddedElement] = ()) -> bytes:
    """Return the report as a PDF. added: elements that were added to the improved model without a name."""
    register()
    shown, drawn = tables(result, added), bode_panels(result, elements_of(added))
    story: list[Flowable] = [
        *_findings(result),
        words("Where model and data disagree", page_style.HEADING),
        *([words(BEFORE, page_style.QUIET)] if result.named else []),
        FigureRow([reduce_panel(drawn["map"])], 40.0),
        *_table(shown.get("gap"), (24, 24, 24, 28, 24, 30, 28) if result.named else (46, 46, 46, 44)),
        *_table(shown.get("steps"), (80, 34, 34, 34)),
        *_remarks(result),
        *_table(shown.get("reasons"), (66, 22, 24, 70)),
        *_table(shown.get("identified"), (50, 36, 36, 16, 44)),
        *_limits(result),
        *_table(shown.get("added"), (18, 20, 20, 18, 56, 50)),
        *_table(shown.get("fitted"), (56, 44, 44, 38)),
        PageBreak(),
        words("Bode plots, on records that were not fitted", page_style.HEADING),
        words(BANDS, page_style.QUIET),
        *_bode(result, drawn),
    ]
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
    line = headline_of_result(result)
    canvas.setFont(BOLD, fitting_size(line, BOLD, 15, width - 8 * mm))
    canvas.drawCentredString(left + width / 2, top - height / 2 - 5, line)
    canvas.setFillColor(page_style.GREY_COLOUR)
    canvas.setFont(REGULAR, 6)
    canvas.drawRightString(page_style.WIDTH - page_style.MARGIN, page_style.MARGIN, f"page {canvas.getPageNumber()}")


def _findings(result: Result) -> list[Flowable]:
    """Return the named effects in plain words, rivals that cannot be distinguished, and unidentified effects."""
    story: list[Flowable] = []
    for n in result.named:
        story += [
            words(n.sentence, page_style.STRONG),
            words(f"{parameter_line(n)}; p {chance(n.p)}", page_style.SMALL),
        ]
    for e in result.elements:
        story += [words(e.sentence, page_style.STRONG), words(f"Next experiment: {e.experiment}.", page_style.SMALL)]
    if result.verdict == GapVerdict.NO_MISSING:
        story.append(
            words("Noise, the stated tolerance and the calibrated values explain every channel.", page_style.STRONG)
        )
    for a in result.ambiguous:
        story.append(
            words(
                f"Cannot be distinguished: {', '.join(map(words_of, a.effects))}. Next experiment: {a.experiment}.",
                page_style.STRONG,
            )
        )
    for u in result.unnamed:
        poles = poles_of(u.poles_Hz, u.ci95, u.at_edge)
        zeros = ", ".join(f"{f:.1f} Hz" for f in u.zeros_Hz) or "none"
        story.append(
            words(f"Unidentified effect: {u.channel}, poles {poles}, zeros {zeros}. {u.words}", page_style.STRONG)
        )
    return story


def _bode(result: Result, drawn: Mapping[str, Panel]) -> list[Flowable]:
    """Return the magnitude, phase and residual of every channel, on one frequency axis each."""
    channels = result.before.data.channels
    heights = [h * min(3.0 / len(channels), 1.6) for h in BODE]
    kinds = ("magnitude", "phase", "deviation")
    return [FigureStack([reduce_panel(drawn[f"{c} {kind}"]) for kind in kinds], heights) for c in channels]


def _limits(result: Result) -> list[Flowable]:
    if not result.detection_limits:
        return []
    parts = [
        f"{words_of(effect)} ({', '.join(value_words(effect, k, v) for k, v in values.items())})"
        for effect, values in result.detection_limits.items()
    ]
    return [
        words("Would have been seen with 90 % power, from", page_style.HEADING),
        words("; ".join(parts), page_style.SMALL),
    ]


def _remarks(result: Result) -> list[Flowable]:
    experiments = [f"{line[0].upper()}{line[1:]}." for line in map(experiment_line, result.experiments)]
    modes = ", ".join(f"{m.f_Hz:.0f} Hz {gap_number(m.G)}" for m in result.gap_after.modes)
    notes = [f"{note[0].upper()}{note[1:].rstrip('.')}." for note in result.notes]
    lines = [f"G after, within 5 Hz about each mode: {modes}.", *experiments, *notes]
    return [Spacer(1, 4), *(words(line, page_style.SMALL) for line in lines)]


def _table(table: PageTable | None, widths_mm: Sequence[float]) -> list[Flowable]:
    if table is None:
        return []
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
    return [KeepTogether([words(table.title, page_style.HEADING), words(table.note, page_style.QUIET), drawn])]
