"""The page that is compared is the page that a reader opens: a signer cannot lead a reader to another one in the
revision of his own signature, nor leave something there that acts."""

import io
import re
import shutil
import subprocess
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest
from PIL import Image, ImageChops
from pyhanko.pdf_utils import generic
from pyhanko.pdf_utils.generic import pdf_name
from pyhanko.pdf_utils.reader import PdfFileReader
from pypdf import PdfReader

from accept.certificate.signature import signing
from accept.certificate.signature.signing import sign
from tests.accept.certificate.certificate_help import WHEN
from tests.accept.certificate.verify.verify_help import Bench, refused

Change = Callable[[signing._Revision], None]
GUARDS = ("holds more than a signature", "was changed", "revision", "acts by itself", "damaged")


def signed_with(bench: Bench, monkeypatch: pytest.MonkeyPatch, change: Change) -> bytes:
    """Signed by the technician's own key, by a program whose revision holds one thing more."""

    class Patched(signing._Revision):
        def __init__(self, stream: io.BytesIO) -> None:
            super().__init__(stream)
            change(self)

    with monkeypatch.context() as patch:
        patch.setattr(signing, "_Revision", Patched)
        return sign(bench.unsigned, bench.technician, WHEN)


def another_root(writer: signing._Revision) -> None:
    """A catalogue under a number that was free, with the pages of another document."""
    stream = generic.StreamObject(stream_data=b"BT /F1 40 Tf 100 700 Td (ACCEPTED) Tj ET")
    page = generic.DictionaryObject(
        {pdf_name("/Type"): pdf_name("/Page"), pdf_name("/Contents"): writer.add_object(stream)}
    )
    pages = generic.DictionaryObject(
        {
            pdf_name("/Type"): pdf_name("/Pages"),
            pdf_name("/Kids"): generic.ArrayObject([writer.add_object(page)]),
            pdf_name("/Count"): generic.NumberObject(1),
        }
    )
    root = writer.root
    other = generic.DictionaryObject({pdf_name(key): root.raw_get(key) for key in root})
    other[pdf_name("/Pages")] = writer.add_object(pages)
    writer._root = writer.add_object(other)
    writer._root_object = other
    writer.trailer["/Root"] = writer._root


def acting(key: str, action: str) -> Change:
    def change(writer: signing._Revision) -> None:
        held = {pdf_name("/S"): pdf_name(action), pdf_name("/JS"): generic.pdf_string("app.alert(1)")}
        writer.root[pdf_name(key)] = writer.add_object(generic.DictionaryObject(held))
        writer.update_root()

    return change


def free_object(writer: signing._Revision) -> None:
    """Nothing leads to it; a reader that repairs files may."""
    writer.add_object(generic.DictionaryObject({pdf_name("/Type"): pdf_name("/Catalog")}))


@pytest.mark.parametrize(
    "change",
    [another_root, acting("/OpenAction", "/JavaScript"), acting("/AA", "/Launch"), free_object],
    ids=["another catalogue", "open action", "additional actions", "an object that nothing names"],
)
def test_nothing_but_the_signature_is_in_its_revision(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, change: Change
) -> None:
    """Red before for the first three: plainly valid, while poppler showed the other page."""
    refused(bench.check(signed_with(bench, monkeypatch, change)), *GUARDS)
    assert bench.check(sign(bench.unsigned, bench.technician, WHEN)).valid  # the same without a change


def test_a_second_document_behind_the_drawn_one_is_another_page(bench: Bench) -> None:
    """The drawn bytes stand in front and no reader looks at them: the second document's cross references have no /Prev
    to them. It has the same attachments and shows less of its pages."""
    lie = re.sub(rb"/MediaBox \[ 0 0 \d", b"/MediaBox [ 0 0 1", bench.unsigned)
    assert lie != bench.unsigned
    behind = len(bench.unsigned)
    shifted = re.sub(rb"(?m)^(\d{10}) 00000 n", lambda m: b"%010d 00000 n" % (int(m[1]) + behind), lie)
    at = int(re.findall(rb"startxref\s+(\d+)", lie)[-1])
    shifted = re.sub(rb"startxref\s+\d+\s+%%EOF\s*$", b"startxref\n%d\n%%%%EOF\n" % (at + behind), shifted)
    both = bench.unsigned + shifted
    assert (
        PdfReader(io.BytesIO(both)).pages[0].mediabox == PdfReader(io.BytesIO(lie)).pages[0].mediabox
    )  # readers open the second
    refused(bench.check(sign(both, bench.technician, WHEN)), *GUARDS)


