"""The files that `accept model learn` writes: the batch as a model file, for scripts (JSON) and for people (PDF)."""

import io
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    BaseDocTemplate,
    CondPageBreak,
    Flowable,
    Frame,
    KeepTogether,
    PageTemplate,
    Table,
    TableStyle,
)

from accept.fleet.population import bench
from accept.fleet.population.learn import LearnedPopulation
from accept.models.model_file import value_label, write_model
from accept.pictures.pdf import page_style
from accept.pictures.pdf.assemble import assemble
from accept.pictures.pdf.fonts import BOLD, REGULAR, fitting_size, register
from accept.pictures.pdf.page_style import words
from accept.pictures.pdf.panels import FigureRow
from checks.model import LATENCIES
from checks.picture import Band, Line, Mark, Panel
from checks.population import BatchMember
from checks.quantity import TWO_SIDED_95
from checks.rounding import rounded_U, with_U
from specs.model_sections import PopulationRecord
from specs.units import unit_of, with_unit

HEAD = 20 * mm
TABLE_NEEDS = 40 * mm  # of a page: with less, heading and table begin the next one
DIGITS = 6  # of what is written: a batch knows nothing to a part in a million
SHOWN = 14  # parameters in the picture
LISTED = 24  # values in the table of the page; the rest moved by a fraction of their uncertainty
LEARNED = 0.9  # share of its prior's standard deviation that is left of a mean that counts as learned
PAIRS = 12  # of values that vary together: the strongest; the others are counted
OF_ALL = "All units: {}. By a jig, lopsided APAs or the model: it names no unit, and is part of U of each misalignment."
EXPLAINED = (
    "A point is one unit's own value, a bar the batch's mean with its 95 % interval, in standard deviations of the "
    "model file from its value. What the units have in common lies away from zero, what differs between them apart."
)


def write_population(path: Path, found: LearnedPopulation, learned_on: str | None = None) -> None:
    """Write batch and bench as a model file; learned_on: the day, ISO. Raises SpecError, ModelError, OSError."""
    batch, spec = found.batch, found.given.spec
    cov = batch.of_one_more
    record = PopulationRecord(
        names=list(found.names),
        mean=[_short(v) for v in batch.mean],
        scatter=[_short(v) for v in batch.scatter],
        mean_sd=[_short(v) for v in np.sqrt(np.diag(batch.mean_cov))],
        covariance=[[_short(v) for v in row[: i + 1]] for i, row in enumerate(cov)],
        units=[j.serial for j in found.judged if j.belongs],
        apart=[j.serial for j in found.judged if not j.belongs],
        model=spec.name,
        model_sha256=found.model.sha256,
        holds_together=found.holds,
    )
    plain = [i for i, n in enumerate(found.names) if n in spec.values or n in LATENCIES.values()]
    values = {found.names[i]: _short(batch.mean[i]) for i in plain}
    sds = {found.names[i]: _short(float(np.sqrt(cov[i, i]))) for i in plain}
    name = f"{spec.name}, batch of {len(record.units)}"
    of_bench = bench.bench_record(found, learned_on)
    write_model(path, spec, values, sds, damping=found.damping, population=record, bench=of_bench, name=name)


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def document(found: LearnedPopulation, learned_on: str | None = None, changed: Sequence[str] = ()) -> dict[str, Any]:
    """Return the population as a document for scripts; changed: differences from an earlier bench."""
    shares, together = found.determined
    inside, compared = found.covered
    return {
        "model": found.given.spec.name,
        "model_sha256": found.model.sha256,
        "damping": found.damping,
        "holds_together": found.holds,
        "units": [_unit(j) for j in found.judged],
        "coverage": {"inside_95": inside, "compared": compared},
        "parameters": {n: _parameter(found, i, float(shares[i])) for i, n in enumerate(found.names)},
        "not_learned": [n for n, left in zip(found.names, shares, strict=True) if left > LEARNED],
        "not_told_apart": [{"names": [found.names[i], found.names[j]], "correlation": rho} for i, j, rho in together],
        "bench": bench.bench_document(found, learned_on, changed),
        "inputs": {serial: dict(files) for serial, files in found.inputs.items()},
    }


