"""The flowing content of a certificate's pages: identity, findings, pictures, information, unjudged sections."""

import io
import re
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from reportlab.lib.units import mm
from reportlab.lib.utils import ImageReader
from reportlab.platypus import Flowable, Image, KeepTogether, Paragraph, Spacer, Table, TableStyle

from accept import units
from accept.certificate.contents.content import CertificateContent
from accept.certificate.page.clauses import compared_rows, identity_rows, limit_sources, rule_words
from accept.judging.advice import stored_advice
from accept.pictures.labels import LONGEST_INPUTS, check_label, inputs_words, label_of
from accept.pictures.pdf import numbers, page_style
from accept.pictures.pdf.limit_bar import limit_bar
from accept.pictures.pdf.page_style import words
from checks.acceptance import CHECKS

LONGEST_REASON = 700  # characters; a row of a table must fit a page, the whole text is in results.json
_JPEG = b"\xff\xd8"  # how such a file begins
_PICTURE = (110 * mm, 75 * mm)  # the most that one takes of the page
_FINDING_WIDTHS = [w * mm for w in (41, 35, 30, 26, 13, 16, 21)]
_HEADS = 2  # rows of the table of findings above the first one
_INFORMATION_WIDTHS = [w * mm for w in (34, 44, 40, 64)]


def identity(contents: CertificateContent) -> list[Flowable]:
    """Return who and what the certificate is about: laboratory, spec, operator, instruments, item."""
    return [_rows(identity_rows(contents))]


def compared(contents: CertificateContent) -> list[Flowable]:
    """Return what a program compares and no reader needs: hash of the spec, state of the store, bench, inputs."""
    return [words("How this certificate is checked", page_style.HEADING), _rows(compared_rows(contents))]


def _rows(rows: Sequence[tuple[str, str]]) -> Table:
    cells = [[words(name, page_style.TABLE_HEAD), words(text, page_style.SMALL)] for name, text in rows if text]
    table = Table(cells, colWidths=[20 * mm, page_style.INNER - 20 * mm], splitInRow=1)
    table.setStyle(TableStyle([("VALIGN", (0, 0), (-1, -1), "TOP"), *padding(0.6, left=0)]))
    return table


def findings(contents: CertificateContent) -> list[Flowable]:
    """Return the table of findings; the reason of a finding is printed below its row, on the same page, with what to
    do and, below the first finding of a check, what decided its values beside the samples; a reason or an advice that
    several findings share is printed once. The heading is a row of the table: it stays
    with the first finding, and the table begins on the page where both fit."""
    head = ("Quantity", "Value ± U (k = 2)", "Limits", "Position", "Rule", "P(false)", "Verdict")
    right = (1, 2, 5)
    cells: list[list[Any]] = [
        [words("Findings", page_style.HEADING), *[""] * 6],
        [words(h, page_style.TABLE_HEAD_NUMBER if n in right else page_style.TABLE_HEAD) for n, h in enumerate(head)],
    ]
    style: list[tuple[Any, ...]] = [
        ("VALIGN", (0, 0), (-1, -1), "MIDDLE"),
        ("LINEBELOW", (0, 1), (-1, 1), 0.8, page_style.INK_COLOUR),
        *padding(1.3, left=2),
        ("SPAN", (0, 0), (-1, 0)),
        ("TOPPADDING", (0, 0), (-1, 0), page_style.HEADING.spaceBefore),
        ("LEFTPADDING", (0, 0), (-1, 0), 0),
        ("RIGHTPADDING", (2, 0), (2, -1), 9),
        ("RIGHTPADDING", (5, 0), (5, -1), 6),
    ]
    told: dict[str, str] = {}
    inputs, sources = inputs_words(contents.result), limit_sources(contents)
    for finding in contents.result["findings"]:
        first = len(cells)
        cells.append(_finding_row(finding))
        used = inputs.pop(finding["check"], "")
        source = sources.get((finding["check"], finding["quantity"]))
        remark = [
            *([_shorten(f"Limit: {source}")] if source else []),
            *_remark(finding, told),
            *([_shorten(f"Inputs: {used}", LONGEST_INPUTS)] if used else []),
        ]
        if remark:
            cells.append([[words(line, page_style.SMALL) for line in remark], *[""] * 6])
            style += [("SPAN", (0, first + 1), (-1, first + 1)), ("TOPPADDING", (0, first + 1), (-1, first + 1), 0)]
        together = 0 if first == _HEADS else first  # the heads stay with the first finding
        style.append(("NOSPLIT", (0, together), (-1, len(cells) - 1)))
        style.append(("LINEBELOW", (0, len(cells) - 1), (-1, len(cells) - 1), 0.4, page_style.PALE_COLOUR))
    table = Table(cells, colWidths=_FINDING_WIDTHS, repeatRows=(1,))
    table.setStyle(TableStyle(style))
    return [table, words(rule_words(contents.result), page_style.SMALL)]


