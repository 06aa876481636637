"""Comparison of a certificate with a bench's own store: whether it holds the judgement and the signature as stated,
whether the unit was judged since, whether its recordings were given for another unit too, and whether its parts are in
order."""

import hashlib
import re
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import PurePath
from typing import Any

from accept.base.documents.results import UnitEntry
from accept.base.home import home
from accept.base.version import code_sha256
from accept.certificate.contents.content import BEFORE, CertificateContent, canonical
from accept.certificate.contents.laboratory import LaboratoryFile, number_of, statement_of
from accept.certificate.contents.step import Step
from accept.certificate.trust import keys
from accept.certificate.trust.names import same_person
from accept.certificate.trust.provenance import amended, digest_of, earlier_attempts, replaced_by, values_before
from accept.certificate.trust.revocation_record import store_is_there
from accept.certificate.verify.stated_check import SAME_SECOND
from accept.certificate.verify.statements import LOOKED_UP
from accept.judging.copies import Copy, copies_of
from accept.judging.nonconformance import CHOICES, standing, words_of
from accept.judging.parts import part_doubts
from accept.judging.rereadings import rereadings
from accept.judging.result import UnitResult
from accept.judging.superseded import Approval
from accept.judging.voids import voids
from accept.store import Event, Store, StoreError, StoreHead, fold, open_store
from accept.store.chain import START
from accept.store.indexes import JUDGED
from accept.store.opening import BENCH_KEY
from accept.store.payloads import BenchStated, CertificateSigned
from accept.store.seal import bench_of
from accept.units.attempt_folder import attempt_number
from checks.verdict import Verdict
from specs.spec import parse

_STARTED = "attempt_started"


def check_store(signed: bytes, contents: CertificateContent, when: datetime, again: UnitResult | None) -> list[Step]:
    """Compare a certificate with the bench's store.

    signed: the bytes up to the technician's signature, it included; when: its time. again: the unit as it was judged
    again from the attached records, None if it was not. A step is not complete if the store cannot be asked or does not
    hold, and if this bench made the certificate and its store is gone."""
    stated = (contents.provenance.get("head") or {}).get("bench")
    certified = keys.certified_bench(home())
    problem = keys.bench_problem(home())
    here = stated is not None and stated in (bench_of(home() / BENCH_KEY), certified)
    if not store_is_there():
        gone = "this bench made it, and its store is gone"
        if here:
            return [Step(f"{gone}; {problem}" if problem else gone, complete=False)]
        return [Step(problem)] if problem else []
    if problem and bench_of(home() / BENCH_KEY) is None:  # opening the store would make a key
        return [Step(problem, complete=False)]
    try:
        with open_store() as store:
            events = list(store.events(contents.serial))
            signature = _signature_event(events, signed)
            held = _held(store, contents, signature)
            history = _history(store, events, signature, contents) if signature else _later_than(events, when)
            compared = [_copied(store, contents, again), reread(store, contents)]
            compared += [_built(store, contents), _sound(store, contents, when)]
            other = [Step(problem, complete=stated != certified)] if problem else []
            return [*other, held, *history, *compared]
    except StoreError as e:
        return [Step(f"the bench's store could not be asked: {e}", complete=False)]


def _signature_event(events: Sequence[Event], signed: bytes) -> Event | None:
    digest = hashlib.sha256(signed).hexdigest()
    of_signing = (e for e in events if e.what == "certificate_signed")
    return next((e for e in of_signing if e.data["sha256"] == digest), None)


def _held(store: Store, contents: CertificateContent, signature: Event | None) -> Step:
    """Check that the store holds the signature. Not complete if the store of the bench that made it has another event
    under the stated number, or no event of this signature; and if neither is known. A certificate from before heads
    were stated is not checked."""
    head = contents.provenance.get("head")
    if head is not None:
        stated, own = StoreHead(int(head["seq"]), str(head["hash"])), store.signed_head()
        if not _holds(store, stated) or stated == START:
            if own is None or head["bench"] != own.bench:
                return Step("it was made at another bench, whose store is not this one")
            if stated != START:
                words = f"this bench's store does not hold event {stated.seq} as stated: it was put back or rewritten"
                return Step(f"{words} (accept store check --head)", complete=False)
    if signature is not None:
        return Step("this bench's store holds that it was signed")
    if head is None and contents.format == BEFORE:
        return Step("")
    words = "this bench's store does not hold that it was signed: another program signed it, or this one was stopped"
    return Step(f"{words} before it had said so", complete=False)


def _holds(store: Store, head: StoreHead) -> bool:
    event = next(store.events(after=head.seq - 1), None)
    return event is not None and StoreHead(event.seq, event.hash) == head