def _unit(j: BatchMember) -> dict[str, Any]:
    worst = None if j.worst is None else {"name": j.worst[0], "z": j.worst[1]}
    return {
        "serial": j.serial,
        "belongs": j.belongs,
        "reason": j.reason,
        "G": dict(j.G),
        "G_left_out": dict(j.G_left_out),
        "G_before": dict(j.G_before),
        "p_all": j.belonging.p_all,
        "p_worst": j.belonging.p_worst,
        "worst": worst,
        "weight": j.weight,
    }


def _parameter(found: LearnedPopulation, i: int, left: float) -> dict[str, Any]:
    """Return the entry of a parameter in population.json. left: share of its prior's sd that the batch leaves."""
    batch, prior = found.batch, found.prior
    sd = float(np.sqrt(batch.mean_cov[i, i]))
    return {
        "unit": unit_of(found.names[i]),
        "prior": float(prior.mean[i]),
        "prior_sd": found.model.sds[found.names[i]],
        "mean": float(batch.mean[i]),
        "U": 2.0 * sd,
        "scatter": float(batch.scatter[i]),
        "of_one_more_sd": float(np.sqrt(batch.of_one_more[i, i])),
        "shift_sd": float((batch.mean[i] - prior.mean[i]) / sd),
        "left_of_prior": left,
    }


def lines(found: LearnedPopulation, changed: Sequence[str] = ()) -> list[str]:
    """Return the report on the terminal. changed: what changed since an earlier bench."""
    inside, compared = found.covered
    kept = [j.serial for j in found.judged if j.belongs]
    out = [f"learned from {len(kept)} units: {', '.join(kept)}" if kept else "no unit belongs to a batch"]
    out += [f"{j.serial} does not belong: {j.reason}" for j in found.judged if not j.belongs]
    out += bench.bench_lines(found, changed) + common_offsets(found)
    if compared:
        out.append(f"{inside} of {compared} values lie where the other units foretell them with 95 %")
    out += [f"  {line}" for line in shifts(found)]
    if not found.holds:
        out.append("these units do not hold together: too few of them belong to one batch to learn from")
    return out


def common_offsets(found: LearnedPopulation) -> list[str]:
    """Return the misalignment that the units have in common, if it exceeds its U."""
    mean, U = found.batch.mean, 2.0 * np.sqrt(np.diag(found.batch.mean_cov))
    certain = [i for i, n in enumerate(found.names) if n.startswith("misalignment.") and abs(mean[i]) > U[i]]
    words = (f"{value_label(found.model, found.names[i])} {with_U(float(mean[i]), float(U[i]))} um" for i in certain)
    return [OF_ALL.format(" and ".join(words))] if certain else []


def shifts(found: LearnedPopulation, most: int = 8) -> list[str]:
    """Return the learned parameters, largest shift first."""
    order = _by_shift(found)[:most]
    return [
        with_unit(
            f"{found.names[i]}: {found.prior.mean[i]:.5g} -> "
            + with_U(float(found.batch.mean[i]), 2 * float(np.sqrt(found.batch.mean_cov[i, i]))),
            found.names[i],
        )
        + f", scatter {found.batch.scatter[i]:.2g}"
        for i in order
    ]


def _by_shift(found: LearnedPopulation) -> list[int]:
    """Return the parameters that the batch determines, by falling shift of the mean in standard uncertainties."""
    sd, before = np.sqrt(np.diag(found.batch.mean_cov)), found.prior.mean_sd
    away = np.where(sd < LEARNED * before, np.abs(found.batch.mean - found.prior.mean) / sd, -1.0)
    return [int(i) for i in np.argsort(-away) if away[i] >= 0]


