"""The provenance that a certificate states beside its result: its attempt, what it replaces, the head of the bench's
store, the approval of the spec, and whether a demo made it."""

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from cryptography.hazmat.primitives.serialization import Encoding

from accept.base.documents.results import UnitRecord
from accept.certificate.contents.content import CertificateContent, hashes_of, signed_text
from accept.certificate.contents.laboratory import contents_of, laboratory_of, number_of, statement_of
from accept.certificate.contents.provenance import (
    AT_THE_BENCH,
    Earlier,
    Head,
    Provenance,
    Replaced,
    Stopped,
    ValueBefore,
    digest_of,
)
from accept.certificate.trust import keys, revocation, revocation_record
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.spec_approval import approval_of
from accept.store import BENCH_KEY, Event, SignedHead, Store, UnitState, own_key
from accept.store.payloads import VOIDED, BenchStated, CertificateSigned
from checks.verdict import UnitVerdict
from specs.spec import Spec


def provenance(
    store: Store,
    who: str,
    spec: Spec,
    serial: str,
    before: UnitState | None,
    head: SignedHead | None,
    home: Path,
    credential: Credential | None,
    taken: Collection[str],
    decided: Provenance,
) -> Provenance:
    """Return what the certificate of a unit states beside its result, which `signed_by_bench` signs, and store what it
    states of the bench itself, from one reading of the bench's files.

    who: the operator, for the store; before: what the store knows of the unit's last judgement; head: of the store when
    the unit was judged; taken: numbers that other certificates of the unit have; decided: the statements of the caller,
    such as reasons, the attempt if it is not one more than the last, and when the judgement was stored, which is stated
    if that was on another day.
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
        new = BenchStated(store.bench, contents, here, listed and digest_of(listed))
        last = [each for each in map(BenchStated.of, store.events("", new.KIND)) if each.bench == store.bench][-1:]
        if [new.to_json()] != [each.to_json() for each in last]:
            store.write(new, who=who)
    number = decided.attempt or (before.attempts + 1 if before else 1)
    scheme, now = laboratory.certificate_number if laboratory else None, datetime.now(UTC)
    bench = None if ca is None or demo else keys.bench_certificate(home, ca)
    return replace(
        decided,
        attempt=number,
        judged="" if decided.judged[:10] == now.date().isoformat() else decided.judged,
        replaces=replaced_by_next(before),
        before=values_before(before),
        laboratory=statement_of(laboratory, spec.checks) if laboratory else None,
        number=number_of(scheme, serial, number, now.year, taken) if scheme else "",
        approval=approval_of(spec, home, ca, [] if held is None else held.entries),
        head=Head(**head.to_json()) if head else None,
        bench=bench.public_bytes(Encoding.PEM).decode("ascii") if bench else "",
        authority=AT_THE_BENCH if here and not demo else "",
        crl=listed if listed and not demo else "",
        demo=demo,
    )


def signed_by_bench(contents: CertificateContent, home: Path) -> CertificateContent:
    """Return the content with result and signature in its provenance, if a bench is named there. result: hashes of
    result and spec, so that what is stated of one attempt is not put beside the result of another. signature: of the
    serial and all that is stated, by the bench's key. Raises OSError."""
    if "bench" not in contents.provenance:
        return contents
    stated = {**contents.provenance, "result": hashes_of(contents)}
    signature = own_key(home / BENCH_KEY).sign(signed_text(contents.serial, stated)).hex()
    return replace(contents, provenance=stated | {"signature": signature})


def replaced_by_next(before: UnitState | None) -> Replaced | None:
    """Return what the next judgement of a unit replaces; None for a first one."""
    if before is None:
        return None
    certificate = before.certificate.sha256 if before.certificate else None
    earlier = before.handed_out if certificate is None else None
    more = (earlier.attempt, earlier.sha256) if earlier is not None else ()
    return Replaced(before.verdict, before.time, certificate, *more)


def ends_before(before: UnitState | None) -> Earlier | None:
    """Return the ends of the attempts before the next one, void ones as such; None before the first."""
    if before is None:
        return None
    stopped = [
        Stopped(number, verdict, time)
        for number, (_, verdict, time) in enumerate(before.ended, 1)
        if verdict not in (UnitVerdict.ACCEPTED, VOIDED)
    ]
    return Earlier(dict(Counter(verdict for _, verdict, _ in before.ended)), stopped[-1] if stopped else None)


def values_before(before: UnitState | None) -> dict[str, ValueBefore] | None:
    """Return value and U of each quantity of the judgement that the next one replaces; None without such a judgement,
    or if it was declared void."""
    if before is None or before.voided:
        return None
    known = before.result.findings
    return {f.quantity: ValueBefore(f.value, f.U) for f in known if f.value is not None and f.U is not None} or None


def amended(serial: str, before: UnitState | None, result: UnitRecord) -> str:
    """Return the number of the certificate that one with this result replaces, serial and attempt if it has none; "" if
    it replaces none, or one with the same result."""
    last = before.handed_out if before is not None else None
    if last is None or (last.result is not None and _claims(last.result) == _claims(result)):
        return ""
    return last.number or f"{serial}/{last.attempt}"


def _claims(entry: UnitRecord) -> tuple[str, list[tuple[object, ...]]]:
    """Return what a certificate states of a result: verdicts, and values, U and limits to the digits that another
    processor computes too."""
    numbers = {f.quantity: (f.value, f.U, f.lower, f.upper) for f in entry.findings}
    rounded = {name: tuple(x if x is None else f"{x:.8g}" for x in given) for name, given in numbers.items()}
    return entry.verdict, [(f.quantity, f.unit, f.rule, f.verdict, *rounded[f.quantity]) for f in entry.findings]


def numbers_of(events: Iterable[Event]) -> set[str]:
    """Return the numbers of the certificates that these events state."""
    signed = (CertificateSigned.of(event) for event in events if event.what == CertificateSigned.KIND)
    return {each.number for each in signed if each.number}
