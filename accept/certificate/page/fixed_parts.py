"""The parts at fixed places of a certificate's pages: head, verdict, signature boxes, code, footer."""

import io
import math
from collections.abc import Mapping
from functools import cache, lru_cache
from itertools import groupby
from typing import Any

from reportlab.graphics.barcode.qr import QrCodeWidget
from reportlab.lib.units import mm
from reportlab.lib.utils import simpleSplit
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject

from accept.base.documents.results import SIMULATED, unit_word
from accept.certificate.contents.content import CertificateContent
from accept.pictures.labels import label_of
from accept.pictures.pdf import page_style
from accept.pictures.pdf.fonts import BOLD, MONO, REGULAR, fitting_size
from accept.store.payloads import without_hashes

TECHNICIAN, QA = "technician", "qa"
BOXES = {TECHNICIAN: "Technician; date of issue", QA: "Quality assurance"}
_BOX = (187, 71)  # pt, whole numbers because pyhanko rounds the box of an appearance
_CODE = 29 * mm
_CONCEDED = "accepted by concession"
_BY_QA = "Quality assurance decides in its box below"  # so before the box is signed and afterwards
_TOP = page_style.HEIGHT - page_style.MARGIN


def field_rectangles() -> dict[str, tuple[float, float, float, float]]:
    """Return signature field -> (left, bottom, right, top) [pt] on the first page."""
    bottom = page_style.MARGIN + page_style.FOOTER
    lefts = {name: page_style.MARGIN + nth * (_BOX[0] + 4 * mm) for nth, name in enumerate(BOXES)}
    return {name: (left, bottom, left + _BOX[0], bottom + _BOX[1]) for name, left in lefts.items()}


def code_text(contents: CertificateContent) -> str:
    """Return the text of the square code: enough to find the record and to recognise it."""
    simulated = " simulated" if contents.simulated else ""
    return f"ACCEPT serial={contents.serial} record-sha256={contents.record_sha256}{simulated}"


def first_page(canvas: Canvas, contents: CertificateContent) -> None:
    """Draw the fixed parts of the first page: title, verdict, signature boxes, code."""
    _across(canvas, contents)
    _title(canvas, contents)
    _verdict(canvas, contents)
    _boxes(canvas)
    _code(canvas, contents)


def later_page(canvas: Canvas, contents: CertificateContent) -> None:
    """Draw the head of every other page."""
    _across(canvas, contents)
    sign = page_style.UNIT_SIGNS[_word(contents.result)]
    canvas.setFont(BOLD, 8)
    canvas.setFillColor(page_style.INK_COLOUR)
    line = f"{contents.serial}   {sign.mark} {sign.word}"
    line += f"   {SIMULATED}" if contents.simulated else ""
    canvas.setFont(BOLD, fitting_size(line, BOLD, 8, page_style.INNER))
    canvas.drawString(page_style.MARGIN, _TOP - 8, line)
    _rule(canvas, _TOP - page_style.RUNNING_HEAD + 9)


def footer(canvas: Canvas, contents: CertificateContent, page: int, pages: int) -> None:
    """Draw the foot of a page, with its number and the number of pages."""
    y = page_style.MARGIN
    _rule(canvas, y + 9)
    canvas.setFillColor(page_style.GREY_COLOUR)
    right = f"page {page} of {pages}"
    named = contents.stated.number or contents.serial
    left = (
        f"{named} · spec {contents.spec_name} {contents.spec_sha256[:12]}"
        f" · record {contents.record_sha256[:12]}"
        f" · accept {contents.accept_version} ({contents.code_sha256[:12]}) · check with: accept verify FILE.pdf"
    )
    canvas.setFont(REGULAR, fitting_size(left, REGULAR, 5.8, page_style.INNER - 25 * mm))
    canvas.drawString(page_style.MARGIN, y, left)
    canvas.setFont(BOLD, 6.5)
    canvas.drawRightString(page_style.WIDTH - page_style.MARGIN, y, right)