def picture_of(found: LearnedPopulation) -> Panel:
    """Return the picture of the parameters that moved: the values of every unit and the batch's mean."""
    order = _by_shift(found)[:SHOWN][::-1]
    scale = np.array([found.model.sds[n] for n in found.names])
    units = (found.batch.units - found.prior.mean) / scale
    mean, sd = (found.batch.mean - found.prior.mean) / scale, np.sqrt(np.diag(found.batch.mean_cov)) / scale
    items: list[Any] = [Mark(0.0, "x", role="quiet")]
    for row, i in enumerate(order):
        low, high = mean[i] - TWO_SIDED_95 * sd[i], mean[i] + TWO_SIDED_95 * sd[i]
        items.append(Band(np.array([low, high]), np.full(2, row - 0.25), np.full(2, row + 0.25), role="model"))
        items.append(Line(units[:, i], np.full(len(units), float(row)), style="points", role="data"))
    return Panel(
        "how far from the model file",
        "standard deviations of the model file",
        "",
        tuple(items),
        y_range=(-0.6, max(len(order), 1) - 0.4),
        y_names=tuple(value_label(found.model, found.names[i]) for i in order),
    )


def render(found: LearnedPopulation, changed: Sequence[str] = ()) -> bytes:
    """Return the report as a PDF, the bench on its first page; equal answers give equal bytes."""
    register()
    row = FigureRow([picture_of(found)], 80.0)
    sentences = lines(found, changed)
    story: list[Flowable] = [
        *(words(line, page_style.STRONG) for line in sentences[:1]),
        *(words(line, page_style.BODY) for line in sentences[1:] if not line.startswith("  ")),
        *_bench_figure(found),
        *_units_table(found),
        KeepTogether(
            [words("What the units have in common", page_style.HEADING), words(EXPLAINED, page_style.QUIET), row]
        ),
        *_parameters_table(found),
        *_untold(found),
    ]
    buffer = io.BytesIO()
    page = BaseDocTemplate(buffer, pagesize=(page_style.WIDTH, page_style.HEIGHT), invariant=1, pageCompression=1)
    bottom = page_style.MARGIN + page_style.FOOTER
    height = page_style.HEIGHT - page_style.MARGIN - HEAD - bottom
    frame = Frame(page_style.MARGIN, bottom, page_style.INNER, height, 0, 0, 0, 0)
    page.addPageTemplates([PageTemplate("page", [frame], onPage=lambda c, _: _head(c, found))])
    page.build(story)
    return assemble(buffer.getvalue(), {}, {}, f"Batch of {found.given.spec.name}")


def _bench_figure(found: LearnedPopulation) -> list[Flowable]:
    if found.bench is None:
        return []
    title = words("What the bench adds to every unit", page_style.HEADING)
    return [title, words(bench.EXPLAINED, page_style.QUIET), FigureRow(bench.bench_panels(found.bench), 56.0)]


def _head(canvas: Canvas, found: LearnedPopulation) -> None:
    top = page_style.HEIGHT - page_style.MARGIN
    canvas.setFillColor(page_style.GREY_COLOUR)
    canvas.setFont(BOLD, 8)
    canvas.drawString(page_style.MARGIN, top - 8, "MODEL OF A BATCH")
    canvas.setFillColor(page_style.INK_COLOUR)
    name = found.given.spec.name
    canvas.setFont(BOLD, fitting_size(name, BOLD, 20, 90 * mm))
    canvas.drawString(page_style.MARGIN, top - 32, name)
    canvas.setFont(REGULAR, 7)
    canvas.drawString(page_style.MARGIN, top - 45, f"damping {found.damping}, {len(found.judged)} units given")
    sign = page_style.UNIT_SIGNS["accepted" if found.holds else "conditional"]
    left, width, tall = page_style.WIDTH - page_style.MARGIN - 84 * mm, 84 * mm, 13 * mm
    canvas.setFillColor(sign.fill)
    canvas.roundRect(left, top - tall, width, tall, 2 * mm, stroke=0, fill=1)
    canvas.setFillColor(sign.ink)
    line = "One batch" if found.holds else "Not one batch"
    canvas.setFont(BOLD, 15)
    canvas.drawCentredString(left + width / 2, top - tall / 2 - 5, line)
    canvas.setFillColor(page_style.GREY_COLOUR)
    canvas.setFont(REGULAR, 6)
    canvas.drawRightString(page_style.WIDTH - page_style.MARGIN, page_style.MARGIN, f"page {canvas.getPageNumber()}")


