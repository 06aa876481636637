"""Puts the parts of a certificate together: pages, attachments, empty signature fields."""

import hashlib
import io
import zlib
from collections.abc import Mapping
from typing import Any

from pypdf import PageObject, PdfReader, PdfWriter
from pypdf.generic import (
    ArrayObject,
    BooleanObject,
    ByteStringObject,
    DictionaryObject,
    FloatObject,
    IndirectObject,
    NameObject,
    NumberObject,
    PdfObject,
    StreamObject,
    TextStringObject,
)

_SAMPLE = 20_000  # bytes that tell whether the rest can be compressed
_SMALL = 1_000_000  # bytes: below, the fastest compression costs a certificate half a percent of its size
_PRINTED = 4  # annotation flag: print it
_SIGNED_FILE = 3  # SigFlags: there are signatures, only append to this file


def assemble(
    text: bytes,
    attachments: Mapping[str, bytes],
    fields: Mapping[str, tuple[float, float, float, float]],
    title: str,
    shown: bytes | None = None,
) -> bytes:
    """Return one PDF of all parts. The same parts give the same bytes: no date, no random identifier. shown: a PDF for
    the empty signature fields, with a page of its size for each."""
    writer = PdfWriter(clone_from=PdfReader(io.BytesIO(text)))
    _attach(writer, attachments)
    _add_fields(writer, fields, shown)
    writer.pdf_header = "%PDF-1.7"  # reportlab writes 1.3, which knows no signatures of this kind
    writer.metadata = {"/Title": title, "/Producer": "accept", "/Creator": "accept"}
    writer.root_object[NameObject("/Lang")] = TextStringObject("en")
    writer.root_object[NameObject("/ViewerPreferences")] = _dictionary({"/DisplayDocTitle": BooleanObject(True)})
    out = io.BytesIO()
    writer.write(out)
    return out.getvalue()


def _attach(writer: PdfWriter, attachments: Mapping[str, bytes]) -> None:
    """Embed files, also listed as associated with the document ([ISO32000-2] 14.13)."""
    names, associated = ArrayObject(), ArrayObject()
    for name, content in sorted(attachments.items()):
        reference = _indirect(writer, _file(writer, name, content))
        names.extend([TextStringObject(name), reference])
        associated.append(reference)
    tree = _dictionary({"/EmbeddedFiles": _dictionary({"/Names": names})})
    writer.root_object[NameObject("/Names")] = _indirect(writer, tree)
    writer.root_object[NameObject("/AF")] = associated


def _file(writer: PdfWriter, name: str, content: bytes) -> DictionaryObject:
    stream = StreamObject()
    packed = zlib.compress(content, 1 if len(content) < _SMALL else 6) if _shrinks(content) else content
    smaller = len(packed) < len(content)
    stream.set_data(packed if smaller else content)
    if smaller:
        stream[NameObject("/Filter")] = NameObject("/FlateDecode")
    digest = hashlib.md5(content, usedforsecurity=False).digest()  # the format asks for MD5; nothing relies on it
    size = {"/Size": NumberObject(len(content)), "/CheckSum": ByteStringObject(digest)}
    stream.update({NameObject("/Type"): NameObject("/EmbeddedFile"), NameObject("/Params"): _dictionary(size)})
    reference = _indirect(writer, stream)
    return _dictionary(
        {
            "/Type": NameObject("/Filespec"),
            "/F": TextStringObject(name),
            "/UF": TextStringObject(name),
            "/EF": _dictionary({"/F": reference, "/UF": reference}),
            "/AFRelationship": NameObject("/Data"),
        }
    )


def _shrinks(content: bytes) -> bool:
    """Return whether compression pays. A record that is already compressed would take half a second for nothing."""
    middle = len(content) // 2
    sample = content[middle : middle + _SAMPLE]
    return len(content) <= _SAMPLE or len(zlib.compress(sample, 1)) < 0.95 * len(sample)


def _add_fields(
    writer: PdfWriter, fields: Mapping[str, tuple[float, float, float, float]], shown: bytes | None
) -> None:
    page = writer.pages[0]
    widgets, pages = ArrayObject(), PdfReader(io.BytesIO(shown)).pages if shown is not None else ()
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
        if shown is not None:
            appearance = _indirect(writer, _form(writer, pages[len(widgets)]))
            widget[NameObject("/AP")] = _dictionary({"/N": appearance})
        widgets.append(_indirect(writer, widget))
    page[NameObject("/Annots")] = ArrayObject(widgets)
    form = _dictionary({"/Fields": widgets, "/SigFlags": NumberObject(_SIGNED_FILE)})
    writer.root_object[NameObject("/AcroForm")] = _indirect(writer, form)


def _form(writer: PdfWriter, page: PageObject) -> StreamObject:
    form, content = StreamObject(), page.get_contents()
    form.set_data(b"" if content is None else content.get_data())
    form.update(
        {
            NameObject("/Type"): NameObject("/XObject"),
            NameObject("/Subtype"): NameObject("/Form"),
            NameObject("/BBox"): ArrayObject([FloatObject(f"{v:.3f}") for v in page.mediabox]),
            NameObject("/Resources"): page["/Resources"].clone(writer),
        }
    )
    return form


def _indirect(writer: PdfWriter, what: PdfObject) -> IndirectObject:
    return writer._add_object(what)  # noqa: SLF001 - pypdf has no public name for it


def _dictionary(entries: Mapping[str, Any]) -> DictionaryObject:
    return DictionaryObject({NameObject(key): value for key, value in entries.items()})