def _across(canvas: Canvas, contents: CertificateContent) -> None:
    if not contents.simulated:
        return
    canvas.saveState()
    canvas.setFillColor(page_style.ACROSS)
    canvas.translate(page_style.WIDTH / 2, 0.5 * page_style.HEIGHT)  # above the boxes, which would hide its beginning
    canvas.rotate(math.degrees(math.atan2(page_style.HEIGHT, page_style.WIDTH)))
    diagonal = math.hypot(page_style.WIDTH, page_style.HEIGHT)
    canvas.setFont(BOLD, fitting_size(SIMULATED, BOLD, 60, 0.62 * diagonal))
    canvas.drawCentredString(0, -20, SIMULATED)
    canvas.restoreState()


def _title(canvas: Canvas, contents: CertificateContent) -> None:
    width = page_style.INNER - 96 * mm
    canvas.setFillColor(page_style.GREY_COLOUR)
    canvas.setFont(BOLD, 8)
    title = SIMULATED if contents.simulated else "ACCEPTANCE CERTIFICATE"
    title = "DEMO: NO ACCEPTANCE OF A REAL UNIT" if contents.stated.demo else title
    title = f"{title} {number}" if (number := contents.stated.number) else title
    canvas.setFont(BOLD, fitting_size(title, BOLD, 8, width))
    canvas.drawString(page_style.MARGIN, _TOP - 8, title)
    canvas.setFillColor(page_style.INK_COLOUR)
    canvas.setFont(BOLD, fitting_size(contents.serial, BOLD, 30, width))
    canvas.drawString(page_style.MARGIN, _TOP - 42, contents.serial)
    kind = f"{str(contents.result['kind']).upper()} · {contents.spec_title}"
    canvas.setFont(REGULAR, fitting_size(kind, REGULAR, 8.5, width))
    canvas.drawString(page_style.MARGIN, _TOP - 57, kind)
    amendment = f"Amendment to certificate {contents.stated.amends}. " if contents.stated.amends else ""
    lines = simpleSplit(f"{amendment}{summary(contents.result)}", BOLD, 7, width)
    for nth, line in enumerate(lines if len(lines) <= 3 else [*lines[:2], f"{lines[2]} …"]):
        canvas.setFont(BOLD, 7)
        canvas.drawString(page_style.MARGIN, _TOP - 71 - 9 * nth, line)


def summary(result: Mapping[str, Any]) -> str:
    """Return the reason of the unit's verdict, in a sentence that names the quantities; nonconformances come first."""
    if nonconformances := result.get("nonconformances"):
        others = summary({**result, "nonconformances": []}) if result["verdict"] != "conditional" else ""
        listed = "; ".join(map(without_hashes, nonconformances))  # the notes have the hashes of their files
        return f"Held by a nonconformance: {listed}. {_BY_QA}. {others}".rstrip()
    by_verdict: dict[str, list[str]] = {}
    for finding in result["findings"]:
        by_verdict.setdefault(finding["verdict"], []).append(label_of(finding["quantity"]))
    deciding = {"rejected": "fail", "incomplete": "no_result", "conditional": "conditional"}.get(
        result["verdict"], "pass"
    )
    named = by_verdict.get(deciding, [])
    if result["verdict"] == "accepted":
        conceded = f" {_CONCEDED.capitalize()}." if _word(result) == _CONCEDED else ""
        return f"All {sum(f['required'] for f in result['findings'])} required findings pass.{conceded}"
    words = {"fail": "Outside the limits", "no_result": "No result for", "conditional": "Not decided within U"}[
        deciding
    ]
    return f"{words}: {'; '.join(named) or 'nothing was required'}."


def _word(result: Mapping[str, Any]) -> str:
    return unit_word(result["verdict"], result.get("nonconformances", ()), result.get("dispositions", ()))


