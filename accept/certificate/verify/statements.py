"""Every statement of a certificate and how it is checked: a statement that can be looked up is not taken on trust.

A statement is derived again from the attached bytes, or carries a signature that is verified, or is looked up in the
bench's store or its published list. A field that is not in this table is refused (`unlisted`).
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from accept.base.version import code_sha256
from accept.certificate.contents.content import MANIFEST, PANELS, RESULTS, SPEC, CertificateContent
from accept.certificate.contents.step import Step
from accept.certificate.verify.gap_check import own_words
from accept.judging.nonconformance import in_notes
from accept.units.unit_folder import UNIT_FILE, UnitFolder

PAGE = "the page"


class Way(StrEnum):
    """The way in which a statement is checked."""

    DERIVED = "derived"  # again from the attached bytes
    SIGNED = "signed"  # it carries a signature of its own
    LOOKED_UP = "looked up"  # in the bench's store or its published list; without them it is the signers' word
    STATED = "stated"  # by the unit's folder alone: always the signers' word


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
_SIGNED_AND_LOOKED_UP = (Way.SIGNED, Way.LOOKED_UP)

STATEMENTS = (
    *_rows(
        MANIFEST,
        ("format", _DERIVED, "the format that the program of the stated code writes"),
        ("serial", _DERIVED, "results.json, and unit.toml"),
        ("record_sha256", _DERIVED, "hash of the attached results.json"),
        ("accept", _DERIVED, "hash of the program that verifies; another one is never plainly valid"),
        ("drawn_with", _DERIVED, "the page, which other libraries would draw otherwise"),
        ("spec", _DERIVED, "name, title and hash of the attached spec.toml"),
        ("operator", _SIGNED_AND_LOOKED_UP, "the technician's signature; who judged, in the store"),
        ("instruments", _DERIVED, "the attached spec.toml"),
        ("statement", _DERIVED, "the words that this program uses"),
        ("inputs", _DERIVED, "names in unit.toml; hash and size of each file; what is absent is too large"),
        ("models", _DERIVED, "the attached model files, named by the spec"),
        ("provenance.attempt", _LOOKED_UP, "number of the unit's judgements"),
        ("provenance.replaces", _LOOKED_UP, "judgement and certificate before, also in a list; signed later than that"),
        ("provenance.earlier", _LOOKED_UP, "how its judgements ended; in a list, how many they are and when"),
        ("provenance.amends", _LOOKED_UP, "number and result of the certificate before"),
        ("provenance.judged", _LOOKED_UP, "time of the judgement, also in a list"),
        ("provenance.before", _LOOKED_UP, "values of the judgement that is replaced, in the store"),
        ("provenance.reason", _SIGNED_AND_LOOKED_UP, "the bench's key; the stored judgement"),
        ("provenance.signed_because", _SIGNED_AND_LOOKED_UP, "the bench's key; the stored signature"),
        ("provenance.laboratory", _SIGNED_AND_LOOKED_UP, "the bench's key; laboratory.toml as the store has it"),
        ("provenance.number", _SIGNED_AND_LOOKED_UP, "the bench's key; its scheme in the store, where it stands once"),
        ("provenance.approval", (Way.DERIVED, Way.SIGNED), "the program's own; a QA key's, of spec and models"),
        ("provenance.head", _SIGNED_AND_LOOKED_UP, "signature of the bench; that event in its store"),
        ("provenance.bench", _SIGNED, "certificate of the authority; its key signs head and provenance"),
        ("provenance.authority", _SIGNED_AND_LOOKED_UP, "the bench's key; in the store, as that day"),
        ("provenance.signature", _SIGNED, "the bench's key, over the serial and all of the provenance"),
        ("provenance.crl", _SIGNED_AND_LOOKED_UP, "signature of the authority; its hash in the store"),
        ("provenance.demo", _DERIVED, "the kind of authority that signed"),
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
        ("provided", _DERIVED, "unit.toml"),
        ("simulated", _DERIVED, "unit.toml; never plainly valid"),
        ("nonconformances", (Way.DERIVED, Way.LOOKED_UP), "notes in unit.toml; what the store has open, else exit 4"),
        ("superseded", _LOOKED_UP, "the unit's judgements before; without store and list exit 4"),
        ("dispositions", _SIGNED_AND_LOOKED_UP, "signature of quality assurance; what the store has, else exit 4"),
        ("folder", _LOOKED_UP, "the stored judgement; a name or a serial like that of another weakens the verdict"),
        ("part_doubts", _LOOKED_UP, "the parts' judgements in the store; without store and list exit 4"),
        ("rereadings", _LOOKED_UP, "judgements of the same samples in the store; without store and list exit 4"),
        ("action", _DERIVED, "the causes of its findings"),
        (
            "gap",
            (Way.DERIVED, Way.LOOKED_UP),
            "words of the library, else exit 4 without store and list; numbers in the stored judgement",
        ),
    ),
    *_rows(
        UNIT_FILE,
        ("measured_by", (Way.STATED,), "nothing: names are typed"),
        ("read_with", (Way.STATED,), "nothing: the values stand beside it"),
    ),
    *_rows(
        PANELS,
        ("", _DERIVED, "pictures of the attached records; of those of the gap workflow, their names and words"),
    ),
    *_rows(SPEC, ("", (Way.DERIVED, Way.SIGNED), "its hash, under the approval")),
    *_rows(PAGE, ("", _DERIVED, "drawn again from the attachments: the same to the byte")),
)  # fmt: skip


LOOKED_UP = tuple(s.field for s in STATEMENTS if Way.LOOKED_UP in s.ways)
OF_THE_RESULT = tuple(s.field for s in STATEMENTS if Way.LOOKED_UP in s.ways and s.document == RESULTS)


def taken_on_trust(contents: CertificateContent, looked_up: Collection[str]) -> Step:
    """Name the fields that are stated and that only a store or a list shows, or nothing at all, without those that were
    looked up: they are the word of bench and technician, who signed them."""
    stated = {*_fields(contents.manifest()), *(key for key, value in contents.result.items() if value)}
    stated |= set(contents.unit_file)
    rows = (s for s in STATEMENTS if {Way.LOOKED_UP, Way.STATED} & {*s.ways} and s.field != "operator")
    trusted = [s.field for s in rows if s.field in stated and s.field not in looked_up]
    return Step(f"not looked up, the word of bench and technician: {', '.join(trusted)}" if trusted else "")


def words_on_trust(contents: CertificateContent, unit: UnitFolder, looked_up: Collection[str]) -> Step:
    """Check the sentences of the result that this program writes and that do not follow from the attachments: not
    complete if neither a store nor a list has them, for they could say anything."""
    if contents.code_sha256 != code_sha256():
        return Step("")  # it is never plainly valid
    result = contents.result
    found = [field for field in own_words(contents) if "gap" not in looked_up]
    found += [field for field in ("part_doubts", "rereadings") if result.get(field) and field not in looked_up]
    if any(given.get("certificate") for given in result.get("dispositions", ())) and "dispositions" not in looked_up:
        found.append("dispositions")  # signed about a certificate: what that stated does not follow
    if set(result.get("nonconformances", ())) - set(in_notes(unit.notes)) and "nonconformances" not in looked_up:
        found.append("nonconformances")
    words = "neither the store of its bench nor a list was asked for the words of"
    return Step(f"{words} {', '.join(f'{RESULTS} {field}' for field in found)}", complete=False) if found else Step("")


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
