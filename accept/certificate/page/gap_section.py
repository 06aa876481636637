"""The certificate's section on the gap between responses and model; loaded only if a result has such a part."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from reportlab.lib.units import mm
from reportlab.platypus import Flowable, Table, TableStyle

from accept.base.documents.analyses import REFUSED
from accept.certificate.page.body import padding
from accept.gap import findings, gap_by_channel, headline_of_document
from accept.pictures.labels import label_of
from accept.pictures.pdf import numbers, page_style
from accept.pictures.pdf.page_style import words


def explanation(result: Mapping[str, Any]) -> list[Flowable]:
    """Return the comparison of the responses with the model: the effects that are missing, and the gap before and
    after. It is information and does not change the verdict. result: with its part `gap`."""
    found = result["gap"]
    head = words(f"Responses against model {found.get('model', found['start'])}, for information", page_style.HEADING)
    if found["verdict"] == REFUSED:
        return [head, words(f"Not compared: {found['reason']}", page_style.SMALL)]
    story = [head, words(headline_of_document(found) + ".", page_style.STRONG)]
    story += [words(" ".join([each.words, *each.details]), page_style.BODY) for each in findings(found)]
    twice = _estimated_twice(found, result["findings"])
    story += [words(twice, page_style.BODY)] if twice else []
    gap = gap_by_channel(found)
    # in the order of the names, as the attached JSON has them: the page is drawn again from there
    cells = [[words(h, page_style.TABLE_HEAD) for h in gap.head]]
    cells += [[words(x, page_style.SMALL) for x in row] for row in sorted(gap.rows)]
    table = Table(cells, colWidths=[w * mm for w in (20, 24, 24)], hAlign="LEFT")
    whole = ("NOSPLIT", (0, 0), (-1, -1))  # no head at the foot of a page
    rule = ("LINEBELOW", (0, 0), (-1, 0), 0.5, page_style.GREY_COLOUR)
    table.setStyle(TableStyle([whole, rule, *padding(0.4, left=2)]))
    return [*story, table, words(gap.note, page_style.QUIET)]


def _estimated_twice(found: Mapping[str, Any], findings: Sequence[Mapping[str, Any]]) -> str:
    """Return which of two values of one quantity on the certificate is judged, and whether they differ by more than
    both expanded uncertainties allow."""
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