def _verdict(canvas: Canvas, contents: CertificateContent) -> None:
    word, verdict = _word(contents.result), str(contents.result["verdict"])
    sign = page_style.UNIT_SIGNS[verdict if word == _CONCEDED else word]
    width, height = 92 * mm, 26 * mm
    left, bottom = page_style.WIDTH - page_style.MARGIN - width, _TOP - height
    empty = contents.simulated or sign.fill == page_style.WHITE
    ink = page_style.INK_COLOUR if contents.simulated else sign.ink
    canvas.setFillColor(page_style.WHITE if empty else sign.fill)
    canvas.setStrokeColor(ink if empty else sign.fill)
    canvas.setLineWidth(2)
    canvas.roundRect(left, bottom, width, height, 3 * mm, stroke=1, fill=1)
    canvas.setFillColor(ink)
    canvas.setFont(BOLD, 44)
    canvas.drawCentredString(left + 13 * mm, bottom + height / 2 - 15, sign.mark)
    room = width - 26 * mm
    size = fitting_size(sign.word, BOLD, 40, room)
    canvas.setFont(BOLD, size)
    canvas.drawCentredString(left + 22 * mm + room / 2, bottom + height / 2 - 0.36 * size, sign.word)
    below = ["BY CONCESSION OF QUALITY ASSURANCE"] if word == _CONCEDED else []
    below = [f"{verdict.upper()}: {_BY_QA.upper()}"] if not below and word != verdict else below  # as in results.json
    below += [SIMULATED] if contents.simulated else []
    for nth, line in enumerate(reversed(below)):
        canvas.setFont(BOLD, fitting_size(line, BOLD, 8, room))
        canvas.drawCentredString(left + 22 * mm + room / 2, bottom + 2.5 * mm + 9 * nth, line)


@cache
def open_fields() -> bytes:
    """Return what the signature fields show until they are signed, as a PDF with a page of its size for each. The
    appearance of a signature takes its place, while words of the page would stay below that and be read with it."""
    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=_BOX, invariant=1)
    for words in ("not signed", "not authorised: countersignature open"):
        canvas.setFillColor(page_style.GREY_COLOUR)
        canvas.setFont(REGULAR, 7)
        canvas.drawCentredString(_BOX[0] / 2, _BOX[1] / 2 - 2, words)
        canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def _boxes(canvas: Canvas) -> None:
    for name, (left, bottom, right, top) in field_rectangles().items():
        canvas.setFillColor(page_style.INK_COLOUR)
        canvas.setFont(BOLD, 7)
        canvas.drawString(left, top + 3, BOXES[name])
        canvas.setStrokeColor(page_style.GREY_COLOUR)
        canvas.setLineWidth(0.5)
        canvas.setDash(2, 2)
        canvas.rect(left, bottom, right - left, top - bottom)
        canvas.setDash()


def _code(canvas: Canvas, contents: CertificateContent) -> None:
    left, bottom = page_style.WIDTH - page_style.MARGIN - _CODE, page_style.MARGIN + page_style.FOOTER + 3 * mm
    _squares(canvas, code_text(contents), left, bottom)
    canvas.setFillColor(page_style.GREY_COLOUR)
    digest = contents.record_sha256
    size = fitting_size(digest[:32], MONO, 5, _CODE)
    canvas.setFont(MONO, size)
    for nth in range(2):
        canvas.drawString(left, bottom - 5 - (size + 0.6) * nth, digest[32 * nth : 32 * nth + 32])


def _squares(canvas: Canvas, text: str, left: float, bottom: float) -> None:
    """Draw the code as one path, a rectangle for each run of dark squares: a rectangle for each square is slow."""
    rows = _modules(text)
    side = _CODE / len(rows)
    code = []
    for row, dark in enumerate(rows):
        y = bottom + _CODE - (row + 1) * side
        column = 0
        for is_dark, run in groupby(dark):
            length = len(list(run))
            if is_dark:
                code.append(f"{left + column * side:.4f} {y:.4f} {length * side:.4f} {side:.4f} re")
            column += length
    canvas.setFillColor(page_style.INK_COLOUR)
    canvas.drawPath(PDFPathObject(code=code), stroke=0, fill=1)


@lru_cache(8)
def _modules(text: str) -> tuple[tuple[bool, ...], ...]:
    """Return the rows of squares of a code, dark or not. Choosing among its eight masks takes a quarter of the time of
    a page, and a page that was just drawn is drawn again when its certificate is verified."""
    code: Any = QrCodeWidget(text, barLevel="M").qr
    code.make()
    return tuple(tuple(bool(dark) for dark in row) for row in code.modules)


def _rule(canvas: Canvas, y: float) -> None:
    canvas.setStrokeColor(page_style.PALE_COLOUR)
    canvas.setLineWidth(0.6)
    canvas.line(page_style.MARGIN, y, page_style.WIDTH - page_style.MARGIN, y)
