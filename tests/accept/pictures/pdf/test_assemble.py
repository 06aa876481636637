"""Files are put together as pypdf would, and as it reads them."""

import io

import pytest
from pypdf import PdfReader, PdfWriter
from reportlab.lib.colors import Color
from reportlab.pdfgen.canvas import Canvas

from accept.pictures.pdf.assemble import assemble
from accept.pictures.pdf.pdf_objects import PdfObjects, text

FIELDS = {"technician": (39.685039, 65.0, 226.5, 136.19685), "qa": (238.0, 65.0, 425.0, 136.0)}


def pages() -> bytes:
    """Three pages with text, numbers without a leading zero, and a picture that is shared."""
    out = io.BytesIO()
    canvas = Canvas(out, invariant=1, pageCompression=1, pagesize=(595.2756, 841.8898))
    for page in range(3):
        canvas.setFillColor(Color(0.2, 0.4, 0.6, alpha=0.35))
        canvas.drawString(100, 100 + page, f"page {page}: (brackets) and \\ are escaped")
        canvas.linearGradient(0, 0, 100, 100, (Color(1, 0, 0), Color(0, 0, 1)))
        canvas.showPage()
    canvas.save()
    return out.getvalue()


@pytest.mark.parametrize("title", ["APA-01: accepted", "Größe 5 µm · (a\\b)", "Δx of 日本"])
def test_pages_are_written_as_pypdf_writes_them(title: str) -> None:
    """To the byte: certificates of earlier programs are drawn again and compared."""
    writer, out = PdfWriter(clone_from=PdfReader(io.BytesIO(pages()))), io.BytesIO()
    writer.pdf_header = "%PDF-1.7"
    writer.metadata = {"/Title": title, "/Producer": "accept", "/Creator": "accept"}
    writer.write(out)
    given = {b"/Title": text(title), b"/Producer": text("accept"), b"/Creator": text("accept")}
    assert PdfObjects(pages()).written(given) == out.getvalue()


def test_attachments_and_fields_are_read_back() -> None:
    attachments = {"a b.txt": b"text " * 1000, "Δ.bin": bytes(range(256)) * 2, "unit.toml": b"", "µ": b"x"}
    reader = PdfReader(io.BytesIO(assemble(pages(), attachments, FIELDS, "Größe")))
    assert {name: content[0] for name, content in reader.attachments.items()} == attachments
    assert reader.metadata is not None
    assert reader.metadata.title == "Größe"
    fields = reader.get_fields()
    assert fields is not None
    assert {name: field["/FT"] for name, field in fields.items()} == {"technician": "/Sig", "qa": "/Sig"}
    places = [widget.get_object()["/Rect"] for widget in reader.pages[0]["/Annots"]]
    assert places == [pytest.approx(list(one), abs=0.0005) for one in FIELDS.values()]
    assert [page.extract_text()[:6] for page in reader.pages] == ["page 0", "page 1", "page 2"]


@pytest.mark.parametrize(
    ("old", "new"), [(b"/Root", b"/Ruin"), (b"/Type /Pages", b"/Type Pages"), (b"/Type /Catalog", b"/Type Catalog")]
)
def test_what_reportlab_does_not_write_is_refused(old: bytes, new: bytes) -> None:
    whole = pages()
    assert old in whole
    with pytest.raises(ValueError):
        PdfObjects(whole.replace(old, new))
