"""gap.pdf: what a person reads in two minutes. Equal answers give equal bytes."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Flowable, Frame, PageBreak, PageTemplate, Spacer, Table, TableStyle

from accept.gap.reasons import candidates, moved, shift_words
from accept.gap.text import chance, experiment_line, gap_number, headline_of, named_line, number
from accept.pictures.pdf import page_style
from accept.pictures.pdf.assemble import assemble
from accept.pictures.pdf.figure_row import FigureRow
from accept.pictures.pdf.fonts import BOLD, REGULAR, fitted, register
from accept.pictures.pdf.page_style import words
from accept.pictures.reduce import reduced
from checks.gap.decision.panels import errors, panels, responses
from checks.gap.decision.result import NO_MISSING, Result
from checks.picture import Line, Panel

HEAD = 20 * mm
CANDIDATES = 6
PARAMETERS = 16
BEFORE = (
    "Before: the model with its uncertain values fitted, without the effects; after: with the effects named. Both on "
    "records that were not fitted."
)


def render(serial: str, result: Result) -> bytes:
    """The report as a PDF."""
    register()
    drawn = panels(result)
    channels = result.before.data.channels
    rows = [
        FigureRow([reduced(drawn["map"])], 36.0),
        FigureRow([reduced(drawn[f"{c} residual"]) for c in channels], 54.0),
        FigureRow([reduced(drawn[f"{c} magnitude"]) for c in channels], 54.0),
    ]
    story: list[Flowable] = [
        *_found(result),
        words("Residual before and after", page_style.HEADING),
        words(BEFORE, page_style.QUIET),
        *rows[:2],
        words("Model against data", page_style.HEADING),
        rows[2],
        *_gap_table(result),
        *_candidates(result),
        *_remarks(result),
        PageBreak(),
        words("Magnitude and phase, one frequency axis", page_style.HEADING),
        FigureRow([reduced(drawn[f"{c} magnitude"]) for c in channels], 54.0),
        FigureRow([reduced(panel) for panel in phases(result)], 42.0),
        *_reasons(result),
        *_moved(result),
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
    canvas.setFont(BOLD, fitted(serial, BOLD, 24, 80 * mm))
    canvas.drawString(page_style.MARGIN, top - 34, serial)
    canvas.setFont(REGULAR, 7)
    canvas.drawString(page_style.MARGIN, top - 46, f"model {result.model}, damping {result.damping}")
    sign = page_style.GAP_SIGNS[result.verdict]
    left, width, height = page_style.WIDTH - page_style.MARGIN - 100 * mm, 100 * mm, 13 * mm
    canvas.setFillColor(sign.fill)
    canvas.roundRect(left, top - height, width, height, 2 * mm, stroke=0, fill=1)
    canvas.setFillColor(sign.ink)
    line = headline_of(result.verdict, [n.effect for n in result.named])
    canvas.setFont(BOLD, fitted(line, BOLD, 15, width - 8 * mm))
    canvas.drawCentredString(left + width / 2, top - height / 2 - 5, line)
    canvas.setFillColor(page_style.GREY_COLOUR)
    canvas.setFont(REGULAR, 6)
    canvas.drawRightString(page_style.WIDTH - page_style.MARGIN, page_style.MARGIN, f"page {canvas.getPageNumber()}")


def _found(result: Result) -> list[Flowable]:
    """The named effects in plain words, rivals that cannot be distinguished, and unidentified effects."""
    story: list[Flowable] = []
    for n in result.named:
        story += [
            words(n.sentence, page_style.STRONG),
            words(f"{named_line(n)}; p {chance(n.p)}", page_style.SMALL),
        ]
    if result.verdict == NO_MISSING:
        story.append(
            words("Noise, the stated tolerance and the calibrated values explain every channel.", page_style.STRONG)
        )
    for a in result.ambiguous:
        story.append(
            words(
                f"Cannot be distinguished: {', '.join(a.effects)}. Next experiment: {a.experiment}.", page_style.STRONG
            )
        )
    for u in result.unnamed:
        poles = ", ".join(f"{f:.1f} Hz" for f in u.poles_Hz) or "none"
        zeros = ", ".join(f"{f:.1f} Hz" for f in u.zeros_Hz) or "none"
        story.append(
            words(f"Unidentified effect: {u.channel}, poles {poles}, zeros {zeros}. {u.words}", page_style.STRONG)
        )
    return story


def _gap_table(result: Result) -> list[Flowable]:
    head = ("Channel", "G before", "G after", "level before", "after", "phase before", "after")
    cells: list[list[Any]] = [[words(h, page_style.TABLE_HEAD) for h in head]]
    off = errors(result)
    for c, before in result.gap_before.channels.items():
        dB, deg, dB_after, deg_after = off[c]
        row = [c, gap_number(before.G), gap_number(result.gap_after.channels[c].G)]
        row += [f"{dB:.3g} dB", f"{dB_after:.3g} dB", f"{deg:.3g} deg", f"{deg_after:.3g} deg"]
        cells.append([words(v, page_style.BODY) for v in row])
    title = "The gap: squared residual over noise variance plus squared tolerance (1 or less is agreement)"
    return [words(title, page_style.HEADING), _table(cells, [24, 24, 24, 28, 24, 30, 28])]


def _candidates(result: Result) -> list[Flowable]:
    if not result.tried:
        return _limits(result)
    cells: list[list[Any]] = [
        [words(h, page_style.TABLE_HEAD) for h in ("Explanation tried", "gain in ln L", "p of the rest")]
    ]
    for t in result.tried[:CANDIDATES]:
        row = (", ".join(t.names) or "none", f"{t.delta_lnL:.0f}", chance(t.p))
        cells.append([words(v, page_style.SMALL) for v in row])
    return [words("Candidates, on records that were not fitted", page_style.HEADING), _table(cells, [110, 36, 36])]


def _reasons(result: Result) -> list[Flowable]:
    """Every explanation that was tried, and why it was named or not."""
    rows = list(candidates(result))
    if not rows:
        return []
    head = ("Explanation tried", "gain in ln L", "p of the rest", "decision")
    cells = [[words(h, page_style.TABLE_HEAD) for h in head]]
    cells += [[words(v, page_style.SMALL) for v in row] for row in rows]
    return [words("Why this cause, and why not another", page_style.HEADING), _table(cells, [62, 24, 24, 72])]


def _moved(result: Result) -> list[Flowable]:
    """The model's uncertain values after the fit, beside what its file says."""
    found = moved(result)
    if not found:
        return []
    head = ("Model value", "in its file", "fitted", "moved by")
    cells = [[words(h, page_style.TABLE_HEAD) for h in head]]
    for one in found[:PARAMETERS]:
        row = (one.name, f"{number(one.prior)} ± {one.prior_sd:.2g}", f"{number(one.value)} ± {one.sd:.2g}")
        cells.append([words(v, page_style.SMALL) for v in (*row, shift_words(one))])
    rest = len(found) - PARAMETERS
    more = f" The other {rest} moved less." if rest > 0 else ""
    title = words("Fitted values against their priors", page_style.HEADING)
    note = words(f"One standard deviation each, those that moved furthest first.{more}", page_style.QUIET)
    return [title, note, _table(cells, [72, 36, 36, 38])]


