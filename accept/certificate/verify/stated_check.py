"""Comparison of the statements beside a certificate's result with the attached spec, the signatures, its own times
and the bench that made it: certified by the authority, or unknown.

`accept.certificate.contents.statements` lists every statement and how it is checked.
"""

from collections.abc import Mapping, Sequence
from datetime import date, datetime, timedelta
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base import version
from accept.base.documents.results import ALIKE, CONFIRMED, NAME, TYPED
from accept.base.names import same_person
from accept.base.spelling import serial_problem
from accept.certificate.contents.content import BEFORE, FORMAT, STATEMENT, CertificateContent, hashes_of, signed_text
from accept.certificate.contents.outcome import InvalidCertificate, Step
from accept.certificate.contents.provenance import AT_THE_BENCH, PROVENANCE, Provenance, needs_reason
from accept.certificate.trust import authority
from accept.certificate.trust.authority import BENCH, public_of
from accept.certificate.trust.commissioned import is_proven
from accept.certificate.trust.revocation import Revoked
from accept.certificate.verify.ports import Ports
from accept.certificate.verify.signatures import Signed
from accept.certificate.verify.statements import unlisted
from accept.store.decisions import DISPOSITION, decision_problem, recording_party, signed_content
from accept.store.payloads import CopiesResolved, NonconformanceDecided, SignedBy
from checks.acceptance import CHECKS
from specs.spec import parse
from specs.strict import SpecError

STORED_WITHIN = timedelta(minutes=5)  # a decision is stored after it was signed, when the store is free
SAME_SECOND = timedelta(seconds=2)  # a signature states whole seconds, the store microseconds
LONGEST_RUN = timedelta(days=7)  # of a program, from the day whose calibrations it states to a signature


def check_stated(contents: CertificateContent, signatures: Sequence[Signed], demo: bool, ports: Ports) -> list[Step]:
    """Compare spec, operator, statement and provenance with their sources.

    A demonstration signs for every operator. Raises InvalidCertificate if a statement is wrong; a step is not complete
    if another program made the certificate or a statement is absent."""
    _check_spec(contents)
    technician = None if demo else signatures[0].person
    own = contents.code_sha256 == version.code_sha256()
    same = contents.operator == technician if own else same_person(contents.operator, technician or "")
    if technician and contents.format > BEFORE and not same:
        raise InvalidCertificate(f"the operator is {contents.operator}, but {technician} signed as technician")
    given = contents.stated
    if given.head is not None and (problem := ports.head_problem(vars(given.head))):
        raise InvalidCertificate(f"the stated head of its store does not hold: {problem}")
    waits = needs_reason(contents.result["verdict"], given.replaces.verdict if given.replaces else None)
    if given.amends and waits and not (given.reason or given.signed_because):
        raise InvalidCertificate("it replaces the certificate of an accepted unit and does not say why")
    if own and contents.format != FORMAT:
        raise InvalidCertificate(f"it states format {contents.format}, but this program writes format {FORMAT}")
    if own and contents.accept_version != version.program():
        raise InvalidCertificate(f"it states version {contents.accept_version} of this program, {version.program()}")
    if own and contents.statement != STATEMENT:
        raise InvalidCertificate("the page says of the verdicts what this program does not say")
    if unknown := unlisted(contents) if own else []:
        raise InvalidCertificate(f"{unknown[0]} is stated, which this program does not write")
    if own and given.demo != demo:
        raise InvalidCertificate("provenance.demo is not the kind of authority that signed")
    steps = [] if own else [_other_program(contents)]
    if own and not demo and "head" in contents.provenance and given.head is None:
        steps.append(Step("it states no head of its bench's store (provenance.head)", complete=False))
    due = [each.name for each in PROVENANCE if (each.due(given, own) if callable(each.due) else each.due)]
    if absent := [name for name in due if name not in contents.provenance]:
        steps.append(Step(f"it does not state: {', '.join(absent)}", complete=False))
    return [*steps, *_check_folder(contents), *_times(given, signatures[0].when), *_days(contents, signatures[0].when)]


def check_copies(
    contents: CertificateContent, roots: Sequence[x509.Certificate], revoked: Sequence[Revoked]
) -> list[Step]:
    """Check what is stated of recordings that are filed elsewhere too: that the unit has such a recording, that the
    others are named as records are, and that quality assurance signed the decision where each belongs. Page and
    `accept verify` name her, so a decision is checked also if the recording does not count."""
    words = "is filed elsewhere too, and the decision where it belongs does not count"
    steps = []
    for copy in contents.result.get("copies") or ():
        if problem := _copy_problem(copy, contents):
            steps.append(Step(f"a recording is said to be filed elsewhere too: {problem}", complete=False))
        elif (copy.get("resolved") or not copy["withheld"]) and (
            problem := _decision_problem(copy, contents, roots, revoked)
        ):
            steps.append(Step(f"{copy['sample']} {words}: {problem}", complete=False))
    return steps


