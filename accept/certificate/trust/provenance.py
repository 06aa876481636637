"""The provenance that a certificate states beside its result: its attempt, what it replaces, the head of the bench's
store, the approval of the spec, and whether a demo made it."""

import hashlib
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cryptography.hazmat.primitives.serialization import Encoding

from accept.base.documents.results import UnitEntry
from accept.certificate.contents.content import CertificateContent, canonical
from accept.certificate.contents.laboratory import contents_of, laboratory_of, number_of, statement_of
from accept.certificate.trust import keys, revocation, revocation_record
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.spec_approval import approval_of
from accept.store import Event, SignedHead, Store, UnitState
from accept.store.fold import VOIDED
from accept.store.opening import BENCH_KEY
from accept.store.payloads import BenchStated, CertificateSigned
from accept.store.seal import own_key
from checks.verdict import UnitVerdict
from specs.spec import Spec

AT_THE_BENCH = "its key lies at this bench"


def provenance(
    store: Store,
    who: str,
    spec: Spec,
    serial: str,
    before: UnitState | None,
    head: SignedHead | None,
    home: Path,
    credential: Credential | None,
    attempt: int | None = None,
    taken: Collection[str] = (),
    reason: str | None = None,
    signed_because: str = "",
    amends: str = "",
    judged: str = "",
    earlier: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return what the certificate of a unit states beside its result, which `signed_by_bench` signs, and store what it
    states of the bench itself, from one reading of the bench's files.

    who: the operator, for the store; before: what the store knows of the unit's last judgement; attempt: its number, if
    it is not one more than that; head: of the store when the unit was judged; taken: numbers that other certificates of
    the unit have; reason: why the unit was judged again, "" if no reason was given; signed_because: why the technician
    signs a unit that is not accepted, or a certificate that replaces another one; amends: the certificate with another
    result that it replaces; judged: when the unit was judged, if that was stored before; earlier: how the judgements
    before ended.

    replaces: verdict, time and certificate of the last judgement, None for a first one; if that had no certificate, the
    last one that there was, of which attempt; before: the values of the last one, so that a significant change is seen.
    approval: of the spec, as it is attached. crl: the authority's list of revoked keys as it is now, PEM, for a
    verification after the authority is gone. authority: only if its key lies at the bench. laboratory, number: by
    `laboratory.toml` of the bench. bench: the bench's certificate, PEM.

    Raises RevocationError, KeysError, SpecError, StoreError."""
    list_file = keys.folder(home) / revocation.FILE
    laboratory, listed, here = laboratory_of(home), revocation.kept(list_file), keys.authority_here(home)
    ca = credential.ca if credential else None
    demo = credential is not None and credential.demo
    held = None if ca is None or demo or listed is None else revocation.parsed(listed.encode(), str(list_file), ca)
    if ca is not None and held is not None:
        revocation_record.record(store, ca, held, who)
    if credential is not None and not demo and store.bench:
        contents = contents_of(laboratory) if laboratory else None
        _store_bench(store, who, BenchStated(store.bench, contents, here, listed and digest_of(listed)))
    gone = [] if held is None else held.entries
    number = attempt or (before.attempts + 1 if before else 1)
    scheme = laboratory.certificate_number if laboratory else None
    stated: dict[str, Any] = {
        "attempt": number,
        "replaces": replaced_by(before),
        "approval": approval_of(spec, home, ca, gone),
    }
    bench = None if ca is None or demo else keys.bench_certificate(home, ca)
    more = {
        "head": head and head.to_json(),
        "crl": None if demo else listed,
        "demo": demo or None,
        "authority": AT_THE_BENCH if here and not demo else None,
        "earlier": earlier,
        "before": values_before(before),
        "reason": reason,
        "signed_because": signed_because or None,
        "amends": amends or None,
        "judged": judged or None,
        "laboratory": statement_of(laboratory, spec.checks) if laboratory else None,
        "number": scheme and number_of(scheme, serial, number, datetime.now(UTC).year, taken),
        "bench": bench and bench.public_bytes(Encoding.PEM).decode("ascii"),
    }
    return stated | {key: value for key, value in more.items() if value is not None}


def _store_bench(store: Store, who: str, stated: BenchStated) -> None:
    """Store what a bench states from its own folder, if it differs from what it stated before, so that a certificate
    can be compared with it."""
    last = [each for each in map(BenchStated.of, store.events("", BenchStated.KIND)) if each.bench == store.bench]
    if not last or last[-1].to_json() != stated.to_json():
        store.write(stated, who=who)


def digest_of(listed: str) -> str:
    """Return the hash of a list of revoked keys, as the store keeps it."""
    return hashlib.sha256(listed.encode()).hexdigest()


def signed_by_bench(contents: CertificateContent, home: Path) -> CertificateContent:
    """Return the content with result and signature in its provenance, if a bench is named there. result: hashes of
    result and spec, so that what is stated of one attempt is not put beside the result of another. signature: of the
    serial and all that is stated, by the bench's key. Raises OSError."""
    if "bench" not in contents.provenance:
        return contents
    stated = {**contents.provenance, "result": hashes_of(contents)}
    signature = own_key(home / BENCH_KEY).sign(signed_text(contents.serial, stated)).hex()
    return replace(contents, provenance=stated | {"signature": signature})


def hashes_of(contents: CertificateContent) -> dict[str, str]:
    """Return the hashes of result and spec, as the provenance states them."""
    return {"record_sha256": contents.record_sha256, "spec_sha256": contents.spec_sha256}


def signed_text(serial: str, stated: Mapping[str, Any]) -> bytes:
    """Return the bytes that a bench signs: the serial and all that is stated but for the signature itself."""
    rest = {key: value for key, value in stated.items() if key != "signature"}
    return canonical({"serial": serial, "provenance": rest})


def values_before(before: UnitState | None) -> dict[str, Any] | None:
    """Return value and U of each quantity of the judgement that the next one replaces; None without such a judgement,
    or if it was declared void."""
    if before is None or before.voided:
        return None
    known = (f for f in before.result.findings if f.value is not None and f.U is not None)
    return {f.quantity: {"value": f.value, "U": f.U} for f in known} or None


def earlier_attempts(before: UnitState | None) -> dict[str, Any] | None:
    """Return how the attempts before the next one ended: how many with which verdict, and which was the last that was
    not accepted; None for a first one. A void one counts as void."""
    if before is None:
        return None
    stopped = [
        {"attempt": number, "verdict": verdict, "time": time}
        for number, (_, verdict, time) in enumerate(before.ended, 1)
        if verdict not in (UnitVerdict.ACCEPTED, VOIDED)
    ]
    verdicts = Counter(verdict for _, verdict, _ in before.ended)
    return {"verdicts": dict(verdicts), "not_accepted": stopped[-1] if stopped else None}


def amended(serial: str, before: UnitState | None, result: UnitEntry) -> str:
    """Return the number of the certificate that one with this result replaces, serial and attempt if it has none; "" if
    it replaces none, or one with the same result."""
    last = before.handed_out if before is not None else None
    if last is None or (last.result is not None and _stated(last.result) == _stated(result)):
        return ""
    return last.number or f"{serial}/{last.attempt}"


def needs_reason(verdict: str, *replaced: str | None) -> bool:
    """Return whether a certificate with another result is made with a reason only: one of an accepted unit in place of
    one of an accepted unit. A change of the verdict does not wait for words."""
    return verdict == UnitVerdict.ACCEPTED and UnitVerdict.ACCEPTED in replaced


def _stated(entry: UnitEntry) -> tuple[str, list[tuple[object, ...]]]:
    """Return what a certificate states of a result: verdicts, and values, U and limits to the digits that another
    processor computes too."""
    numbers = {f.quantity: (f.value, f.U, f.lower, f.upper) for f in entry.findings}
    rounded = {name: tuple(x if x is None else f"{x:.8g}" for x in given) for name, given in numbers.items()}
    return entry.verdict, [(f.quantity, f.unit, f.rule, f.verdict, *rounded[f.quantity]) for f in entry.findings]


def numbers_of(events: Iterable[Event]) -> set[str]:
    """Return the numbers of the certificates that these events state."""
    signed = (CertificateSigned.of(event) for event in events if event.what == CertificateSigned.KIND)
    return {each.number for each in signed if each.number}


def replaced_by(before: UnitState | None) -> dict[str, Any] | None:
    """Return what the next judgement of a unit replaces, as its certificate states it; None for a first one."""
    if before is None:
        return None
    certificate = before.certificate.sha256 if before.certificate else None
    replaces: dict[str, Any] = {"verdict": before.verdict, "time": before.time, "certificate": certificate}
    if certificate is None and before.handed_out is not None:
        replaces |= {
            "earlier_attempt": before.handed_out.attempt,
            "earlier_certificate": before.handed_out.sha256,
        }
    return replaces