def _history(store: Store, events: Sequence[Event], signature: Event, contents: CertificateContent) -> list[Step]:
    """Compare result, operator, spec, attempt and what was replaced with the judgement that the signature certifies."""
    result = canonical(contents.result)
    named = signature.data.get("judged")  # earlier programs do not name the judgement that was signed
    before = [e for e in events if e.what == JUDGED and e.seq < signature.seq and named in (None, e.seq)]
    own = next((e for e in reversed(before) if canonical(e.data["result"]) == result), None)
    if own is None:
        return [Step("this bench's store holds no judgement with this result", complete=False)]
    if number := contents.provenance.get("number"):
        signed = [CertificateSigned.of(e) for e in events if e.what == CertificateSigned.KIND]
        if (bearing := sum(each.number == number for each in signed)) != 1:
            words = (
                f"this bench's store knows {bearing} certificates of the unit with the number {number}, expected one"
            )
            return [Step(words, complete=False)]
    wrong = [name for name, same in _comparisons(events, own, signature, contents).items() if not same]
    own_program = contents.code_sha256 == code_sha256()
    if own_program:  # earlier programs did not store what a bench states
        found = list(_bench_differences(store, own, signature, contents)) or [["statement of the bench"]]
        fewest: list[str] = min(found, key=len)
        wrong += fewest
    words = f"this bench's store has another {', another '.join(wrong)} than stated"
    if (void := voids(store, own.subject).get(own.seq)) is not None:
        return [Step(f"quality assurance declared this attempt void: {void.words}", complete=False, current=False)]
    compared = f"attempt, what it replaces{' and what its bench states' if own_program else ''}"
    right = f"operator, spec, code, {compared}: as in this bench's store"
    return [
        Step(words, complete=False) if wrong else Step(right, looked_up=LOOKED_UP if own_program else ()),
        *_later([e for e in events if e.what == JUDGED and e.seq > own.seq]),
    ]


def _comparisons(
    events: Sequence[Event], own: Event, signature: Event, contents: CertificateContent
) -> dict[str, bool]:
    """Return field -> whether the certificate states it as the store has it. own: the judgement that it certifies."""
    given = contents.provenance
    counted = [e for e in events if e.seq < own.seq]
    started = [e for e in counted if e.what == _STARTED]
    before = fold(counted).units.get(own.subject)
    numbers = {1 if before is None else before.attempts + 1}
    replaced: list[Any] = [(replaced_by(before), values_before(before))]
    if started and _is_of_attempt(own, started[-1], counted):
        numbers.add(int(started[-1].data["number"]))  # in the workflow an attempt may be judged more than once
        earlier = fold(e for e in counted if e.seq < started[-1].seq).units.get(own.subject)
        replaced.append((replaced_by(earlier), values_before(earlier)))
    latest = contents.code_sha256 == code_sha256()  # earlier programs do not state all of it
    amends = amended(own.subject, before, UnitEntry.from_json(contents.result))
    return {
        "operator": same_person(own.who, contents.operator),
        "spec": own.spec == f"{contents.spec_name}@{contents.spec_sha256}",
        "code": own.data["code_sha256"] == contents.code_sha256,
        "attempt": given.get("attempt") in numbers,
        "replaced judgement": given.get("replaces") in [judgement for judgement, _ in replaced],
        "reason": given.get("reason") == own.data.get("reason"),
        "values before": ("before" not in given and not latest)
        or (given.get("replaces"), given.get("before")) in replaced,
        "end of the attempts before": ("earlier" not in given and not latest)
        or given.get("earlier") == earlier_attempts(before),
        "amended certificate": ("amends" not in given and not latest) or given.get("amends", "") == amends,
        "time of the judgement": given.get("judged", own.time) == own.time,
        "reason of signing": given.get("signed_because", "") == CertificateSigned.of(signature).reason,
    }


def _bench_differences(store: Store, own: Event, signature: Event, contents: CertificateContent) -> Iterator[list[str]]:
    """Yield, for everything that the bench stated from the judgement until the signature, the fields of the provenance
    that are stated otherwise. It states something else since its laboratory.toml, say, was changed."""
    given, spec = contents.provenance, parse(contents.spec_text.encode(), "the attached spec")
    bench = (given.get("head") or {}).get("bench")
    events = [e for e in store.events("", BenchStated.KIND) if e.data["bench"] == bench and e.seq < signature.seq]
    before = [e for e in events if e.seq < own.seq]
    for stated in map(BenchStated.of, [*before[-1:], *(e for e in events if e.seq > own.seq)]):
        laboratory = None if stated.laboratory is None else LaboratoryFile(**stated.laboratory)
        scheme = laboratory.certificate_number if laboratory else None
        years = {datetime.fromisoformat(e.time).year for e in (own, signature)}
        numbers = (
            {number_of(scheme, contents.serial, int(given["attempt"]), year, ()) for year in years} if scheme else ()
        )
        number = re.sub(r"-\d+$", "", str(given.get("number")))  # of a second certificate of the attempt
        listed = given.get("crl")
        same = {
            "laboratory": given.get("laboratory") == (statement_of(laboratory, spec.checks) if laboratory else None),
            "number": given.get("number") in numbers or number in numbers if scheme else "number" not in given,
            "authority": ("authority" in given) == stated.authority,
            "crl": (listed and digest_of(str(listed))) == stated.crl,
        }
        yield [f"provenance.{name}" for name, known in same.items() if not known]


