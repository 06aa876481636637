"""Puts the parts of a certificate together: pages, attachments, empty signature fields."""

import hashlib
import zlib
from collections.abc import Mapping

from accept.pictures.pdf.pdf_objects import PdfObjects, array, decimal, dictionary, text

_SAMPLE = 100_000  # bytes that tell whether the rest can be compressed
_PRINTED = b"4"  # annotation flag: print it
_SIGNED_FILE = b"3"  # SigFlags: there are signatures, only append to this file


def assemble(
    pages: bytes,
    attachments: Mapping[str, bytes],
    fields: Mapping[str, tuple[float, float, float, float]],
    title: str,
) -> bytes:
    """Return one PDF of all parts. The same parts give the same bytes: no date, no random identifier.

    pages: a file that reportlab wrote."""
    file = PdfObjects(pages)
    _attach(file, attachments)
    _add_fields(file, fields)
    file.root[b"/Lang"] = text("en")
    file.root[b"/ViewerPreferences"] = dictionary({b"/DisplayDocTitle": b"true"})
    return file.written({b"/Title": text(title), b"/Producer": text("accept"), b"/Creator": text("accept")})


def _attach(file: PdfObjects, attachments: Mapping[str, bytes]) -> None:
    """Embed files, also listed as associated with the document ([ISO32000-2] 14.13)."""
    embedded = {name: _embedded(file, name, content) for name, content in sorted(attachments.items())}
    names = array(part for name, reference in embedded.items() for part in (text(name), reference))
    file.root[b"/Names"] = file.add({b"/EmbeddedFiles": dictionary({b"/Names": names})})
    file.root[b"/AF"] = array(embedded.values())


def _embedded(file: PdfObjects, name: str, content: bytes) -> bytes:
    """Embed one file, and return the reference to it."""
    packed = zlib.compress(content, 6) if _shrinks(content) else content
    smaller = len(packed) < len(content)
    digest = hashlib.md5(content, usedforsecurity=False).hexdigest()  # the format asks for MD5; nothing relies on it
    size = dictionary({b"/Size": b"%d" % len(content), b"/CheckSum": b"<%s>" % digest.encode()})
    how = {b"/Filter": b"/FlateDecode"} if smaller else {}
    stream = file.add(how | {b"/Type": b"/EmbeddedFile", b"/Params": size}, packed if smaller else content)
    return file.add(
        {
            b"/Type": b"/Filespec",
            b"/F": text(name),
            b"/UF": text(name),
            b"/EF": dictionary({b"/F": stream, b"/UF": stream}),
            b"/AFRelationship": b"/Data",
        }
    )


def _shrinks(content: bytes) -> bool:
    """Return whether compressing pays: a record that is compressed in itself takes half a second and gives nothing."""
    middle = len(content) // 2
    sample = content[middle : middle + _SAMPLE]
    return len(content) <= _SAMPLE or len(zlib.compress(sample, 1)) < 0.95 * len(sample)


def _add_fields(file: PdfObjects, fields: Mapping[str, tuple[float, float, float, float]]) -> None:
    """Add empty, visible signature fields on the first page."""
    page = file.first_page
    widgets = array(
        [
            file.add(
                {
                    b"/Type": b"/Annot",
                    b"/Subtype": b"/Widget",
                    b"/FT": b"/Sig",
                    b"/T": text(name),
                    b"/Rect": array(decimal(round(v, 3)) for v in rectangle),
                    b"/F": _PRINTED,
                    b"/P": page,
                }
            )
            for name, rectangle in fields.items()
        ]
    )
    file.entries(page)[b"/Annots"] = widgets
    file.root[b"/AcroForm"] = file.add({b"/Fields": widgets, b"/SigFlags": _SIGNED_FILE})