def check_dispositions(
    contents: CertificateContent, roots: Sequence[x509.Certificate], revoked: Sequence[Revoked]
) -> list[Step]:
    """Check what quality assurance is said to have decided about nonconformances: that she signed it."""
    since, lost = _revoked(revoked)
    steps = []
    for stated in contents.result.get("dispositions") or ():
        given = NonconformanceDecided.from_json(stated)
        content = signed_content(contents.serial, given)
        if problem := decision_problem(DISPOSITION, content, given.disposition.signed, roots, since, lost):
            words = f"what is said to be decided about {'; '.join(given.nonconformances)} does not count"
            steps.append(Step(f"{words}: {problem}", complete=False))
    return steps


def _copy_problem(copy: Mapping[str, Any], contents: CertificateContent) -> str | None:
    if copy["sample"] not in (contents.result.get("samples") or {}):
        return "the unit has none of that name"
    for other in copy["with"]:
        section, _, name = str(other["sample"]).partition("/")
        known = section in CHECKS and (name == TYPED or name in CHECKS[section].inputs)
        if not known or serial_problem(str(other["serial"])) is not None:
            return "the other one is not named as a record of a unit"
    return None


def _decision_problem(
    copy: Mapping[str, Any], contents: CertificateContent, roots: Sequence[x509.Certificate], revoked: Sequence[Revoked]
) -> str | None:
    weakens = bool(copy["withheld"])  # then it stands also if the key was lost later
    since, lost = _revoked(revoked)
    samples = contents.result.get("samples") or {}
    told = copy.get("resolved") or {}
    signed = SignedBy.from_json(told["signed"]) if told.get("signed") else None
    content = {key: told.get(key) for key in ("parties", "measured", "reason")}
    if problem := decision_problem(CopiesResolved.KIND, content, signed, roots, since, () if weakens else lost):
        return problem
    measured = [contents.serial, copy["sample"]] in (told.get("measured") or [])
    if measured is weakens:
        return f"it {'says' if measured else 'does not say'} that it was measured at this unit"
    party = list(recording_party(contents.serial, copy["sample"], samples.get(copy["sample"]) or {}))
    if party not in [list(p) for p in told.get("parties") or []]:
        return "it is about another recording of that name"
    if signed is not None and told["who"] != signed.person:
        return f"it names {told['who']}, but {signed.person} signed it"
    if (
        signed is not None
        and abs(datetime.fromisoformat(told["time"]) - datetime.fromisoformat(signed.time)) > STORED_WITHIN
    ):
        return f"it is dated {str(told['time'])[:19]}, but was signed at {signed.time[:19]}"
    return None


def _revoked(revoked: Sequence[Revoked]) -> tuple[dict[int, datetime], set[int]]:
    """Return when each key was revoked, by number, and the numbers of those that were compromised."""
    lost = {entry.serial_number for entry in revoked if entry.compromised}
    return {entry.serial_number: entry.since for entry in revoked}, lost


def _check_folder(contents: CertificateContent) -> list[Step]:
    """Check another serial that a folder bears or resembles, and that the operator confirmed the unit's own."""
    stated = contents.result.get("folder") or {}
    others = [str(stated[key]) for key in (NAME, ALIKE) if key in stated]
    if stated and (set(stated) - {NAME, CONFIRMED, ALIKE} or not others or any(map(serial_problem, others))):
        return [Step("its folder is said to bear another serial, which is not one", complete=False)]
    if CONFIRMED in stated and not same_person(str(stated[CONFIRMED]), contents.operator):
        words = f"{stated[CONFIRMED]} is said to have confirmed the serial of its folder, and did not sign"
        return [Step(words, complete=False)]
    return []


def _check_spec(contents: CertificateContent) -> None:
    try:
        spec = parse(contents.spec_text.encode(), "the attached spec")
    except SpecError as e:
        raise InvalidCertificate(f"the attached spec cannot be used: {e}") from e
    for what, stated, there in (
        ("name", contents.spec_name, spec.name),
        ("title", contents.spec_title, spec.title),
        ("list of instruments", dict(contents.instruments), spec.instruments),
    ):
        if stated != there:
            raise InvalidCertificate(f"the page gives the spec another {what} than the attached spec has: '{there}'")


def _other_program(contents: CertificateContent) -> Step:
    """Return the step on another program. Its hash is its own claim: nothing that depends on it makes it valid."""
    says = "" if contents.statement == STATEMENT else "; it says of the verdicts what this program does not say"
    program = f"accept {contents.accept_version}, code {contents.code_sha256[:12]}"
    return Step(f"it was made by another program ({program}; here {version.code_sha256()[:12]}){says}", complete=False)


