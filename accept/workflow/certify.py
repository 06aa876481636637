"""Signing the certificate of a judged unit, and verifying it on the spot."""

import hashlib
import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from accept.base.names import same_person
from accept.certificate import (
    TSA_VARIABLE,
    Issuer,
    ListsBeside,
    Provenance,
    SigningRefused,
    Verification,
    amended,
    at_bench,
    content_of,
    ends_before,
    parse_disposition,
    parse_signing_reason,
    ports,
    read_certificate,
    rejudge,
    sign_into,
    trust,
    verify_certificate,
)
from accept.certificate.trust import QA, TECHNICIAN, Credential, LockedError
from accept.judging.reservations import counted
from accept.store import fold
from accept.store.payloads import CertificateSigned, UnitJudged
from accept.workflow.dialogue.summary_effects import Ask, AskedLine, BenchKeys
from accept.workflow.entry.shift import NOT_TAKEN
from accept.workflow.session import Session
from accept.workflow.state.unit_state import certificate_name
from accept.workflow.worker.judging import judge_whole_unit
from checks.verdict import UnitVerdict
from specs.errors import AcceptError


class Signing:
    """Implements `accept.workflow.ports.SigningPort`."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def make_keys(self, passphrase: str) -> Path:
        return trust.init(self._session.home, passphrase, self._session.operator) / trust.AUTHORITY_PASSPHRASE

    def sign(self, passphrase: str, reason: str = "") -> Verification:
        """Judge if needed, draw, sign as technician, write, store, and verify what was written. reason: why a unit is
        signed that is not accepted, or a certificate is replaced; it stands on the certificate and in the store.

        Raises KeysError if the passphrase does not open the key and DispositionError if the reason is missing (nothing
        was done then), SigningRefused, ContentError, OSError, StoreError.
        """
        session = self._session
        credential = self._opened(TECHNICIAN, passphrase)
        if session.attempt.certificate is not None:
            raise SigningRefused(f"{session.serial}: this result is signed already")
        session.refresh()
        result = session.judgements.result or judge_whole_unit(session)
        past = [*session.store.events(session.serial)]
        judged = next(event for event in reversed(past) if event.what == UnitJudged.KIND)
        last, place = UnitJudged.of(judged), str(session.folder.resolve())
        if (last.path, last.result.to_json()) != (place, result.to_json()):
            now = judge_whole_unit(session)  # the newest measurement wins: what was seen is not what stands
            words = f"it was judged meanwhile, {last.result.word} in {last.path}; judged once more it is {now.word}"
            raise SigningRefused(f"{session.serial}: {words}. Look at the summary (F9), then sign")
        amends = self._amends
        why = parse_signing_reason(result.verdict, reason, self._replaces)
        if _is_one_of(why, [passphrase]):
            raise SigningRefused(NOT_TAKEN)
        number, events = session.attempt.number, [*counted(session.store, past)]
        earlier, why_again = ends_before(fold(events, before=judged.seq)), last.reason
        decided = Provenance(
            number, reason=why_again, earlier=earlier, amends=amends, judged=judged.time, signed_because=why
        )
        path = session.home / "certificates" / certificate_name(session.serial, number)
        issue = Issuer(session.store, session.home, credential.person, credential).draw(
            path, session.spec, result, fold(events, before=session.begun), past, decided,
            lambda stated: content_of(result, session.spec, session.folder, credential.person, provenance=stated),
        )  # fmt: skip
        issue(judged.seq)
        return self._verified(path, credential)

    def countersign(self, passphrase: str, choice: str = "", reason: str = "") -> Verification:
        """Verify, then sign as quality assurance, with the disposition of a unit that was not accepted. An invalid
        certificate is not signed, nor one that the technician did not sign for this attempt, nor any if the unit's
        history went on meanwhile. Raises as `sign`, DispositionError."""
        session = self._session
        known = session.refresh().seq
        if session.attempt.certificate is None:
            raise SigningRefused(f"{session.serial}: the technician signs first")
        if _is_one_of(reason, [passphrase]):
            raise SigningRefused(NOT_TAKEN)
        path = Path(session.attempt.certificate)
        credential = self._unlocked(QA, passphrase)
        document = read_certificate(path)
        before, digest = _verify(session, document, credential), hashlib.sha256(document).hexdigest()
        signed = map(CertificateSigned.of, session.store.events(session.serial, CertificateSigned.KIND))
        own = [e.sha256 for e in signed if (e.path, e.role) == (session.attempt.certificate, TECHNICIAN)]
        if not before.valid:
            raise SigningRefused(f"{path.name} does not verify and is not countersigned: {before.reason}")
        if (before.serial, [digest]) != (session.serial, own[-1:]):
            raise SigningRefused(f"{path} is not the certificate of {session.serial} that the technician signed")
        disposition = parse_disposition(session.serial, before.verdict, choice, reason)
        sign_into(
            path, document, credential, session.store, session.serial, credential.person, session.spec_name,
            disposition, simulated=before.simulated, nonconformances=before.nonconformances, after=known,
        )  # fmt: skip
        return self._verified(path, credential)

    def keys(self, role: str) -> BenchKeys:
        return BenchKeys(
            key_problem(self._session.home, self._session.operator, role),
            trust.exist(self._session.home),
            self._replaces,
        )

    def problem(self, asked: Ask, place: int, given: Sequence[str]) -> str:
        said = [text for line, text in zip(asked.lines, given, strict=True) if not line.is_secret]
        secrets = [text for line, text in zip(asked.lines, given, strict=True) if line.is_secret]
        match asked.lines[place]:
            case AskedLine.WHY | AskedLine.WHY_REPLACED:
                return self.reason_problem(given[place], secrets)
            case AskedLine.DISPOSITION:
                return self.disposition_problem(given[place], "-", secrets)
            case AskedLine.REASON:
                return self.disposition_problem(given[place - 1], given[place], secrets)
            case AskedLine.REPEATED:
                return "" if secrets[0] == given[place] else "The passphrases differ"
            case AskedLine.PASSPHRASE if asked.then == "first keys":
                return self.new_passphrase_problem(given[place], said)
            case line:
                return self._passphrase_problem(QA if line is AskedLine.QA_PASSPHRASE else TECHNICIAN, given[place])

    def _opened(self, role: str, passphrase: str) -> Credential:
        """Return the key that a passphrase opens. Raises KeysError, SigningRefused if the key is another person's."""
        credential, operator = self._unlocked(role, passphrase), self._session.operator
        if role == TECHNICIAN and not same_person(credential.person, operator):
            raise SigningRefused(f"{operator} is the operator, the key is that of {credential.person}")
        return credential

    def _unlocked(self, role: str, passphrase: str) -> Credential:
        if not passphrase:
            raise trust.KeysError("no passphrase was typed; nothing was signed")
        home, operator = self._session.home, self._session.operator
        several = role == TECHNICIAN and len(trust.persons(home, role)) > 1
        credential = trust.unlock(home, role, passphrase, operator if several else None)
        return trust.stamping(credential, os.environ.get(TSA_VARIABLE), home)

    def _passphrase_problem(self, role: str, passphrase: str) -> str:
        try:
            self._opened(role, passphrase)
        except AcceptError as e:
            return _NOT_OPENED if isinstance(e.__cause__, LockedError) else " ".join(str(e).split())
        return ""

    @property
    def _amends(self) -> str:
        """Return the certificate with another result that one of the present result replaces, "" for none."""
        session, result = self._session, self._session.judgements.result
        return amended(session.serial, session.run.state, result) if result is not None else ""

    @property
    def _replaces(self) -> str:
        """Return the certificate that a signature would replace by another result without a reason given before, ""
        for none. A new attempt has its reason."""
        return "" if self._session.attempt.reason else self._amends

    def reason_problem(self, reason: str, secrets: Iterable[str]) -> str:
        """Return why a technician's reason to sign the present result cannot stand on the certificate, "" if it can.
        secrets: passphrases that were typed."""
        result, amends = self._session.judgements.result, self._replaces
        if result is None or (result.verdict is UnitVerdict.ACCEPTED and not amends):
            return ""
        if not reason.strip():
            what = f"replace certificate {amends}" if amends else f"sign a unit that is {result.word}"
            return f"Say in one line why you {what}: it stands on the certificate"
        return _is_one_of(reason, secrets) or _refusal(lambda: parse_signing_reason(result.verdict, reason, amends))

    def disposition_problem(self, choice: str, reason: str, secrets: Sequence[str]) -> str:
        """Return why quality assurance cannot decide so about a unit that was not accepted, "" if it can."""
        verdict = str(self._session.attempt.verdict)
        equal = _is_one_of(choice, secrets) or _is_one_of(reason, secrets)
        return equal or _refusal(lambda: parse_disposition(self._session.serial, verdict, choice, reason))

    def new_passphrase_problem(self, chosen: str, said: Sequence[str]) -> str:
        """Return why a passphrase cannot be chosen, "" if it can. said: what was typed beside it in clear."""
        if _is_said(self._session, chosen) or _is_one_of(chosen, said):
            return "This stands in clear in the unit's record: choose another passphrase"
        return _refusal(lambda: trust.check_passphrase(chosen))

    def _verified(self, path: Path, credential: Credential) -> Verification:
        self._session.refresh()
        return _verify(self._session, read_certificate(path), credential)