def phases(result: Result) -> list[Panel]:
    """Phase of every channel, measured and by the model before and after, over the bins of its magnitude."""
    data, out = result.before.data, []
    before, after = responses(result)
    for c in range(len(data.channels)):
        measured, was, now = (np.degrees(np.angle(H[:, c])) for H in (data.H, before, after))
        lines = (
            Line(data.f, measured, "", "points", "data"),
            Line(data.f, was, "", "points", "before"),
            Line(data.f, now, "", "points", "model"),
        )
        out.append(Panel("", "frequency [Hz]", "phase [deg]", lines, x_log=True, y_range=(-190.0, 190.0)))
    return out


def _limits(result: Result) -> list[Flowable]:
    if not result.detection_limits:
        return []
    parts = [
        f"{effect} ({', '.join(f'{k} {number(v)}' for k, v in values.items())})"
        for effect, values in result.detection_limits.items()
    ]
    return [
        words("Would have been seen with 90 % power, from", page_style.HEADING),
        words("; ".join(parts), page_style.SMALL),
    ]


def _remarks(result: Result) -> list[Flowable]:
    experiments = [f"{line[0].upper()}{line[1:]}." for line in map(experiment_line, result.experiments)]
    modes = ", ".join(f"{m.f_Hz:.0f} Hz {gap_number(m.G)}" for m in result.gap_after.modes)
    lines = [f"G after, within 5 Hz about each mode: {modes}.", *experiments, *result.notes]
    return [Spacer(1, 4), *(words(line, page_style.SMALL) for line in lines)]


def _table(cells: list[list[Any]], widths_mm: Sequence[float]) -> Table:
    table = Table(cells, colWidths=[w * mm for w in widths_mm], hAlign="LEFT")
    every = ((0, 0), (-1, -1))
    table.setStyle(
        TableStyle(
            [
                ("LINEBELOW", (0, 0), (-1, 0), 0.6, page_style.GREY_COLOUR),
                ("TOPPADDING", *every, 0.8),
                ("BOTTOMPADDING", *every, 0.8),
                ("LEFTPADDING", *every, 2),
            ]
        )
    )
    return table