def information(contents: CertificateContent) -> list[Flowable]:
    """Return the measured quantities that the spec does not limit."""
    rows = contents.result.get("information") or []
    if not rows:
        return []
    head = [words(h, page_style.TABLE_HEAD) for h in ("Check", "Quantity", "Value ± U (k = 2)", "Remark")]
    cells = [head, *(_information_row(row) for row in rows)]
    table = Table(cells, colWidths=_INFORMATION_WIDTHS, repeatRows=1)
    rule = ("LINEBELOW", (0, 0), (-1, 0), 0.5, page_style.GREY_COLOUR)
    table.setStyle(TableStyle([("VALIGN", (0, 0), (-1, -1), "TOP"), rule, *padding(0.4, left=2)]))
    return [words("Measured, without limits in this spec", page_style.HEADING), table]


def budgets(contents: CertificateContent) -> list[Flowable]:
    """Return each finding's uncertainty budget: standard uncertainties, type A from scatter, B stated ([JCGM100])."""
    by_finding = (
        f"{label_of(f['quantity'])}: "
        + "; ".join(f"{c['source']}, u = {c['u']:.2g}\u00a0{f['unit']}\u00a0({c['kind']})" for c in f["budget"])
        for f in contents.result["findings"]
        if f.get("budget")
    )
    lines = [line.replace(" = ", "\u00a0=\u00a0") for line in by_finding]  # no line ends within `k = 2`
    if not lines:
        return []
    head = words("Uncertainty budgets (standard uncertainties; A from scatter, B stated)", page_style.HEADING)
    return [head, *(words(_shorten(line), page_style.SMALL) for line in lines)]


def remarks(contents: CertificateContent) -> list[Flowable]:
    """Return the sections that were not judged, the notes, and the limits of the certificate's claim."""
    story: list[Flowable] = []
    left_out, notes = (
        [_of_check(str(line)) for line in contents.result.get(key) or []] for key in ("not_judged", "notes")
    )
    if left_out:
        story += [words("Not judged by this spec", page_style.HEADING), words("; ".join(left_out), page_style.SMALL)]
    if notes:
        story += [words("Notes", page_style.HEADING), *(words(f"· {note}", page_style.SMALL) for note in notes)]
    return [*story, Spacer(1, 5), words(contents.statement, page_style.QUIET)]


def pictures(contents: CertificateContent) -> list[Flowable]:
    """Return the pictures that notes have on the certificate, each with its step, its name and its hash."""
    chosen = units.by_check(contents.unit_file, "pictures", [])
    named = [(step, name) for step, names in chosen.items() for name in names]
    story: list[Flowable] = []
    for step, name in named:
        digest = contents.inputs.get(name) or "not known: the file is missing"
        caption = words(f"{check_label(step)}: {name}, SHA-256 {digest}", page_style.SMALL)
        shown = _picture(contents.files.get(name, b""))
        absent = words("The picture is not attached to this certificate, or is no JPEG file.", page_style.SMALL)
        story.append(KeepTogether([Spacer(1, 5), absent if shown is None else shown, caption]))
    return [words("Pictures", page_style.HEADING), *story] if story else []