def key_problem(home: Path, operator: str, role: str = TECHNICIAN) -> str:
    """Return why this operator cannot sign in a role with the keys at this bench, and what to do; "" if nothing is
    known against it, or the bench has no keys yet."""
    if not trust.exist(home):
        return ""
    names = trust.persons(home, role)
    if role == QA:
        return "" if names else f"Quality assurance has no key at this bench yet: {_ASK.format(QA, 'NAME')}"
    if any(same_person(name, operator) for name in names):
        return ""
    whose = f"the key at this bench is that of {', '.join(names)}" if names else "this bench has no technician's key"
    return f"{operator} cannot sign here: {whose}. A key for {operator}: {_ASK.format(TECHNICIAN, operator)}"


def _is_said(session: Session, text: str) -> bool:
    """Return whether text stands in the record of a unit already, in clear: no key gets it as its passphrase."""
    attempt = session.attempt
    said = [session.operator, session.serial, attempt.reason, *attempt.parts.values()]
    for step in session.steps:
        state = session.state(step.name)
        said += [*state.reasons, *(note.text for note in state.notes)]
    return text.strip() in {words.strip() for words in said}


def _is_one_of(words: str, secrets: Iterable[str]) -> str:
    """Return why words are not taken if they are one of the secrets, else ""."""
    return NOT_TAKEN if words.strip() and words.strip() in {secret.strip() for secret in secrets} else ""


def _refusal(check: Callable[[], object]) -> str:
    try:
        check()
    except AcceptError as e:
        return " ".join(str(e).split())
    return ""


_ASK = "accept keys request --role {} --name {}"
_NOT_OPENED = "Wrong passphrase, or the file of the key is damaged. Type it again"


def _verify(session: Session, document: bytes, credential: Credential) -> Verification:
    listed = ListsBeside({trust.list_file(session.home): credential.ca})
    return verify_certificate(
        document, [credential.ca], ports(rejudge), records=session.folder, known=at_bench(listed),
        revoked=listed.entries, training=session.training,
    )  # fmt: skip