def trailer_keys(pdf: bytes) -> list[str]:
    return list(PdfFileReader(io.BytesIO(pdf)).trailer.keys())


@pytest.mark.parametrize("key", ["/Size", "/Root", "/Info", "/ID", "/Prev"])
def test_every_key_of_the_trailer_is_compared(bench: Bench, monkeypatch: pytest.MonkeyPatch, key: str) -> None:
    """Changed one at a time by the signer, before he signs."""
    assert key in trailer_keys(bench.signed)
    changed = {
        "/Size": generic.NumberObject(9999),
        "/Root": generic.IndirectObject(1, 0, None),
        "/Info": generic.IndirectObject(2, 0, None),
        "/ID": generic.ArrayObject([generic.ByteStringObject(b"x" * 16), generic.ByteStringObject(b"y" * 16)]),
        "/Prev": generic.NumberObject(9),
    }[key]

    class Patched(signing._Revision):
        def _populate_trailer(self, trailer: generic.DictionaryObject) -> None:
            super()._populate_trailer(trailer)
            self._lastobj_id += 100 * (key == "/Size")  # the size follows from it
            if key != "/Root" or trailer.raw_get("/Root").idnum != 1:
                trailer[pdf_name(key)] = changed
            else:
                trailer[pdf_name("/Root")] = generic.IndirectObject(3, 0, None)

    with monkeypatch.context() as patch:
        patch.setattr(signing, "_Revision", Patched)
        pdf = sign(bench.unsigned, bench.technician, WHEN)
    refused(bench.check(pdf))


def test_signing_leaves_nothing_to_clock_or_chance(bench: Bench) -> None:
    """Equal contents, key and time give equal bytes: what differs was put there."""
    one, two = (sign(bench.unsigned, bench.technician, WHEN) for _ in range(2))
    assert one == two
    later = sign(bench.unsigned, bench.technician, WHEN + timedelta(seconds=1))
    assert later != one


DPI = 50


def shown_by_poppler(pdf: bytes, folder: Path) -> list[Image.Image]:
    folder.mkdir()
    (folder / "page.pdf").write_bytes(pdf)
    subprocess.run(["pdftoppm", "-r", str(DPI), "-png", folder / "page.pdf", folder / "p"], check=True)
    return [Image.open(picture).convert("L") for picture in sorted(folder.glob("p*.png"))]


def outside_the_boxes(pdf: bytes, drawn: list[Image.Image], shown: list[Image.Image]) -> list[int]:
    """Return the pages that poppler shows otherwise than drawn, beside the boxes of the signatures."""
    found = []
    for n, (page, one, other) in enumerate(zip(PdfReader(io.BytesIO(pdf)).pages, drawn, shown, strict=True)):
        left = ImageChops.difference(one, other)
        for field in page.get("/Annots", ()):
            x0, y0, x1, y1 = (float(v) * DPI / 72 for v in field.get_object()["/Rect"])
            left.paste(0, (int(x0) - 1, int(one.height - y1) - 1, int(x1) + 2, int(one.height - y0) + 2))
        found += [n] if one.size != other.size or left.getbbox() else []
    return found


@pytest.mark.soak
@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="pdftoppm (poppler-utils) is not installed: no second eye")
def test_poppler_shows_the_drawn_page_and_the_boxes_of_the_signatures(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """What is compared by bytes is what another program shows. A catalogue of the signer's own shows something else."""
    drawn = shown_by_poppler(bench.unsigned, tmp_path / "drawn")
    assert ImageChops.difference(drawn[0], Image.new("L", drawn[0].size, 255)).getbbox()  # not a white page
    signed = shown_by_poppler(bench.signed, tmp_path / "signed")
    assert outside_the_boxes(bench.signed, drawn, signed) == []
    assert ImageChops.difference(drawn[0], signed[0]).getbbox()  # the box itself is filled
    lie = signed_with(bench, monkeypatch, another_root)
    assert outside_the_boxes(lie, drawn[:1], shown_by_poppler(lie, tmp_path / "lie")[:1]) == [0]