def _picture(content: bytes) -> Flowable | None:
    from PIL.Image import DecompressionBombError  # loaded only if there are pictures

    if not content.startswith(_JPEG):
        return None
    try:
        width, height = ImageReader(io.BytesIO(content)).getSize()
        scale = min(_PICTURE[0] / width, _PICTURE[1] / height)
        return Image(io.BytesIO(content), width * scale, height * scale, hAlign="LEFT")
    except (OSError, ValueError, SyntaxError, ZeroDivisionError, DecompressionBombError):  # damaged, or enormous
        return None


def _finding_row(finding: Mapping[str, Any]) -> list[Any]:
    unit = finding["unit"]
    sign = page_style.FINDING_SIGNS[finding["verdict"]]
    value, U = numbers.value_and_U(finding["value"], finding["U"])
    shown = f"{value} ± {U}" if U else value
    name = f"<b>{escape(label_of(finding['quantity']), quote=False)}</b>"
    optional = "" if finding.get("required", True) else ", not required"
    below = f"<font size='5.8' color='#777777'>{escape(check_label(finding['check']) + optional, quote=False)}</font>"
    unit_text = "" if unit == "1" else f" {unit}"
    return [
        Paragraph(f"{name}<br/>{below}", page_style.BODY),
        words(shown + (unit_text if finding["value"] is not None else ""), page_style.NUMBER),
        words(numbers.limits(finding) + unit_text, page_style.NUMBER),
        limit_bar(finding, _FINDING_WIDTHS[3] - 4 * mm, 13),
        words(finding["rule"], page_style.SMALL),
        words(numbers.risk(finding["p_false_accept"], finding["verdict"]), page_style.SMALL_NUMBER),
        Paragraph(
            f"<font color='{sign.ink.hexval().replace('0x', '#')}'><b>{sign.mark} {sign.word}</b></font>",
            page_style.BODY,
        ),
    ]


def _remark(finding: Mapping[str, Any], told: dict[str, str]) -> list[str]:
    """Return reason, assumption and note of a finding in one paragraph, and what to do in another. told: text -> label
    of the finding that has it already; the texts of this finding are added."""
    label, reason = label_of(finding["quantity"]), finding["reason"]
    advised = [] if finding["verdict"] == "pass" else [line for line in stored_advice(finding) if line not in told]
    parts = [
        f"as {told[reason]}" if reason in told else reason,
        "the limit is an assumption of the spec" if finding.get("assumed") else None,
        finding.get("note"),
    ]
    told |= dict.fromkeys(advised, label) | ({reason: told.get(reason, label)} if reason else {})
    paragraphs = ["; ".join(part for part in parts if part), f"What to do: {'; '.join(advised)}" if advised else ""]
    return [_shorten(paragraph) for paragraph in paragraphs if paragraph]


def _information_row(row: Mapping[str, Any]) -> list[Any]:
    value, U = numbers.value_and_U(row["value"], row["U"])
    unit_text = "" if row["unit"] == "1" or row["value"] is None else f" {row['unit']}"
    shown = (f"{value} ± {U}" if U else value) + unit_text
    remark = "; ".join(part for part in (row.get("reason"), row.get("note")) if part)
    texts = (check_label(row["check"]), label_of(row["quantity"]), shown, _shorten(remark))
    return [words(text, page_style.SMALL) for text in texts]


def _shorten(text: str, longest: int = LONGEST_REASON) -> str:
    return text if len(text) <= longest else text[:longest] + " … (whole text in results.json)"


def _of_check(line: str) -> str:
    name = re.match(r"\w+", line)
    known = name is not None and name[0] in CHECKS
    return f"{check_label(name[0])}{line[name.end() :]}" if name is not None and known else line


def padding(vertical: float, left: float) -> Sequence[tuple[Any, ...]]:
    """Return the style of a table whose cells keep this distance from their rows and from the left [pt]."""
    every = ((0, 0), (-1, -1))
    return (
        ("TOPPADDING", *every, vertical),
        ("BOTTOMPADDING", *every, vertical),
        ("LEFTPADDING", *every, left),
        ("RIGHTPADDING", *every, 2),
    )