def _times(given: Provenance, signed: datetime) -> list[Step]:
    last = given.earlier.not_accepted if given.earlier else None
    stated = {
        "it was judged": given.judged,
        "what it replaces was judged": given.replaces.time if given.replaces else "",
        "an attempt that was not accepted was judged": last.time if last else "",
        "its spec was approved": str((given.approval or {}).get("time", "")),
    }
    times = [(what, datetime.fromisoformat(time)) for what, time in stated.items() if time]
    words = f"it was signed at {signed:%Y-%m-%d %H:%M:%S} UTC, before"
    return [
        Step(f"{words} {what} ({at:%Y-%m-%d %H:%M:%S} UTC): the bench's clock ran back", complete=False)
        for what, at in times
        if signed < at - SAME_SECOND
    ]


def _days(contents: CertificateContent, signed: datetime) -> list[Step]:
    """Check that nothing was measured after it was signed, and that calibrations are those of the judgement's day."""
    latest, measured = signed.date() + timedelta(days=1), contents.result.get("measured", {}).items()
    wrong = [f"{n} is said to be measured on {d}, after it was signed" for n, d in measured if d > latest.isoformat()]
    judged = datetime.fromisoformat(contents.stated.judged).date() if contents.stated.judged else signed.date()
    given = contents.result.get("calibration")
    if given and not judged - LONGEST_RUN <= date.fromisoformat(given["on"]) <= latest:
        wrong.append(f"its calibrations are those of {given['on']}, but it was judged on {judged}")
    return [Step(words, complete=False) for words in wrong]


def check_bench(
    contents: CertificateContent, roots: Sequence[x509.Certificate], revoked: Sequence[Revoked], when: datetime
) -> list[Step]:
    """Check that a bench of a trusted authority signed head and provenance, and that a technician signed the
    commissioning of each instrument as it is stated. when: time of the technician's signature.

    Steps are not complete for an unknown bench, whose store cannot be asked, and for a bench whose key was lost. Raises
    InvalidCertificate if a signature or a certificate does not hold."""
    given = contents.stated
    if not given.signature:
        if given.bench:
            raise InvalidCertificate("a bench is named, but it did not sign what is stated")
        return [Step("it was made at an unknown bench, which has no certificate of the authority", complete=False)]
    certificate = _certificate(given, roots)
    _check_signature(contents, certificate)
    name = authority.person_of(certificate)
    if not certificate.not_valid_before_utc <= when <= certificate.not_valid_after_utc:
        return [Step(f"the certificate of its bench, {name}, was not valid at {when.isoformat()}", complete=False)]
    if given.result and given.result != hashes_of(contents):
        raise InvalidCertificate("its bench signed what is stated beside the result for another result or spec")
    signed = "signed the result and" if given.result else "did not sign the result, only"
    steps = [Step(f"made at {name}, which {signed} what is stated beside it")]
    rows = (contents.result.get("calibration") or {}).get("instruments", ())
    for unsigned in dict.fromkeys(row["name"] for row in rows if not is_proven(row, roots)):
        words = f"what is said of the commissioning of {unsigned} is not signed by a technician, or not of this program"
        steps.append(Step(words, complete=False))
    for entry in revoked:
        if entry.serial_number == certificate.serial_number and (entry.compromised or when >= entry.since):
            words = f"the key of its bench, {name}, was revoked on {entry.since:%Y-%m-%d}"
            steps.append(Step(words, complete=False))
    if given.authority:
        if given.authority != AT_THE_BENCH:
            raise InvalidCertificate(f"provenance.authority is {given.authority!r}")
        steps.append(Step("the authority's key lay at this bench: who opens it can sign as everybody"))
    return steps


def _certificate(given: Provenance, roots: Sequence[x509.Certificate]) -> x509.Certificate:
    try:
        certificate = x509.load_pem_x509_certificate(given.bench.encode("ascii"))
    except ValueError as e:
        raise InvalidCertificate(f"the certificate of its bench cannot be read ({type(e).__name__})") from e
    if certificate.public_bytes(Encoding.PEM).decode("ascii") != given.bench:
        raise InvalidCertificate("provenance.bench is not a certificate as this program writes it")
    if not any(authority.issued_by(certificate, ca) for ca in roots):
        raise InvalidCertificate("the certificate of its bench was not issued by a trusted authority")
    if authority.role_of(certificate) != BENCH:
        raise InvalidCertificate(f"its bench has the certificate of a {authority.role_of(certificate)}")
    return certificate


def _check_signature(contents: CertificateContent, certificate: x509.Certificate) -> None:
    given, key = contents.stated, certificate.public_key()
    if not isinstance(key, Ed25519PublicKey):
        raise InvalidCertificate("the key of its bench is of another kind")
    if given.head is not None and given.head.bench != public_of(certificate):
        raise InvalidCertificate("the head of its store is signed by another bench than the one that is named")
    try:
        signature = bytes.fromhex(given.signature)
        key.verify(signature, signed_text(contents.serial, contents.provenance))
    except (ValueError, InvalidSignature) as e:
        raise InvalidCertificate("what is stated beside the result was changed after the bench signed it") from e
    if signature.hex() != given.signature:
        raise InvalidCertificate("provenance.signature is not in lower-case hexadecimal digits")
