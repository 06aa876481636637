"""Every statement of a certificate, each declared once: how it is checked, and the row of the page that shows it.

A statement is derived again from the attached bytes, or carries a signature that is verified, or is looked up in the
bench's store or its published list. A field that is not declared is refused. Those of the provenance are declared with
their types in `provenance.py`. The rows below the verdict, the lines of `accept verify` and the table in
docs/explanation/what-a-certificate-proves.md follow from these declarations.
"""

from collections.abc import Callable
from dataclasses import replace

from accept.base.atomic_files import UNIT_FILE
from accept.certificate.contents import words
from accept.certificate.contents.content import MANIFEST, PANELS, RESULTS, SPEC, CertificateContent
from accept.certificate.contents.provenance import (
    DERIVED,
    DERIVED_AND_SIGNED,
    LOOKED_UP,
    PROVENANCE,
    SIGNED_AND_LOOKED_UP,
    Statement,
    Way,
)
from accept.store.payloads import without_hashes

PAGE = "the page"
_DERIVED_AND_LOOKED_UP, _STATED = (Way.DERIVED, Way.LOOKED_UP), (Way.STATED,)


def _of(document: str, *rows: tuple[str, tuple[Way, ...], str, str]) -> tuple[Statement, ...]:
    return tuple(Statement(ways, how, row, document=document, field=field) for field, ways, how, row in rows)


STATEMENTS = (
    *_of(
        MANIFEST,
        ("format", DERIVED, "the format that the program of the stated code writes", ""),
        ("serial", DERIVED, "results.json, and unit.toml", ""),
        ("record_sha256", DERIVED, "hash of the attached results.json", ""),
        ("accept", DERIVED, "hash of the program that verifies; another one is never plainly valid", ""),
        ("drawn_with", DERIVED, "the page, which other libraries would draw otherwise", ""),
        ("spec", DERIVED, "name, title and hash of the attached spec.toml", "Spec"),
        ("operator", SIGNED_AND_LOOKED_UP, "the technician's signature; who judged, in the store", "Operator"),
        ("instruments", DERIVED, "the attached spec.toml", "Instruments"),
        ("statement", DERIVED, "the words that this program uses", ""),
        ("inputs", DERIVED, "names in unit.toml; hash and size of each file; what is absent is too large", "Record"),
        ("models", DERIVED, "the attached model files, named by the spec", "Models"),
    ),
    *(replace(each, document=MANIFEST) for each in PROVENANCE),
    *_of(
        RESULTS,
        ("serial", DERIVED, "unit.toml", ""),
        ("kind", DERIVED, "unit.toml", ""),
        ("verdict", DERIVED, "the findings, and judging again", ""),
        ("findings", DERIVED, "judging again from the attached records; limits and rules of the spec", ""),
        ("information", DERIVED, "judging again", ""),
        ("not_judged", DERIVED, "judging again", ""),
        ("notes", DERIVED, "judging again", ""),
        ("parts", DERIVED, "unit.toml", "Parts"),
        ("inputs", DERIVED, "the manifest, and hashes of the attached files", ""),
        ("models", DERIVED, "hashes of the attached model files", ""),
        ("samples", DERIVED, "the attached records", ""),
        ("calibration", _DERIVED_AND_LOOKED_UP, "problems from its own dates; the rest in the store", "Calibration"),
        ("copies", SIGNED_AND_LOOKED_UP, "the same samples in the store; signature of a decision", "Copies"),
        ("measured", DERIVED, "unit.toml", "Measured"),
        ("origin", DERIVED, "unit.toml", "Item"),
        ("environment", DERIVED, "unit.toml", "Environment"),
        ("provided", DERIVED, "unit.toml", "Provided"),
        ("simulated", DERIVED, "unit.toml; never plainly valid", ""),
        ("nonconformances", _DERIVED_AND_LOOKED_UP, "notes in unit.toml; what the store has open, else exit 4", "Held"),
        ("superseded", LOOKED_UP, "the unit's judgements before; without store and list exit 4", ""),
        ("dispositions", SIGNED_AND_LOOKED_UP,
         "signature of quality assurance; what the store has, else exit 4", "Decided"),
        ("folder", LOOKED_UP,
         "the stored judgement; a name or a serial like that of another weakens the verdict", "Folder"),
        ("part_doubts", LOOKED_UP, "the parts' judgements in the store; without store and list exit 4", ""),
        ("rereadings", LOOKED_UP, "judgements of the same samples in the store; without store and list exit 4", ""),
        ("action", DERIVED, "the causes of its findings", ""),
        ("gap", _DERIVED_AND_LOOKED_UP,
         "words of the library, else exit 4 without store and list; numbers in the stored judgement", ""),
    ),
    *_of(
        UNIT_FILE,
        ("measured_by", _STATED, "nothing: names are typed", "Operator"),
        ("read_with", _STATED, "nothing: the values stand beside it", "Entered"),
    ),
    *_of(PANELS, ("", DERIVED,
         "pictures of the attached records; of those of the gap workflow, their names and words", "")),
    *_of(SPEC, ("", DERIVED_AND_SIGNED, "its hash, under the approval", "")),
    *_of(PAGE, ("", DERIVED, "drawn again from the attachments: the same to the byte", "")),
)  # fmt: skip

ROWS: dict[str, Callable[[CertificateContent], str]] = {  # in the order of page and `accept verify`
    "Held": lambda contents: "; ".join(map(without_hashes, contents.result.get("nonconformances", ()))),
    "Laboratory": words.laboratory_words,
    "Number": lambda contents: contents.stated.number,
    "Customer": words.customer_words,
    "Methods": words.methods_words,
    "Sampling": lambda contents: contents.stated.laboratory.sampling if contents.stated.laboratory else "",
    "Spec": words.spec_words,
    "Models": words.models_words,
    "Attempt": words.attempt_words,
    "Amended": words.amended_words,
    "Signed": words.signed_words,
    "Changed": words.changes_words,
    "Calibration": words.calibration_words,
    "Folder": words.folder_words,
    "Copies": words.copies_words,
    "Store": lambda contents: (
        words.NOT_STATED if (head := contents.stated.head) is None else f"event {head.seq}, {head.hash}"
    ),
    "Bench": words.bench_words,
} | {each.row: each.words for each in STATEMENTS if each.words is not None}  # fmt: skip


def statements(contents: CertificateContent) -> dict[str, str]:
    """Return name -> sentence, in the order in which page and `accept verify` show them."""
    return {name: sentence(contents) for name, sentence in ROWS.items()}


def statement_of(document: str, path: str) -> Statement | None:
    """Return the declaration of a field, given by its keys joined by dots; None for an unknown field."""
    rows = (s for s in STATEMENTS if s.document == document)
    return next((s for s in rows if not s.field or path == s.field or path.startswith(f"{s.field}.")), None)


def table() -> str:
    """Return the table in Markdown, as docs/explanation/what-a-certificate-proves.md has it."""
    rows = ((s.document, s.field or "all of it", ", ".join(s.ways), s.how, s.row or "-") for s in STATEMENTS)
    head = (("where", "statement", "way", "compared with", "row of the page"), ("---",) * 5)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (*head, *rows))
