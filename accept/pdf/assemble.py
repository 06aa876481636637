"""Puts the parts of a certificate together: pages, vector figures, attachments, empty signature fields."""

import hashlib
import io
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pypdf import PdfReader, PdfWriter
from pypdf.generic import (
    ArrayObject,
    BooleanObject,
    ByteStringObject,
    DecodedStreamObject,
    DictionaryObject,
    FloatObject,
    IndirectObject,
    NameObject,
    NumberObject,
    PdfObject,
    StreamObject,
    TextStringObject,
)

_PRINTED = 4  # annotation flag: print it
_SIGNED_FILE = 3  # SigFlags: there are signatures, only append to this file


@dataclass(frozen=True)
class Placed:
    """A one-page PDF to be drawn with its lower left corner at x, y [pt] of page `page`, counted from 0."""

    page: int
    x: float
    y: float
    pdf: bytes


def assemble(
    text: bytes,
    figures: Sequence[Placed],
    attachments: Mapping[str, bytes],
    fields: Mapping[str, tuple[float, float, float, float]],
    title: str,
) -> bytes:
    """One PDF of all parts. The same parts give the same bytes: no date, no random identifier."""
    writer = PdfWriter(clone_from=PdfReader(io.BytesIO(text)))
    for nth, figure in enumerate(figures, 1):
        _draw_figure(writer, figure, f"/Figure{nth}")
    _attach(writer, attachments)
    _add_fields(writer, fields)
    writer.pdf_header = "%PDF-1.7"  # reportlab writes 1.3, which knows no signatures of this kind
    writer.metadata = {"/Title": title, "/Producer": "accept", "/Creator": "accept"}
    writer.root_object[NameObject("/Lang")] = TextStringObject("en")
    writer.root_object[NameObject("/ViewerPreferences")] = _dictionary({"/DisplayDocTitle": BooleanObject(True)})
    out = io.BytesIO()
    writer.write(out)
    return out.getvalue()


def _draw_figure(writer: PdfWriter, figure: Placed, name: str) -> None:
    """The figure becomes a form, so that its own operators and resources stay untouched."""
    source = PdfReader(io.BytesIO(figure.pdf)).pages[0]
    form = StreamObject()
    contents = source.get_contents()
    form.set_data(b"" if contents is None else contents.get_data())
    form.update(
        {
            NameObject("/Type"): NameObject("/XObject"),
            NameObject("/Subtype"): NameObject("/Form"),
            NameObject("/BBox"): ArrayObject([FloatObject(v) for v in source.mediabox]),
            NameObject("/Resources"): source["/Resources"].clone(writer),
        }
    )
    reference = _added(writer, form.flate_encode())
    page = writer.pages[figure.page]
    resources: Any = page["/Resources"]
    forms = resources.get("/XObject", DictionaryObject()).get_object()
    forms[NameObject(name)] = reference
    resources[NameObject("/XObject")] = forms
    drawing = DecodedStreamObject()
    drawing.set_data(f"q 1 0 0 1 {figure.x:.3f} {figure.y:.3f} cm {name} Do Q\n".encode())
    before = page.raw_get("/Contents")
    parts = list(before) if isinstance(before, ArrayObject) else [before]
    page[NameObject("/Contents")] = ArrayObject([*parts, _added(writer, drawing)])


def _attach(writer: PdfWriter, attachments: Mapping[str, bytes]) -> None:
    """Embedded files, also listed as associated with the document ([ISO32000-2] 14.13)."""
    names, associated = ArrayObject(), ArrayObject()
    for name, content in sorted(attachments.items()):
        reference = _added(writer, _file(writer, name, content))
        names.extend([TextStringObject(name), reference])
        associated.append(reference)
    tree = _dictionary({"/EmbeddedFiles": _dictionary({"/Names": names})})
    writer.root_object[NameObject("/Names")] = _added(writer, tree)
    writer.root_object[NameObject("/AF")] = associated


def _file(writer: PdfWriter, name: str, content: bytes) -> DictionaryObject:
    stream = StreamObject()
    packed = zlib.compress(content, 6)
    smaller = len(packed) < len(content)
    stream.set_data(packed if smaller else content)
    if smaller:
        stream[NameObject("/Filter")] = NameObject("/FlateDecode")
    digest = hashlib.md5(content, usedforsecurity=False).digest()  # the format asks for MD5; nothing relies on it
    size = {"/Size": NumberObject(len(content)), "/CheckSum": ByteStringObject(digest)}
    stream.update({NameObject("/Type"): NameObject("/EmbeddedFile"), NameObject("/Params"): _dictionary(size)})
    reference = _added(writer, stream)
    return _dictionary(
        {
            "/Type": NameObject("/Filespec"),
            "/F": TextStringObject(name),
            "/UF": TextStringObject(name),
            "/EF": _dictionary({"/F": reference, "/UF": reference}),
            "/AFRelationship": NameObject("/Data"),
        }
    )


def _add_fields(writer: PdfWriter, fields: Mapping[str, tuple[float, float, float, float]]) -> None:
    """Empty, visible signature fields on the first page."""
    page = writer.pages[0]
    widgets = ArrayObject()
    for name, rectangle in fields.items():
        widget = _dictionary(
            {
                "/Type": NameObject("/Annot"),
                "/Subtype": NameObject("/Widget"),
                "/FT": NameObject("/Sig"),
                "/T": TextStringObject(name),
                "/Rect": ArrayObject([FloatObject(f"{v:.3f}") for v in rectangle]),
                "/F": NumberObject(_PRINTED),
                "/P": page.indirect_reference,
            }
        )
        widgets.append(_added(writer, widget))
    page[NameObject("/Annots")] = ArrayObject(widgets)
    form = _dictionary({"/Fields": widgets, "/SigFlags": NumberObject(_SIGNED_FILE)})
    writer.root_object[NameObject("/AcroForm")] = _added(writer, form)


def _added(writer: PdfWriter, what: PdfObject) -> IndirectObject:
    return writer._add_object(what)  # noqa: SLF001 - pypdf has no public name for it


def _dictionary(entries: Mapping[str, Any]) -> DictionaryObject:
    return DictionaryObject({NameObject(key): value for key, value in entries.items()})
