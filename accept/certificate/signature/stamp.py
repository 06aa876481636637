"""The appearance of a signature on the page: person, role, time, key."""

import io
from datetime import UTC, datetime

from pyhanko.pdf_utils import layout
from pyhanko.pdf_utils.content import PdfContent
from pyhanko.pdf_utils.layout import BoxConstraints
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.stamp import StaticStampStyle
from reportlab.lib.utils import simpleSplit
from reportlab.pdfgen.canvas import Canvas

from accept.certificate.page.fixed_parts import BOXES
from accept.certificate.trust import authority
from accept.certificate.trust.keys import Credential
from accept.pictures.pdf import page_style
from accept.pictures.pdf.fonts import BOLD, REGULAR, fitting_size, register
from accept.store.payloads import CHOICES, Disposition

_WORDS = {"technician": "Signed: measured and judged", "qa": "Countersigned: reviewed and authorised"}
_SIMULATED_WORDS = {"technician": "Signed: simulated, not measured", "qa": "Countersigned: a simulation"}


class _Page(PdfContent):
    """The first page of a PDF held in memory."""

    def __init__(self, pdf: bytes) -> None:
        super().__init__()
        self.pdf = pdf

    def render(self) -> bytes:
        form = self._ensure_writer.import_page_as_xobject(PdfFileReader(io.BytesIO(self.pdf)))
        self.resources.xobject["/Stamp"] = form
        left, bottom, right, top = form.get_object()["/BBox"]
        self.box = BoxConstraints(width=right - left, height=top - bottom)
        return b"/Stamp Do"


def stamp_style(
    credential: Credential,
    when: datetime,
    size: tuple[float, float],
    disposition: Disposition | None = None,
    simulated: bool = False,
) -> StaticStampStyle:
    """Return the appearance of a signature for pyhanko, as large as its box [pt]. simulated: of a simulated unit."""
    return StaticStampStyle(
        border_width=0,
        background=_Page(_draw(credential, when, size, disposition, simulated)),
        background_opacity=1.0,
        background_layout=layout.SimpleBoxLayoutRule(
            x_align=layout.AxisAlignment.ALIGN_MIN, y_align=layout.AxisAlignment.ALIGN_MIN, margins=layout.Margins()
        ),
    )


def _draw(
    credential: Credential, when: datetime, size: tuple[float, float], disposition: Disposition | None, simulated: bool
) -> bytes:
    register()
    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=size, invariant=1)
    width, height = size
    canvas.setFillColor(page_style.WHITE)
    canvas.setStrokeColor(page_style.INK_COLOUR)
    canvas.setLineWidth(0.8)
    canvas.rect(0.4, 0.4, width - 0.8, height - 0.8, stroke=1, fill=1)
    decided = () if disposition is None else _decided(disposition, width - 14)
    name_size, time_size = (12.0, 8.0) if disposition is None else (9.0, 6.8)
    meaning = (_SIMULATED_WORDS if simulated else _WORDS)[credential.role]
    lines = (
        (credential.person, BOLD, name_size, page_style.INK_COLOUR),
        (f"{BOXES[credential.role]} · {meaning}", REGULAR, 6.8, page_style.INK_COLOUR),
        *((line, font, 6.8, page_style.INK_COLOUR) for line, font in decided),
        (f"{when.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC", REGULAR, time_size, page_style.INK_COLOUR),
        (
            f"certificate sha256 {authority.fingerprint(credential.certificate)[:32]}",
            REGULAR,
            5.4,
            page_style.GREY_COLOUR,
        ),
        (f"issued by {authority.person_of(credential.ca)}", REGULAR, 5.4, page_style.GREY_COLOUR),
    )
    y = height - 6.0
    shrunk = min(1.0, (height - 10.5) / (1.22 * sum(largest for _, _, largest, _ in lines)))  # to end above the border
    for text, font, largest, colour in lines:
        points = fitting_size(text, font, shrunk * largest, width - 14)
        y -= shrunk * largest * 1.22
        canvas.setFillColor(colour)
        canvas.setFont(font, points)
        canvas.drawString(7, y, text)
    canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def _decided(disposition: Disposition, width: float) -> list[tuple[str, str]]:
    """Return the lines of the disposition: what is to be done with the unit, and the reason in at most two lines.
    `fitted` makes a long word smaller."""
    reason = simpleSplit(disposition.reason, REGULAR, 6.8, width)
    lines = [reason[0], " ".join(reason[1:])] if len(reason) > 1 else reason
    return [(f"Disposition: {CHOICES[disposition.choice]}", BOLD), *((line, REGULAR) for line in lines)]
