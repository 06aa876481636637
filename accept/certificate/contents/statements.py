"""Every statement of a certificate, each declared once: how it is checked, and the row of the page that shows it.

A statement is derived again from the attached bytes, or carries a signature that is verified, or is looked up in the
bench's store or its published list. A field that is not declared is refused. Those of the provenance are declared with
their types in `provenance.py`. The rows below the verdict, the lines of `accept verify` and the table in
docs/explanation/what-a-certificate-proves.md follow from these declarations.
"""

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from cryptography import x509
from cryptography.x509.oid import NameOID

from accept.base.documents.manifest import ModelFiles, hashes
from accept.base.documents.results import ALIKE, CONFIRMED, NAME
from accept.certificate.contents.content import MANIFEST, PANELS, RESULTS, SPEC, CertificateContent
from accept.certificate.contents.provenance import (
    DERIVED,
    DERIVED_AND_SIGNED,
    LOOKED_UP,
    PROVENANCE,
    SIGNED_AND_LOOKED_UP,
    Provenance,
    Statement,
    Way,
)
from accept.pictures.labels import label_of
from accept.store.payloads import without_hashes
from checks.rounding import with_U
from checks.verdict import UnitVerdict
from specs.files import UNIT_FILE

NOT_STATED = "not stated"
SIGNIFICANT = 1.0  # of both U together: the two results disagree ([ISO13528] 9.7, E_n)


def laboratory_words(contents: CertificateContent) -> str:
    """Return name, address, contact, place of measuring and accreditation in one line ([ISO17025] 7.8.2.1 b, c)."""
    if (stated := contents.stated.laboratory) is None:
        return ""
    site = f"measured at {stated.site}" if stated.site else ""
    return "; ".join(part for part in (stated.name, stated.address, stated.contact, site, stated.accreditation) if part)


def customer_words(contents: CertificateContent) -> str:
    """Return the customer of the laboratory with the contact ([ISO17025] 7.8.2.1 e), unless the unit states its own."""
    laboratory = contents.stated.laboratory
    if laboratory is None or (contents.result.get("origin") or {}).get("customer"):
        return ""
    return "; ".join(part for part in (laboratory.customer, laboratory.customer_contact) if part)


def methods_words(contents: CertificateContent) -> str:
    """Return the methods with the checks that are measured by each ([ISO17025] 7.8.2.1 f)."""
    by: dict[str, list[str]] = {}
    laboratory = contents.stated.laboratory
    for check, method in sorted(laboratory.methods.items() if laboratory else ()):  # an attachment has them in order
        by.setdefault(method, []).append(check)
    return "; ".join(f"{method} ({', '.join(checks)})" for method, checks in by.items())


def changes_words(contents: CertificateContent) -> str:
    """Return which quantities differ from the judgement that is replaced by more than both uncertainties explain."""
    before, out = contents.stated.before or {}, []
    for finding in contents.result["findings"]:
        was = before.get(finding["quantity"])
        if was is None or finding["value"] is None or finding["U"] is None:
            continue
        U = math.hypot(was.U, finding["U"])
        change = finding["value"] - was.value
        if abs(change) > SIGNIFICANT * U:
            unit = "" if finding["unit"] == "1" else f" {finding['unit']}"
            now, then = with_U(finding["value"], finding["U"]), with_U(was.value, was.U)
            out.append(f"{label_of(finding['quantity'])} from {then} to {now}{unit}, more than both U explain")
    return "; ".join(out)


def spec_words(contents: CertificateContent) -> str:
    """Return name and hash of the spec, and who approved it."""
    named, approval = f"{contents.spec_name}, sha256 {contents.spec_sha256}", contents.stated.approval
    if approval is None:
        return named
    if approval.get("builtin"):
        return f"{named}; comes with the program"
    if approval.get("person"):
        return f"{named}; approved by {approval['person']} on {str(approval.get('time', ''))[:10]}"
    return f"{named}; NOT APPROVED{': ' + str(approval['reason']) if approval.get('reason') else ''}"


def models_words(models: Mapping[str, ModelFiles]) -> str:
    """Return the model files, and the bench and the units that one of them was learned from."""
    named = [f"{n} ({f} {digest[:12]})" for n, files in hashes(models).items() for f, digest in files.items()]
    learned = (_learned(name, content) for files in models.values() for name, content in files.items())
    return "; ".join([*named, *(words for words in learned if words)])


def _learned(name: str, content: bytes) -> str:
    if not name.endswith(".toml"):
        return ""
    try:
        model = tomllib.loads(content.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError):
        return ""
    bench, batch = model.get("learned_bench"), model.get("population")
    learned = bench if isinstance(bench, Mapping) else batch
    if not isinstance(learned, Mapping):
        return ""
    units = [str(serial) for serial in learned.get("units", [])]
    day = f" on {learned['learned_on']}" if learned.get("learned_on") else ""
    how = "compared on a bench learned" if learned is bench else "learned"
    return f"{how}{day} from {len(units)} units: {', '.join(units)}"


