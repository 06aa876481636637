"""What flows over a certificate's pages: identity, findings, pictures, information, what was not judged."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from reportlab.lib.units import mm
from reportlab.platypus import Flowable, Paragraph, Spacer, Table, TableStyle

from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.statements import statements
from accept.gap.text import (
    REFUSED,
    alternatives,
    gap_number,
    headline_of,
    parameters,
    values_of,
    without_a_name,
    words_of,
)
from accept.pictures.labels import label_of
from accept.pictures.pdf import numbers, page_style
from accept.pictures.pdf.limit_bar import limit_bar
from accept.pictures.pdf.page_style import words

LONGEST_REASON = 700  # characters; a row of a table must fit a page, the whole text is in results.json
_FINDING_WIDTHS = [w * mm for w in (36, 36, 30, 30, 13, 16, 21)]
_INFORMATION_WIDTHS = [w * mm for w in (34, 44, 40, 64)]


def identity(contents: CertificateContent) -> list[Flowable]:
    """Who and what: spec, operator, instruments, parts, program."""
    parts = contents.result.get("parts") or {}
    attached = sum(name in contents.files for name in contents.inputs)
    rows = [
        *statements(contents).items(),
        ("Operator", contents.operator or "not named"),
        ("Instruments", _listed(contents.instruments) or "none named by the spec"),
        ("Parts", _listed(parts)),
        ("Record", f"{attached} of {len(contents.inputs)} input files attached; the hash of each in manifest.json"),
    ]
    cells = [[words(name, page_style.TABLE_HEAD), words(text, page_style.SMALL)] for name, text in rows if text]
    table = Table(cells, colWidths=[20 * mm, page_style.INNER - 20 * mm], splitInRow=1)
    table.setStyle(TableStyle([("VALIGN", (0, 0), (-1, -1), "TOP"), *_padding(0.6, left=0)]))
    return [table]


def findings(contents: CertificateContent) -> list[Flowable]:
    """The table of findings; the reason of a finding stands below its row and stays with it."""
    head = ("Quantity", "Value ± U (k = 2)", "Limits", "Position", "Rule", "P(false)", "Verdict")
    right = (1, 2, 5)
    cells: list[list[Any]] = [
        [words(h, page_style.TABLE_HEAD_NUMBER if n in right else page_style.TABLE_HEAD) for n, h in enumerate(head)]
    ]
    style: list[tuple[Any, ...]] = [
        ("VALIGN", (0, 0), (-1, -1), "MIDDLE"),
        ("LINEBELOW", (0, 0), (-1, 0), 0.8, page_style.INK_COLOUR),
        *_padding(1.3, left=2),
        ("RIGHTPADDING", (2, 0), (2, -1), 9),
        ("RIGHTPADDING", (5, 0), (5, -1), 6),
    ]
    for finding in contents.result["findings"]:
        first = len(cells)
        cells.append(_finding_row(finding))
        remark = _remark(finding)
        if remark:
            cells.append([words(remark, page_style.SMALL), *[""] * 6])
            style += [("SPAN", (0, first + 1), (-1, first + 1)), ("NOSPLIT", (0, first), (-1, first + 1))]
            style += [("TOPPADDING", (0, first + 1), (-1, first + 1), 0)]
        style.append(("LINEBELOW", (0, len(cells) - 1), (-1, len(cells) - 1), 0.4, page_style.PALE_COLOUR))
    table = Table(cells, colWidths=_FINDING_WIDTHS, repeatRows=1)
    table.setStyle(TableStyle(style))
    return [words("Findings", page_style.HEADING), table]


def information(contents: CertificateContent) -> list[Flowable]:
    """Measured quantities that the spec does not limit."""
    rows = contents.result.get("information") or []
    if not rows:
        return []
    head = [words(h, page_style.TABLE_HEAD) for h in ("Check", "Quantity", "Value ± U (k = 2)", "Remark")]
    cells = [head, *(_information_row(row) for row in rows)]
    table = Table(cells, colWidths=_INFORMATION_WIDTHS, repeatRows=1)
    rule = ("LINEBELOW", (0, 0), (-1, 0), 0.5, page_style.GREY_COLOUR)
    table.setStyle(TableStyle([("VALIGN", (0, 0), (-1, -1), "TOP"), rule, *_padding(0.4, left=2)]))
    return [words("Measured, without limits in this spec", page_style.HEADING), table]


def explanation(contents: CertificateContent) -> list[Flowable]:
    """How the responses compare with the model: what is missing, by name, and the gap before and after. For
    information: no verdict comes of it."""
    found = contents.result.get("gap")
    if found is None:
        return []
    head = words(f"Responses against model {found.get('model', found['start'])}, for information", page_style.HEADING)
    if found["verdict"] == REFUSED:
        return [head, words(f"Not compared: {found['reason']}", page_style.SMALL)]
    story: list[Flowable] = [head, *_missing(found)]
    twice = _estimated_twice(found, contents.result["findings"])
    story += [words(twice, page_style.BODY)] if twice else []
    rows = [[words(h, page_style.TABLE_HEAD) for h in ("Channel", "G before", "G after")]]
    after = found["gap_after"]["channels"]
    rows += [
        [words(x, page_style.SMALL) for x in (c, gap_number(G), gap_number(after[c]))] for c, G in _channels(found)
    ]
    table = Table(rows, colWidths=[w * mm for w in (20, 24, 24)], hAlign="LEFT")
    whole = ("NOSPLIT", (0, 0), (-1, -1))  # no head at the foot of a page
    rule = ("LINEBELOW", (0, 0), (-1, 0), 0.5, page_style.GREY_COLOUR)
    table.setStyle(TableStyle([whole, rule, *_padding(0.4, left=2)]))
    legend = "G: squared residual over noise and stated tolerance, on records that were not fitted; 1 or less agrees."
    return [*story, table, words(legend, page_style.QUIET)]


def _channels(found: Mapping[str, Any]) -> list[tuple[str, float]]:
    """In the order of their names, as the attached JSON has them: the page is drawn again from there."""
    return sorted(found["gap_before"]["channels"].items())


def _missing(found: Mapping[str, Any]) -> list[Flowable]:
    """The effects named, rivals and the experiment that distinguishes them, and unidentified effects."""
    story: list[Flowable] = [
        words(headline_of(found["verdict"], [n["effect"] for n in found["named"]]) + ".", page_style.STRONG)
    ]
    for n in found["named"]:
        values = parameters(values_of(n), "{} {} ({} to {})", "; ")
        story.append(words(f"{n['sentence']} {words_of(n['effect'])}{': ' if values else ''}{values}", page_style.BODY))
    for a in found["ambiguous"]:
        story.append(words(alternatives(a), page_style.BODY))
    for u in found["unnamed"]:
        story.append(words(f"Unidentified effect: {without_a_name(u)}", page_style.BODY))
    return story


def _estimated_twice(found: Mapping[str, Any], findings: Sequence[Mapping[str, Any]]) -> str:
    """For who meets two values of one quantity on a certificate: which one is judged, and whether they differ by more
    than both expanded uncertainties allow."""
    named = {name: p for n in found["named"] for name, p in n["parameters"].items()}
    judged = [f for f in findings if f["quantity"] in named and f["value"] is not None and f["U"] is not None]
    if not judged:
        return ""
    shown, apart = [], []
    for finding in judged:
        other = named[finding["quantity"]]
        half = (other["ci95"][1] - other["ci95"][0]) / 2.0
        value, U = numbers.value_and_U(finding["value"], finding["U"])
        shown.append(f"{label_of(finding['quantity'])} {value} ± {U} {finding['unit']}")
        if abs(finding["value"] - other["value"]) > math.hypot(finding["U"], half):
            apart.append(label_of(finding["quantity"]))
    agree = (
        f"They differ by more than their uncertainties in {', '.join(apart)}" if apart else "The two estimates agree"
    )
    return f"Judged are the findings above: {', '.join(shown)}; the gap analysis estimates them once more. {agree}."


def budgets(contents: CertificateContent) -> list[Flowable]:
    """What the U of each finding is made of: standard uncertainties, type A from scatter, type B stated ([JCGM100])."""
    lines = [
        f"{label_of(f['quantity'])}: "
        + "; ".join(f"{c['source']} {c['u']:.2g} {f['unit']} ({c['kind']})" for c in f["budget"])
        for f in contents.result["findings"]
        if f.get("budget")
    ]
    if not lines:
        return []
    head = words("Uncertainty budgets (standard uncertainties; A from scatter, B stated)", page_style.HEADING)
    return [head, *(words(_shortened(line), page_style.SMALL) for line in lines)]


def remarks(contents: CertificateContent) -> list[Flowable]:
    """Sections that were not judged, notes, and what the certificate does not say."""
    story: list[Flowable] = []
    left_out, notes = contents.result.get("not_judged") or [], contents.result.get("notes") or []
    if left_out:
        story += [words("Not judged by this spec", page_style.HEADING), words("; ".join(left_out), page_style.SMALL)]
    if notes:
        story += [words("Notes", page_style.HEADING), *(words(f"· {note}", page_style.SMALL) for note in notes)]
    return [*story, Spacer(1, 5), words(contents.statement, page_style.QUIET)]


def _finding_row(finding: Mapping[str, Any]) -> list[Any]:
    unit = finding["unit"]
    sign = page_style.FINDING_SIGNS[finding["verdict"]]
    value, U = numbers.value_and_U(finding["value"], finding["U"])
    shown = f"{value} ± {U}" if U else value
    name = f"<b>{escape(label_of(finding['quantity']), quote=False)}</b>"
    optional = "" if finding.get("required", True) else ", not required"
    below = f"<font size='5.8' color='#777777'>{escape(finding['check'] + optional, quote=False)}</font>"
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


def _remark(finding: Mapping[str, Any]) -> str:
    """Reason, assumption and note in one paragraph."""
    parts = [
        finding["reason"],
        "the limit is an assumption of the spec" if finding.get("assumed") else None,
        finding.get("note"),
    ]
    return _shortened("; ".join(part for part in parts if part))


def _information_row(row: Mapping[str, Any]) -> list[Any]:
    value, U = numbers.value_and_U(row["value"], row["U"])
    unit_text = "" if row["unit"] == "1" or row["value"] is None else f" {row['unit']}"
    shown = (f"{value} ± {U}" if U else value) + unit_text
    remark = "; ".join(part for part in (row.get("reason"), row.get("note")) if part)
    texts = (row["check"], label_of(row["quantity"]), shown, _shortened(remark))
    return [words(text, page_style.SMALL) for text in texts]


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST_REASON else text[:LONGEST_REASON] + " … (whole text in results.json)"


def _listed(entries: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {text}" for name, text in sorted(entries.items()))


def _padding(vertical: float, left: float) -> Sequence[tuple[Any, ...]]:
    every = ((0, 0), (-1, -1))
    return (
        ("TOPPADDING", *every, vertical),
        ("BOTTOMPADDING", *every, vertical),
        ("LEFTPADDING", *every, left),
        ("RIGHTPADDING", *every, 2),
    )