def _is_of_attempt(own: Event, started: Event, counted: Sequence[Event]) -> bool:
    """Return whether a judgement is one of the workflow's attempt that was started last: its folder has the attempt's
    number, and no other folder of the unit was judged in between. Else a folder of that name would hide an attempt."""
    if attempt_number(PurePath(str(own.data["path"])).name) != started.data["number"]:
        return False
    return all(e.data["path"] == own.data["path"] for e in counted if e.what == JUDGED and e.seq > started.seq)


def _later_than(events: Sequence[Event], when: datetime) -> list[Step]:
    """Return later judgements for a certificate whose signature this store does not hold, such as one of another bench:
    those after it was signed. If there are none here, its own bench may have some: nothing is known."""
    later = [e for e in events if e.what == JUDGED and datetime.fromisoformat(e.time) > when + SAME_SECOND]
    return _later(later) if later else []


def _later(judged: Sequence[Event]) -> list[Step]:
    """Return the step on later judgements: the newest wins, so a certificate of an earlier one is never plainly
    valid."""
    if not judged:
        return [Step("this bench's store knows no later attempt", current=True)]
    last = judged[-1]
    verdict, when = last.data["result"]["verdict"], last.time[:19].replace("T", " ")
    return [Step(f"this bench's store knows a later attempt: of {when} UTC, '{verdict}'", False, current=False)]


def _copied(store: Store, contents: CertificateContent, again: UnitResult | None) -> Step:
    """Check the recordings. Not complete if the store has a judgement of another unit by the same samples that the
    certificate counts, without a signed decision on where they belong. The samples are those of the attached records,
    whatever the result states."""
    samples = {**(contents.result.get("samples") or {}), **(again.samples if again is not None else {})}
    if not samples:
        return Step("")
    found = copies_of(store, contents.serial, None, samples)
    stated = {copy["sample"] for copy in contents.result.get("copies", []) if copy["withheld"]}
    counted = [copy for copy in found if copy["withheld"] and copy["sample"] not in stated]
    if not counted:
        return Step("the bench's store holds its recordings for no other unit")
    same = "; ".join(f"{copy['sample']} is also {_others(copy)}" for copy in counted)
    words = "its recordings were given for other units too, without a decision of quality assurance"
    return Step(f"{words}: {same}", complete=False)


def reread(store: Store, contents: CertificateContent) -> Step:
    """Check how the recordings were read. Not complete if the store has a judgement that read one otherwise and did not
    pass, and the certificate does not state it."""
    entry = UnitEntry.from_json(contents.result)
    found = rereadings(store, contents.serial, entry.samples, entry.findings, contents.inputs)
    passed = {f.quantity for f in entry.findings if f.verdict is Verdict.PASS}
    new = [r["words"] for q, r in found.items() if r["was"] != Verdict.PASS and q in passed]
    words = "the bench's store has the same recording, read otherwise"
    return Step(f"{words}: {'; '.join(new)}", complete=False) if new else Step("")


def _built(store: Store, contents: CertificateContent) -> Step:
    """Check the parts. Not complete if the store has a doubt about a part that the certificate does not state."""
    found = part_doubts(store, contents.serial, contents.result.get("parts") or {})
    new = [words for words in found if words not in contents.result.get("part_doubts", ())]
    return Step(f"the bench's store casts doubt on its parts: {'; '.join(new)}", False) if new else Step("")


def _sound(store: Store, contents: CertificateContent, when: datetime) -> Step:
    """Check the unit itself. Not complete if the store has a nonconformance that the certificate does not state, open
    or released; what was decided about one that it states as open is said beside its verdict. What was judged after it
    was signed is a later attempt."""
    stated, dispositions = (contents.result.get(key, ()) for key in ("nonconformances", "dispositions"))
    known = {*stated, *(words for given in dispositions for words in given["nonconformances"])}
    approved = (contents.provenance.get("approval") or {}).get("time")
    approval = Approval(f"{contents.spec_name}@{contents.spec_sha256}", approved) if approved else None
    entry = UnitEntry.from_json(contents.result)
    now = standing(store, contents.serial, {}, entry, when + SAME_SECOND, approval=approval)
    if new := [words for words in now.open if words not in stated]:
        return Step(f"the bench's store holds a nonconformance without a decision: {'; '.join(new)}", False)
    if new := [words for decided in now.released for words in decided.nonconformances if words not in known]:
        return Step(f"the bench's store holds a nonconformance that it does not state: {'; '.join(new)}", False)
    last = {words: decided for decided in now.decided for words in decided.nonconformances}
    later = [*dict.fromkeys(last[words] for words in stated if words in last)]
    remark = "; ".join(f"quality assurance decided: {CHOICES[each.disposition.choice]}" for each in later)
    return Step("; ".join(words_of(each) for each in later), remark=remark)


def _others(copy: Copy) -> str:
    return ", ".join(f"{other['serial']} {other['sample']}" for other in copy["with"])