def attempt_words(contents: CertificateContent) -> str:
    """Return number and day of the attempt, what it replaces, and how the attempts before ended."""
    stated = contents.stated
    if not stated.attempt:
        return NOT_STATED
    reason = None if stated.amends else stated.reason  # of an amended one it is in that row
    why = "" if reason is None else f"; reason: {reason}" if reason else "; no reason was given"
    number = f"{stated.attempt}{f', judged on {stated.judged[:10]}' if stated.judged else ''}"
    earlier, before = _earlier(stated), stated.replaces
    if before is None:
        return f"{number}{earlier}{why}"
    certificate = f", certificate sha256 {before.certificate[:12]}" if before.certificate else ""
    if before.earlier_certificate:
        digest, of = before.earlier_certificate[:12], before.earlier_attempt
        certificate = f", which had no certificate, and certificate sha256 {digest} of attempt {of}"
    when = before.time[:19].replace("T", " ")
    return f"{number}, replaces '{before.verdict}' of {when} UTC{certificate}{earlier}{why}"


def _earlier(stated: Provenance) -> str:
    if stated.earlier is None:
        return "; how the attempts before ended is not stated" if stated.replaces else ""
    counts = ", ".join(f"{count} {verdict}" for verdict, count in sorted(stated.earlier.verdicts.items()))
    if (last := stated.earlier.not_accepted) is None:
        return f"; before: {counts}"
    return f"; before: {counts}; last not accepted: attempt {last.attempt}, {last.verdict} on {last.time[:10]}"


def amended_words(contents: CertificateContent) -> str:
    """Return which certificate with another result this one replaces, and why ([ISO17025] 7.8.8.3)."""
    stated = contents.stated
    why = stated.reason or stated.signed_because or "no reason was given"
    return f"replaces certificate {stated.amends}: {why}" if stated.amends else ""


def signed_words(contents: CertificateContent) -> str:
    """Return why the technician signed a unit that is not accepted, "" if no reason is stated."""
    reason, verdict = contents.stated.signed_because, contents.result["verdict"]
    return f"by {contents.operator} although {verdict}: {reason}" if reason and verdict != UnitVerdict.ACCEPTED else ""


def calibration_words(contents: CertificateContent) -> str:
    """Return the bench file, and how many of its instruments have a valid calibration."""
    if (given := contents.result.get("calibration")) is None:
        return NOT_STATED
    wrong = [row["problem"] for row in given["instruments"] if row.get("problem")]
    state = f"{len(wrong)} not valid" if wrong else "all valid"
    return f"bench file {given['bench']} of {given['on']}: {len(given['instruments'])} instruments, {state}"


def folder_words(contents: CertificateContent) -> str:
    """Return a name of the folder that is another serial, and a serial that looks like another."""
    given = contents.result.get("folder") or {}
    confirmation = (
        f"the serial was confirmed by {given[CONFIRMED]}" if CONFIRMED in given else "the serial was not confirmed"
    )
    named = [f"called {given[NAME]}, which is another serial; {confirmation}"] if NAME in given else []
    alike = [f"the serial looks like {given[ALIKE]}, and was not confirmed"] if ALIKE in given else []
    return "; ".join(named + alike)


def copies_words(contents: CertificateContent) -> str:
    """Return the recordings that are filed elsewhere too."""
    return "; ".join(map(_one_copy, contents.result.get("copies") or []))


def _one_copy(copy: Mapping[str, Any]) -> str:
    others = ", ".join(f"{w['serial']} {w['sample']}" for w in copy["with"])
    same = f"{copy['sample']} holds the samples of {others}"
    decision = copy.get("resolved")
    if decision is None:
        return f"{same}: without a result until quality assurance decides where it belongs"
    whose = ", ".join(f"{serial} {sample}" for serial, sample in decision["measured"])
    day = str(decision["time"])[:10]
    return f"{same}: measured at {whose}, decided by {decision['who']} on {day}: {decision['reason']}"


def bench_words(contents: CertificateContent) -> str:
    """Return the name in the bench's certificate, and that the authority's key lies there if it does."""
    stated = contents.stated
    if not stated.bench:
        return "" if stated.demo else "without a certificate of the authority"
    certificate = x509.load_pem_x509_certificate(stated.bench.encode("ascii"))
    name = str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)
    return f"{name}; the authority's key lies at this bench" if stated.authority else name


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
    "Laboratory": laboratory_words,
    "Number": lambda contents: contents.stated.number,
    "Customer": customer_words,
    "Methods": methods_words,
    "Sampling": lambda contents: contents.stated.laboratory.sampling if contents.stated.laboratory else "",
    "Spec": spec_words,
    "Models": lambda contents: models_words(contents.models),
    "Attempt": attempt_words,
    "Amended": amended_words,
    "Signed": signed_words,
    "Changed": changes_words,
    "Calibration": calibration_words,
    "Folder": folder_words,
    "Copies": copies_words,
    "Store": lambda contents: (
        NOT_STATED if (head := contents.stated.head) is None else f"event {head.seq}, {head.hash}"
    ),
    "Bench": bench_words,
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
