"""Every statement of a certificate and how it is checked: a statement that can be looked up is not taken on trust.

A statement is derived again from the attached bytes, or carries a signature that is verified, or is looked up in the
bench's store or its published list. A field that is not in this table is refused (`unlisted`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from accept.certificate.contents.content import MANIFEST, PANELS, RESULTS, SPEC, CertificateContent

PAGE = "the page"


class Way(StrEnum):
    """The way in which a statement is checked."""

    DERIVED = "derived"  # again from the attached bytes
    SIGNED = "signed"  # it carries a signature of its own
    LOOKED_UP = "looked up"  # in the bench's store or its published list; without them it is the signers' word


@dataclass(frozen=True)
class Statement:
    """One statement. document: that holds it; field: its key, with all below it; how: the source that it is compared
    with."""

    document: str
    field: str
    ways: tuple[Way, ...]
    how: str


def _rows(document: str, *rows: tuple[str, tuple[Way, ...], str]) -> tuple[Statement, ...]:
    return tuple(Statement(document, field, ways, how) for field, ways, how in rows)


_DERIVED, _SIGNED, _LOOKED_UP = (Way.DERIVED,), (Way.SIGNED,), (Way.LOOKED_UP,)

STATEMENTS = (
    *_rows(
        MANIFEST,
        ("format", _DERIVED, "the format that the program of the stated code writes"),
        ("serial", _DERIVED, "results.json, and unit.toml"),
        ("record_sha256", _DERIVED, "hash of the attached results.json"),
        ("accept", _DERIVED, "hash of the program that verifies; another one is never plainly valid"),
        ("drawn_with", _DERIVED, "the page, which other libraries would draw otherwise"),
        ("spec", _DERIVED, "name, title and hash of the attached spec.toml"),
        ("operator", (Way.SIGNED, Way.LOOKED_UP), "the technician's signature; who judged, in the store"),
        ("instruments", _DERIVED, "the attached spec.toml"),
        ("statement", _DERIVED, "the words that this program uses"),
        ("inputs", _DERIVED, "names in unit.toml; hash and size of each file; what is absent is too large"),
        ("models", _DERIVED, "the attached model files, named by the spec"),
        ("provenance.attempt", _LOOKED_UP, "number of the unit's judgements"),
        ("provenance.replaces", _LOOKED_UP, "judgement and certificate before, also in a list; signed later than that"),
        ("provenance.before", _LOOKED_UP, "values of the judgement that is replaced, in the store"),
        ("provenance.laboratory", _SIGNED, "the bench's key; it is the bench's laboratory.toml of that day"),
        ("provenance.number", (Way.SIGNED, Way.LOOKED_UP), "the bench's key; in the store, once"),
        ("provenance.approval", (Way.DERIVED, Way.SIGNED), "the program's own; a QA key's, of spec and models"),
        ("provenance.head", (Way.SIGNED, Way.LOOKED_UP), "signature of the bench; that event in its store"),
        ("provenance.bench", _SIGNED, "certificate of the authority; its key signs head and provenance"),
        ("provenance.authority", (Way.SIGNED, Way.LOOKED_UP), "signature of the bench; whether the key lies there"),
        ("provenance.signature", _SIGNED, "the bench's key, over the serial and all of the provenance"),
        ("provenance.crl", _SIGNED, "signature of the authority"),
        ("provenance.demo", _DERIVED, "the kind of authority"),
    ),
    *_rows(
        RESULTS,
        ("serial", _DERIVED, "unit.toml"),
        ("kind", _DERIVED, "unit.toml"),
        ("verdict", _DERIVED, "the findings, and judging again"),
        ("findings", _DERIVED, "judging again from the attached records; limits and rules of the spec"),
        ("information", _DERIVED, "judging again"),
        ("not_judged", _DERIVED, "judging again"),
        ("notes", _DERIVED, "judging again"),
        ("parts", _DERIVED, "unit.toml"),
        ("inputs", _DERIVED, "the manifest, and hashes of the attached files"),
        ("models", _DERIVED, "hashes of the attached model files"),
        ("samples", _DERIVED, "the attached records"),
        ("calibration", (Way.DERIVED, Way.LOOKED_UP), "problems from its own dates; the rest in the store"),
        ("copies", (Way.SIGNED, Way.LOOKED_UP), "the same samples in the store; signature of a decision"),
        ("measured", _DERIVED, "unit.toml"),
        ("origin", _DERIVED, "unit.toml"),
        ("environment", _DERIVED, "unit.toml"),
        ("nonconformances", (Way.DERIVED, Way.LOOKED_UP), "notes in unit.toml; what the store has open"),
        ("folder", _LOOKED_UP, "the stored judgement; a name that is another serial weakens the verdict"),
        ("part_doubts", _LOOKED_UP, "the parts' judgements in the store"),
        ("action", _DERIVED, "the causes of its findings"),
        (
            "gap",
            (Way.DERIVED, Way.LOOKED_UP),
            "its sentences are the library's; the rest in the stored judgement; no verdict depends on it",
        ),
    ),
    *_rows(
        PANELS,
        ("", _DERIVED, "pictures of the attached records; of those of the gap workflow, their names and words"),
    ),
    *_rows(SPEC, ("", (Way.DERIVED, Way.SIGNED), "its hash, under the approval")),
    *_rows(PAGE, ("", _DERIVED, "drawn again from the attachments: the same to the byte")),
)  # fmt: skip


def statement_of(document: str, path: str) -> Statement | None:
    """Return the row for a field, given by its keys joined by dots; None if the table has no such row."""
    rows = (s for s in STATEMENTS if s.document == document)
    return next((s for s in rows if not s.field or path == s.field or path.startswith(f"{s.field}.")), None)


def unlisted(contents: CertificateContent) -> list[str]:
    """Return the fields of manifest and result that are not in the table."""
    documents = {MANIFEST: contents.manifest(), RESULTS: contents.result}
    return [
        f"{document}: {path}"
        for document, content in documents.items()
        for path in _fields(content)
        if statement_of(document, path) is None
    ]


def table() -> str:
    """Return the table in Markdown, as docs/explanation/what-a-certificate-proves.md has it."""
    rows = (f"| {s.document} | {s.field or 'all of it'} | {', '.join(s.ways)} | {s.how} |" for s in STATEMENTS)
    return "\n".join(["| where | statement | way | compared with |", "|---|---|---|---|", *rows])


def _fields(content: Mapping[str, Any]) -> Iterator[str]:
    for key, value in content.items():
        if key == "provenance" and isinstance(value, Mapping):
            yield from (f"{key}.{name}" for name in value)
        else:
            yield str(key)
