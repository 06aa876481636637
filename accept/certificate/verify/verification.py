"""Verification by anyone who holds the bench's CA certificate. A certificate that is not proven valid is invalid."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Any

from cryptography import x509

from accept.base import version
from accept.base.documents.results import SIMULATED, unit_word
from accept.base.watchdog import TimeLimitExceeded, judging_s, time_limit
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.outcome import InvalidCertificate, Step, guarded, one_line, quoted
from accept.certificate.contents.statements import NOT_STATED, statements
from accept.certificate.trust import authority
from accept.certificate.trust.approved_spec import check_spec
from accept.certificate.trust.authority import QA
from accept.certificate.trust.revocation import Revoked
from accept.certificate.verify import attachments
from accept.certificate.verify.page_check import check_page
from accept.certificate.verify.ports import AttachedUnit, Known, Ports, Rejudge
from accept.certificate.verify.revocation_check import attached_entries, doubted_by, only_by_clock
from accept.certificate.verify.signatures import Signed, signatures_of
from accept.certificate.verify.stated_check import check_bench, check_copies, check_dispositions, check_stated
from accept.certificate.verify.statements import taken_on_trust, words_on_trust
from accept.certificate.verify.structure import check_structure, read_unknown
from accept.pictures.labels import LONGEST_INPUTS, check_label, inputs_words
from accept.store.decisions import stated_words
from checks.verdict import UnitVerdict
from specs import plugins


class Validity(StrEnum):
    """The outcome of a verification."""

    VALID = "valid"  # signed, and judged again with the same result, and its page compared
    SIGNED = "signed"  # the signatures hold, but something that bears on the verdict could not be looked at
    NOT_VALID = "not valid"


@dataclass(frozen=True)
class Verification:
    """The result of verifying a certificate; `reason` in one line, `details` a line for each thing that was checked.

    spec_sha256, head: of the spec that it was judged by, and where the bench's store stood. demo: made by a demo.
    approved: quality assurance signed the spec with its model files, or it comes with the program. current: no later
    attempt is known, None if neither a store nor a list was asked. simulated: of no real unit. nonconformances: that
    hold the unit. authorised: quality assurance signed it, or neither its laboratory nor its unit asks for that.
    """

    outcome: Validity
    reason: str
    serial: str = ""
    verdict: str = ""
    signatures: tuple[Signed, ...] = ()
    details: tuple[str, ...] = ()
    spec_sha256: str = ""
    head: Mapping[str, Any] | None = None
    demo: bool = False
    approved: bool = False
    current: bool | None = None
    simulated: bool = False
    nonconformances: tuple[str, ...] = ()
    authorised: bool = True
    remarks: tuple[str, ...] = ()

    @property
    def valid(self) -> bool:
        """Whether it is plainly valid: signed, and checked completely."""
        return self.outcome is Validity.VALID

    @property
    def countersigned(self) -> bool:
        return any(s.role == QA for s in self.signatures)


def verify_certificate(
    pdf: bytes,
    trust: Sequence[x509.Certificate],
    ports: Ports,
    now: datetime | None = None,
    *,
    demo: bool = False,
    training: bool = False,
    records: Path | None = None,
    revoked: Sequence[Revoked] = (),
    known: Known | None = None,
    stamping: Sequence[x509.Certificate] = (),
) -> Verification:
    """Verify a certificate: signatures, coverage of every byte, roles, trust, page, and result.

    trust : CA certificates, the only ones trusted. ports : the bench that judges again and draws again.
    now : time of verifying; a signature from the future does not hold. demo : trust authorities of demonstrations, and
    only them. training : a simulated unit can be plainly valid, as in a demonstration; else it never is.
    records : folder with the records that were too large to attach. revoked : what the trusted authorities revoked.
    known : comparison with a bench's own store. stamping : trusted roots of time stamping authorities. Never
    raises on any bytes, and takes no longer than `accept.base.watchdog` allows for judging one unit.
    """
    limit, details, now = judging_s(), list[str](), now or datetime.now(UTC)
    try:
        with time_limit(limit):
            roots = _roots(trust, demo)
            signatures, attached = read_unknown(_opened, pdf, roots, now, revoked, stamping)
            details += _words_of_signatures(signatures)
            contents = guarded("the attachments", _unless_error, attached)
            unit = guarded("the attachments", attachments.unit_of, contents, ports.read_unit)
            details += _words_of_contents(contents, signatures)
            listed = guarded("the attached list of revoked keys", attached_entries, contents, roots)
            signatures = doubted_by(listed, signatures)
            revoked = [*revoked, *(entry for entry in listed if entry not in revoked)]
            given = _Given(pdf, contents, unit, signatures, roots, revoked, demo, now)
            steps, spec = _compared(given, ports, records, known, training)
            details += [one_line(step.words) for step in steps if step.words]
    except TimeLimitExceeded:
        return Verification(Validity.NOT_VALID, f"it could not be verified within {limit:g} s", demo=demo)
    except InvalidCertificate as e:
        return Verification(Validity.NOT_VALID, str(e), details=tuple(details), demo=demo)
    return _outcome(given, steps, spec, details)


def _opened(pdf: bytes, *against: Any) -> tuple[tuple[Signed, ...], CertificateContent | Exception]:
    """Return the signatures, and what is attached to the file that was signed first or why it cannot be read: one
    process for both, since a large program takes longer to start one than either takes."""
    signatures = signatures_of(pdf, *against)
    try:
        check_structure(signed := pdf[: signatures[0].place[2]])
        return signatures, attachments.read(signed)
    except MemoryError:
        raise
    except Exception as e:  # noqa: BLE001 - raised again after the words of the signatures
        return signatures, e


def _unless_error(attached: CertificateContent | Exception) -> CertificateContent:
    if isinstance(attached, Exception):
        raise attached
    return attached


def verify(pdf: bytes, trust: Sequence[x509.Certificate], rejudge: Rejudge) -> Verification:
    """Verify a certificate with the ports of the room that judges it again, as scripts from before ports call it."""
    return verify_certificate(pdf, trust, sys.modules[rejudge.__module__].ports(rejudge))


@dataclass(frozen=True)
class _Given:
    """A certificate whose signatures hold, its content, and the authorities, revoked keys and time that count."""

    pdf: bytes
    contents: CertificateContent
    unit: AttachedUnit
    signatures: tuple[Signed, ...]
    roots: Sequence[x509.Certificate]
    revoked: Sequence[Revoked]
    demo: bool
    now: datetime

    @property
    def simulated(self) -> bool:
        """Whether the attached folder says so: a result that another program made may not."""
        return self.unit.simulated or self.contents.simulated


def _compared(
    given: _Given, ports: Ports, records: Path | None, known: Known | None, training: bool
) -> tuple[list[Step], Step]:
    """Compare everything that is stated with its source; return all steps, and the one on the spec."""
    contents, signatures, against = given.contents, given.signatures, (given.contents, given.roots, given.revoked)
    stated = guarded("what it states", check_stated, contents, signatures, given.demo, ports)
    if records is None:
        judged = guarded("the records", attachments.within_samples, contents)
    else:
        judged = guarded("the records", attachments.with_records, contents, records, ports.read_record)
    again = None if ports.rejudge is None else guarded("judging again", ports.rejudge, judged)
    benches = [] if given.demo else guarded("the bench", check_bench, *against, signatures[0].when)
    steps = [
        *stated,
        *guarded("the copies", check_copies, *against),
        *guarded("the dispositions", check_dispositions, *against),
        *benches,
        *guarded("the keys", only_by_clock, contents, signatures, given.revoked, given.now),
        guarded("the page", check_page, given.pdf, contents, signatures, given.roots, ports),
        guarded("judging again", attachments.check_result, judged, given.unit, again),
        spec := guarded("the spec", check_spec, *against),
    ]
    if known is not None:
        steps += guarded("the store", known, given.pdf, contents, signatures, again, given.roots)
    if given.simulated:
        steps.append(Step(_SIMULATED, complete=given.demo or training))
    if not given.demo:
        looked_up = {field for step in steps for field in step.looked_up}
        steps += [
            guarded("the words", words_on_trust, contents, given.unit, looked_up),
            taken_on_trust(contents, looked_up),
        ]
    return steps, spec


def _outcome(given: _Given, steps: Sequence[Step], spec: Step, details: Sequence[str]) -> Verification:
    contents, signatures = given.contents, given.signatures
    lacking = [step.words for step in steps if not step.complete] + [s.doubt for s in signatures if s.doubt]
    doubts = [*(s.remark for s in steps if s.remark), *lacking]
    seen = [step.current for step in steps if step.current is not None]
    held = tuple(contents.result.get("nonconformances", ()))
    # a laboratory's report is released by quality assurance ([ISO17025] 7.8.1.1), and so is a unit that is held
    authorised = len(signatures) == 2 or not (contents.provenance.get("laboratory") or held)
    return Verification(
        Validity.SIGNED if lacking else Validity.VALID, _first_line(contents, signatures, doubts), contents.serial,
        str(contents.result["verdict"]), signatures, tuple(details), contents.spec_sha256,
        contents.provenance.get("head"), given.demo, spec.complete and not spec.remark,
        all(seen) if seen else None, given.simulated, held, authorised, tuple(doubts),
    )  # fmt: skip


_PROVEN = ", whose certificate was not revoked then, by what its servers answered and this document keeps"
_UNPROVEN = "; whether its certificate was revoked then is not seen here: this document keeps no answer of its servers"
_SIMULATED = f"{SIMULATED}: unit.toml says that the unit was simulated, so it is no acceptance of a real one"


def _first_line(contents: CertificateContent, signatures: Sequence[Signed], doubts: Sequence[str]) -> str:
    """Return serial and verdict, then every doubt, then what others wrote, quoted and cut: no name can push a doubt out
    of the line or write a part of it."""
    dispositions = contents.result.get("dispositions", ())
    word = unit_word(contents.result["verdict"], contents.result.get("nonconformances", ()), dispositions)
    decided = (quoted(words, 300) for words in stated_words(dispositions))
    signed = (f"signed by {quoted(s.person)} as {s.role} on {s.when:%Y-%m-%d %H:%M:%S} UTC" for s in signatures)
    state = "countersigned" if len(signatures) == 2 else "countersignature open"
    state += "".join(f", disposition: {quoted(s.disposition, 160)}" for s in signatures if s.disposition)
    spec = f"spec {quoted(contents.spec_name)} {contents.spec_sha256[:12]}"
    doubted = map(one_line, doubts)
    return "; ".join([f"{contents.serial} {word}", *doubted, *decided, *signed, state, spec])


def _roots(trust: Sequence[x509.Certificate], demo: bool) -> list[x509.Certificate]:
    """Return the trusted authorities, those of demonstrations if `demo`, else all others: a demonstration's passphrase
    is no secret."""
    if not trust:
        raise InvalidCertificate("no CA is trusted: give its certificate")
    roots = [ca for ca in trust if authority.is_demo(ca) == demo]
    if not roots:
        kind = "no demo authority is trusted" if demo else "the authority is that of a demo: accept verify --demo"
        raise InvalidCertificate(kind)
    return roots


def _words_of_signatures(signatures: Sequence[Signed]) -> list[str]:
    words = "signed by {0.person} as {0.role} on {0.when:%Y-%m-%d %H:%M:%S %Z}".format
    lines = [line for s in signatures for line in (words(s), _words_of_time(s))]
    lines += [] if len(signatures) == 2 else ["countersignature by quality assurance: open"]
    return [*lines, one_line(f"plug-ins here: accept {version.program()}")] if plugins.packages() else lines


def _words_of_contents(contents: CertificateContent, signatures: Sequence[Signed]) -> list[str]:
    lines = []
    if len(signatures) == 2 and contents.result["verdict"] != UnitVerdict.ACCEPTED:
        lines.append(f"disposition by {signatures[-1].person}: {signatures[-1].disposition or NOT_STATED}")
    said = guarded("the statements", statements, contents)
    used = guarded("the inputs of its findings", inputs_words, contents.result)
    lines += [one_line(f"{name.lower()}: {words}", LONGEST_INPUTS) for name, words in said.items() if words]
    return lines + [one_line(f"inputs of {check_label(c)}: {words}", LONGEST_INPUTS) for c, words in used.items()]


def _words_of_time(signed: Signed) -> str:
    by_heads = "the bench's clock; the signed heads of its store order certificates"
    if signed.stamped is None:
        return f"time of the {signed.role}: {by_heads}"
    at = f"timestamp of {signed.stamped.when:%Y-%m-%d %H:%M:%S} UTC by {one_line(signed.stamped.by)}"
    if signed.stamped.trusted:
        return f"time of the {signed.role}: trusted {at}{_PROVEN if signed.stamped.proven else _UNPROVEN}"
    if signed.stamped.revoked:
        return f"time of the {signed.role}: {by_heads}; a {at}, whose certificate had been revoked"
    return f"time of the {signed.role}: {by_heads}; a {at}, who is not trusted here (--tsa-trust)"