def _units_table(found: LearnedPopulation) -> list[Flowable]:
    head = ("Unit", "G, fitted alone", "G, foretold by others", "p of all, of the worst", "farthest value", "belongs")
    rows = [
        [
            j.serial,
            ", ".join(f"{c} {G:.2f}" for c, G in j.G.items()),
            ", ".join(f"{c} {G:.2f}" for c, G in j.G_left_out.items()),
            f"{j.belonging.p_all:.2g}, {j.belonging.p_worst:.2g}",
            "" if j.worst is None else f"{value_label(found.model, j.worst[0])} {j.worst[1]:+.1f} sd",
            "yes" if j.belongs else "no",
        ]
        for j in found.judged
    ]
    title = "Every unit, judged by the batch that the others make"
    return [words(title, page_style.HEADING), _table(head, rows, [18, 42, 42, 26, 40, 14])]


def _parameters_table(found: LearnedPopulation) -> list[Flowable]:
    head = ("Parameter", "model file", "batch", "one unit about it", "shift / its u", "left of the prior")
    left, _ = found.determined
    rows, order = [], _by_shift(found)
    for i in order[:LISTED]:
        p = _parameter(found, i, float(left[i]))
        rows.append(
            [
                value_label(found.model, found.names[i]),
                with_unit(with_U(p["prior"], 2 * p["prior_sd"]), found.names[i]),
                with_unit(with_U(p["mean"], p["U"]), found.names[i]),
                with_unit(f"± {rounded_U(2 * p['scatter'])}" if p["scatter"] > 0.0 else "-", found.names[i]),
                f"{round(p['shift_sd'], 1) + 0.0:+.1f}",
                f"{100 * left[i]:.0f} %",
            ]
        )
    rest = len(order) - LISTED
    more = f" The other {rest} moved less; population.json holds them." if rest > 0 else ""
    title, note = "What was learned, the largest shift first", f"± is U, k = 2.{more}"
    table = _table(head, rows, [46, 36, 36, 26, 20, 18])
    heading = [CondPageBreak(TABLE_NEEDS), words(title, page_style.HEADING), words(note, page_style.QUIET)]
    return [*heading, table]


def _untold(found: LearnedPopulation) -> list[Flowable]:
    shares, together = found.determined
    label = partial(value_label, found.model)
    names = [label(n) for n, left in zip(found.names, shares, strict=True) if left > LEARNED]
    story: list[Flowable] = [words("What this batch cannot tell", page_style.HEADING)]
    if names:
        story.append(words(f"Nothing was learned of the mean of {', '.join(names)}.", page_style.SMALL))
    pairs = [f"{label(found.names[i])} and {label(found.names[j])} ({rho:+.2f})" for i, j, rho in together[:PAIRS]]
    if pairs:
        more = "" if len(together) <= PAIRS else f", and {len(together) - PAIRS} pairs more"
        story.append(words("Told only together (correlation): " + ", ".join(pairs) + more + ".", page_style.SMALL))
    return story


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], widths_mm: Sequence[float]) -> Table:
    cells = [[words(h, page_style.TABLE_HEAD) for h in head]]
    cells += [[words(v, page_style.SMALL) for v in row] for row in rows]
    table = Table(cells, colWidths=[w * mm for w in widths_mm], hAlign="LEFT", repeatRows=1)
    every = ((0, 0), (-1, -1))
    style = [("LINEBELOW", (0, 0), (-1, 0), 0.6, page_style.GREY_COLOUR), ("LEFTPADDING", *every, 2)]
    style += [("TOPPADDING", *every, 0.6), ("BOTTOMPADDING", *every, 0.6), ("VALIGN", *every, "TOP")]
    table.setStyle(TableStyle(style))
    return table
