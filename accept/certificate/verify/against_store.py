"""Comparison of a certificate with a bench's own store: whether it holds the judgement and the signature as stated,
whether the unit was judged since, whether its recordings were given for another unit too, and whether its parts are in
order."""

import hashlib
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from itertools import islice
from pathlib import PurePath

from cryptography import x509

from accept.base.documents.results import ALIKE, UnitRecord
from accept.base.home import home
from accept.base.names import same_person
from accept.base.plain_text import listed
from accept.base.spelling import difference, spelling_key
from accept.base.version import code_sha256
from accept.capture.reference_check import history
from accept.certificate.contents.content import BEFORE, CertificateContent, same_json
from accept.certificate.contents.laboratory import number_of
from accept.certificate.contents.outcome import InvalidCertificate, Step, quoted
from accept.certificate.contents.provenance import History, differences
from accept.certificate.trust import keys
from accept.certificate.trust.approved_spec import NOT_APPROVED
from accept.certificate.trust.provenance import amended, ends_before, replaced_by_next, values_before
from accept.certificate.trust.revocation_record import store_is_there, stored_lists
from accept.certificate.trust.spec_approval import Approved, approval_number, approvals, is_approved
from accept.certificate.verify.clock_check import runs_out, too_late
from accept.certificate.verify.signatures import Signed
from accept.certificate.verify.stated_check import SAME_SECOND
from accept.certificate.verify.statements import LOOKED_UP
from accept.fleet import BenchStopped, check_may_judge
from accept.judging.reservations import (
    RELEASING,
    Approval,
    copies_of,
    counted,
    part_doubts,
    parts_below,
    rereadings,
    standing,
    unconfirmed,
    voids,
)
from accept.store import BENCH_KEY, START, Event, Store, StoreError, StoreHead, bench_of, fold, open_store
from accept.store.decisions import words_of
from accept.store.payloads import (
    CHOICES,
    KINDS,
    VOIDED,
    AttemptStarted,
    BenchStated,
    CertificateSigned,
    InstrumentChecked,
    KeysRevoked,
    NonconformanceDecided,
    SerialConfirmed,
    UnitJudged,
)
from accept.units import attempt_number
from checks.verdict import UnitVerdict, Verdict
from specs.spec import parse

_Signatures = Sequence[tuple[Signed, Event]]  # with the event that tells of each, or of one before it
_Authorities = Sequence[x509.Certificate]
_LOOKED_AT = 50  # judgements before, for a bench file: reading all of a store would take seconds for each certificate
_ELSEWHERE = Step("it was made at another bench, whose store is not this one")


def check_store(
    pdf: bytes,
    contents: CertificateContent,
    signatures: Sequence[Signed],
    again: UnitRecord | None,
    roots: _Authorities,
) -> list[Step]:
    """Compare a certificate with the bench's store.

    again: the unit as it was judged again from the attached records, None if it was not; roots: trusted authorities. A
    step is not complete if the store cannot be asked or does not hold, and if this bench made the certificate and its
    store is gone."""
    stated = contents.stated.head_bench
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
            events = list(counted(store, store.events(contents.serial)))
            stored = {e.data["sha256"]: e for e in reversed(events) if e.what == CertificateSigned.KIND}
            told = [stored.get(hashlib.sha256(pdf[: s.place[2]]).hexdigest()) for s in signatures]
            held, signature = _held(store, contents, told[0], here), told[0]
            if signature is None:
                history = [*_later_than(events, signatures[0].when), *_alike(store, contents, complete=True)]
            else:
                by = [(s, event or signature) for s, event in zip(signatures, told, strict=True)]
                history = _history(store, events, contents, by, roots)
            if held is _ELSEWHERE or not held.complete:  # what was told to this store weakens, and proves nothing
                history = [
                    replace(step, looked_up=(), current=None if step.current else step.current) for step in history
                ]
            judged = (e for e in events if signature is not None and e.seq == signature.data.get("judged"))
            path = next((str(e.data["path"]) for e in judged if e.what == UnitJudged.KIND), None)
            compared = [*_reserved(store, contents, again, signature, path), *_parts(store, contents, roots)]
            compared += _newer_spec(store, contents, signature, signatures[0].when, roots)
            other = [Step(problem, complete=stated != certified)] if problem else []
            return [*other, held, *history, *_unread((*events, *store.events(""))), *compared]
    except StoreError as e:
        return [Step(f"the bench's store could not be asked: {e}", complete=False)]


def _held(store: Store, contents: CertificateContent, signature: Event | None, here: bool) -> Step:
    """Check that the store holds the signature. Not complete if the store of the bench that made it, wherever it is
    asked, has another event under the stated number, or no event of this signature; and if neither is known. A
    certificate from before heads were stated is not checked. here: this bench made it, whatever store is asked."""
    head = contents.stated.head
    if head is not None:
        stated = StoreHead(head.seq, head.hash)
        there = [StoreHead(each.seq, each.hash) for each in islice(store.events(after=stated.seq - 1), 1)]
        if there != [stated] or stated == START:
            wrote = (*store.events("", BenchStated.KIND), *store.newest(UnitJudged.KIND, 1))
            its_own = head.bench in {e.data.get("bench") for e in wrote} and (stated != START or signature is None)
            if not its_own and not here:
                return _ELSEWHERE
            if stated != START:
                words = f"this bench's store does not hold event {stated.seq} as stated: it was put back or rewritten"
                return Step(f"{words} (accept store check --head)", complete=False)
    if signature is not None:
        return Step("this bench's store holds that it was signed")
    if head is None and contents.format == BEFORE:
        return Step("")
    words = "this bench's store does not hold that it was signed: another program signed it, or this one was stopped"
    return Step(f"{words} before it had said so", complete=False)


def _history(
    store: Store, events: Sequence[Event], contents: CertificateContent, by: _Signatures, roots: _Authorities
) -> list[Step]:
    signature = by[0][1]
    named = signature.data.get("judged")  # earlier programs do not name the judgement that was signed
    before = [e for e in events if e.what == UnitJudged.KIND and e.seq < signature.seq and named in (None, e.seq)]
    own = next((e for e in reversed(before) if same_json(e.data["result"], contents.result)), None)
    if own is None:
        return [Step("this bench's store holds no judgement with this result", complete=False)]
    signed = {e.seq: CertificateSigned.of(e) for e in events if e.what == CertificateSigned.KIND}
    if (number := contents.stated.number) and (bearing := sum(each.number == number for each in signed.values())) != 1:
        words = f"this bench's store knows {bearing} certificates of the unit with the number {number}, expected one"
        return [Step(words, complete=False)]
    own_program = contents.code_sha256 == code_sha256()
    known = _known(events, own, CertificateSigned.of(signature), contents)
    same = {
        "operator": same_person(own.who, contents.operator),
        "spec": own.spec == contents.spec_with_hash,
        "code": own.data["code_sha256"] == contents.code_sha256,
    }
    wrong = [name for name, is_same in same.items() if not is_same]
    wrong += differences(contents.stated, known, own_program)
    if own_program:  # earlier programs did not store what a bench states
        found = [differences(contents.stated, each) for each in _at_bench(store, known, own, signature, contents)]
        wrong += sorted(found or [["statement of the bench"]], key=len)[0]
    words = f"this bench's store has another {', another '.join(wrong)} than stated"
    if (void := voids(store, own.subject).get(own.seq)) is not None:
        return [Step(f"quality assurance declared this attempt void: {void.words}", complete=False, current=False)]
    compared = f"attempt, what it replaces{' and what its bench states' if own_program else ''}"
    right = f"operator, spec, code, {compared}: as in this bench's store"
    return [
        Step(words, complete=False) if wrong else Step(right, looked_up=LOOKED_UP if own_program else ()),
        *(Step("", remark=words) for words in _unsigned(events, own.seq)),
        *_put_away(store, contents, own),
        *_uncalibrated(store, contents, own),
        *_later([e for e in events if e.what == UnitJudged.KIND and e.seq > own.seq]),
        *_made_up(store, contents, own),
        *_too_late(store, contents, own, by, roots),
    ]


def _unsigned(events: Sequence[Event], judged: float = math.inf) -> Iterator[str]:
    """Yield what was against a unit before an event, but for its attempts, and what ended it: a store takes any
    judgement and any confirmed serial, and quality assurance signs neither."""
    signed = [CertificateSigned.of(e) for e in events if e.what == CertificateSigned.KIND and e.seq < judged]
    choices = dict.fromkeys(each.disposition.choice for each in signed if each.disposition)
    if named := [CHOICES.get(each, quoted(each)) for each in choices if each not in RELEASING]:
        yield f"quality assurance decided before it was judged: {listed(named)}"
    if told := {quoted(e.by) for e in events if e.what == SerialConfirmed.KIND and SerialConfirmed.of(e).unlike}:
        yield f"its serial, which looks like another, was confirmed by {listed(sorted(told))}"


def _put_away(store: Store, contents: CertificateContent, own: Event) -> Iterator[Step]:
    """Yield that its bench named a laboratory before, whose reports quality assurance releases, and not for this one:
    who puts its file away needs no release."""
    told = [e for e in store.events("", BenchStated.KIND) if e.seq < own.seq and BenchStated.of(e).laboratory]
    mine = [e for e in told if e.data["bench"] == contents.stated.head_bench]
    if mine and contents.stated.laboratory is None:
        yield Step("", remark=f"its bench named a laboratory before, last on {mine[-1].time[:10]}")


def _uncalibrated(store: Store, contents: CertificateContent, own: Event) -> Iterator[Step]:
    """Yield that no calibration is stated where one of its bench's last judgements stated one for the same checks: who
    leaves the bench file out would hide that an instrument has expired."""
    days = {each.check: contents.record.measured.get(each.check, own.time[:10]) for each in contents.record.findings}
    bench = contents.stated.head_bench or ""  # who wrote the judgement may have left its bench out
    stated = contents.record.calibration is not None
    for event in () if stated else store.newest(UnitJudged.KIND, _LOOKED_AT, own.seq, bench):
        result = event.data.get("result")
        if event.data.get("bench", "") != bench or (isinstance(result, dict) and not result.get("calibration")):
            continue  # of another bench, or states none either: it is not decoded
        given = UnitJudged.of(event).result.calibration or {}
        if rows := [row for row in given.get("instruments", ()) if row["check"] in days]:
            ended = {f", expired on {row['due']}" for row in rows if (row["due"] or "9999") < days[row["check"]]}
            names = listed(sorted({quoted(row["name"]) for row in rows}))
            words = f"no calibration is stated, and its bench stated that of {names} on {given['on']}"
            yield Step(words + "".join(sorted(ended)), not ended, remark="" if ended else words)
            return


def _decided(given: Sequence[NonconformanceDecided], stated: Collection[str] = ()) -> list[NonconformanceDecided]:
    """Return the last decisions about these nonconformances, and those that release no unit, whatever holds it now."""
    last = {words: each for each in given for words in each.nonconformances}
    return [*dict.fromkeys(d for w, d in last.items() if w in stated or d.disposition.choice not in RELEASING)]


def _decided_words(decided: NonconformanceDecided) -> str:
    return f"quality assurance decided: {CHOICES[decided.disposition.choice]}"


def _unread(events: Iterable[Event]) -> list[Step]:
    """Return the step on events of other kinds, which may hold anything against a unit, or against all of a bench."""
    unknown = [event for event in events if event.what not in KINDS]
    words = (
        f"the bench's store has {listed([quoted(e.name) for e in unknown])}, of a kind that this program does not know"
    )
    of_bench = not any(event.subject for event in unknown)
    return [Step(words, of_bench, remark=words if of_bench else "")] if unknown else []


def _newer_spec(
    store: Store, contents: CertificateContent, signature: Event | None, signed: datetime, roots: _Authorities
) -> list[Step]:
    """Return that quality assurance had approved a newer version of the spec when it was signed: an approval of before
    holds still. Events count in their order; the times of two approvals only if the store lacks one of them."""
    if not (stated := contents.stated.approval or {}).get("time"):
        return []
    own = Approved(dict(stated), approval_number(store, stated))
    for each in approvals(store, home(), contents.spec_name, roots).values():
        in_time = datetime.fromisoformat(each.time) <= signed  # both in whole seconds
        if each.is_after(own) and (each.seq < signature.seq if signature and each.seq else in_time):
            return [Step("", remark=f"a newer version of its spec was approved on {each.time[:10]}")]
    return []


def _alike(store: Store, contents: CertificateContent, complete: bool) -> Iterator[Step]:
    """Yield that the serial is taken for one of before, which another bench need not know. complete: of that one."""
    if (others := unconfirmed(store, contents.serial)) and ALIKE not in contents.record.folder:
        words = f"nobody told its serial apart: {difference(contents.serial, others[0])}"
        yield Step(words, complete, remark=words if complete else "")


def _made_up(store: Store, contents: CertificateContent, own: Event) -> Iterator[Step]:
    """Yield what a program left out or made up that did not ask the store: a similar serial of before, a stop by golden
    units, a simulated attempt, comparisons with a reference."""
    serial, entry = contents.serial, contents.record
    yield from _alike(store, contents, complete=False)
    try:
        check_may_judge(store, serial, contents.stated.head_bench or "", own.seq)
    except BenchStopped as e:
        yield Step(f"its bench was stopped when it judged it: {e}", complete=False)
    begun = map(AttemptStarted.of, store.events(serial, AttemptStarted.KIND))
    if simulated := {each.number for each in begun if each.simulated and not entry.simulated}:
        its = attempt_number(PurePath(str(own.data["path"])).name) in simulated  # a folder can be renamed
        words = f"the bench's store has {'its' if its else 'an'} attempt as one that no instrument measures"
        yield Step(words, complete=not its, remark="" if its else words)
    compared = [e for e in store.events(what=InstrumentChecked.KIND) if e.seq < own.seq]
    for row in (entry.calibration or {}).get("instruments", ()):
        if (last := row.get("reference")) is None:
            continue
        known = [c for c in history(compared, row["name"], row["serial"]) if c.time[:10] <= row["measured"]]
        places = [n for n, c in enumerate(known) if (c.time[:10], c.E_n) == (last["day"], last["E_n"])]
        if not places or not all(c.passed for c in known[places[-1] + 1 :]):
            what = "a later comparison, not passed," if places else "no comparison"
            words = f"the bench's store has {what} of {row['name']} with its reference on {last['day']}"
            yield Step(words, complete=False)
        elif failed := [c.time[:10] for c in known if not c.passed and c.time[:10] >= (row.get("calibrated") or "")]:
            yield Step("", remark=f"{quoted(row['name'])} missed its reference before, last on {failed[-1]}")


def _too_late(
    store: Store, contents: CertificateContent, own: Event, by: _Signatures, roots: _Authorities
) -> Iterator[Step]:
    """Yield what the order of the events shows, whatever the clock said: a calibration or a key had run out when the
    unit was judged or signed, or a key was revoked."""
    rows = (contents.record.calibration or {}).get("instruments", ())
    lists = [each for ca in roots for each in stored_lists(store.events("", KeysRevoked.KIND), ca)]
    signed = [(event, signer.when, signer) for signer, event in by]
    for event, when, signer in ((own, datetime.fromisoformat(own.time), None), *signed):
        times, number = store.latest_times(event.seq), signer and signer.certificate.serial_number
        yield from too_late(event.name, when, times, runs_out(rows, signer), datetime.now(UTC))
        for revoked, entry in ((e, entry) for e, keys_of in lists for entry in keys_of.entries):
            known = revoked.seq < event.seq and entry.since.isoformat() <= max(revoked.time, *times[:1])
            if signer is not None and entry.serial_number == number and known:
                where = f"was revoked in this bench's store, event {revoked.seq}, before it signed"
                yield Step(f"the key of {signer.person} {where}", complete=False)
                break  # later lists have it too


def _known(events: Sequence[Event], own: Event, signature: CertificateSigned, contents: CertificateContent) -> History:
    earlier = [e for e in events if e.seq < own.seq]
    started = [e for e in earlier if e.what == AttemptStarted.KIND]
    before = fold(earlier)
    numbers, replaced = {1 if before is None else before.attempts + 1}, [before]
    if started and _is_of_attempt(own, started[-1], earlier):
        numbers.add(int(started[-1].data["number"]))  # in the workflow an attempt may be judged more than once
        replaced.append(fold(earlier, before=started[-1].seq))
    return History(
        own.time, own.data.get("reason"), signature.reason, numbers,
        [(replaced_by_next(each), values_before(each)) for each in replaced],
        ends_before(before), amended(own.subject, before, contents.record),
        parse(contents.spec_text.encode(), "the attached spec").checks,
    )  # fmt: skip


def _at_bench(
    store: Store, known: History, own: Event, signature: Event, contents: CertificateContent
) -> Iterator[History]:
    """Yield everything that the bench stated of itself from the judgement until the signature: it states something
    else since its laboratory.toml, say, was changed."""
    bench = contents.stated.head_bench
    events = [e for e in store.events("", BenchStated.KIND) if e.data["bench"] == bench and e.seq < signature.seq]
    years = {datetime.fromisoformat(e.time).year for e in (own, signature)}
    for event in [*[e for e in events if e.seq < own.seq][-1:], *(e for e in events if e.seq > own.seq)]:
        stated = BenchStated.of(event)
        scheme = (stated.laboratory or {}).get("certificate_number")
        if scheme and not contents.stated.attempt:
            raise InvalidCertificate("the attempt that its number names is not stated (provenance.attempt)")
        of_attempt = (contents.serial, contents.stated.attempt)
        numbers = [number_of(scheme, *of_attempt, year, ()) for year in years] if scheme else [""]
        yield replace(known, bench=stated, numbered=numbers)


def _is_of_attempt(own: Event, started: Event, earlier: Sequence[Event]) -> bool:
    """Return whether a judgement is one of the workflow's attempt that was started last: its folder has the attempt's
    number, and no other folder of the unit was judged in between. Else a folder of that name would hide an attempt."""
    if attempt_number(PurePath(str(own.data["path"])).name) != started.data["number"]:
        return False
    return all(e.data["path"] == own.data["path"] for e in earlier if e.what == UnitJudged.KIND and e.seq > started.seq)


def _later_than(events: Sequence[Event], signed: datetime) -> list[Step]:
    """Return later judgements for a certificate whose signature this store does not hold, such as one of another bench:
    those after it was signed. If there are none here, its own bench may have some: nothing is known. The first line
    names the last one before that was not accepted, which the certificate need not state."""
    later = [e for e in events if e.what == UnitJudged.KIND and datetime.fromisoformat(e.time) > signed + SAME_SECOND]
    before, decided = fold(events), [Step("", remark=words) for words in _unsigned(events)]
    if later or before is None or before.ended[-1][1] in (UnitVerdict.ACCEPTED, VOIDED):
        return [*decided, *_later(later)] if later else decided
    when, verdict = before.time[:16].replace("T", " "), before.ended[-1][1]
    words = f"this bench's store has a judgement of {when} UTC, '{verdict}', that it does not know"
    return [*decided, Step(words, remark=words)]


def _later(judged: Sequence[Event]) -> list[Step]:
    """Return the step on later judgements: the newest wins, so a certificate of an earlier one is never plainly
    valid."""
    if not judged:
        return [Step("this bench's store knows no later attempt", current=True)]
    last = judged[-1]
    verdict, when = last.data["result"]["verdict"], last.time[:19].replace("T", " ")
    return [Step(f"this bench's store knows a later attempt: of {when} UTC, '{verdict}'", False, current=False)]


def _reserved(
    store: Store, contents: CertificateContent, again: UnitRecord | None, signature: Event | None, folder: str | None
) -> Iterator[Step]:
    """Compare what the store holds against recordings, parts and unit with what the certificate states of it. Not
    complete if the store holds more, or has not what the certificate states in the unit's favour: a decision, a
    recording that was read otherwise and passed. What was decided about a nonconformance that it states as open is said
    beside its verdict; what was judged after the store had the signature is a later attempt.

    The samples are those of the attached records too, whatever the result states. folder: where the unit was judged,
    None if unknown."""
    entry, serial, is_held = contents.record, contents.serial, signature is not None
    samples = {**entry.samples, **(again.samples if again is not None else {})}
    withheld = {copy["sample"] for copy in entry.copies if copy["withheld"]}
    copies = [c for c in copies_of(store, serial, folder, samples) if c["withheld"] and c["sample"] not in withheld]
    if samples and not copies:
        yield Step("the bench's store holds its recordings for no other unit")
    others = (", ".join(f"{other['serial']} {other['sample']}" for other in copy["with"]) for copy in copies)
    same = [f"{copy['sample']} is also {where}" for copy, where in zip(copies, others, strict=True)]
    where = "for other units too, or elsewhere, without a decision of quality assurance"
    yield from _lacks(f"its recordings were given {where}", same)
    read = rereadings(store, serial, entry.samples, entry.findings, contents.inputs)
    passed = {f.quantity for f in entry.findings if f.verdict is Verdict.PASS}
    otherwise = [r["words"] for quantity, r in read.items() if r["was"] != Verdict.PASS and quantity in passed]
    favours = [(q, r) for q, r in entry.rereadings.items() if is_held and r["was"] == Verdict.PASS]
    otherwise += [f"not '{r['words']}'" for quantity, r in favours if read.get(quantity) != r]
    yield from _lacks("the bench's store has the same recording, read otherwise", otherwise)
    doubts = [words for words in part_doubts(store, entry) if words not in entry.part_doubts]
    yield from _lacks("the bench's store casts doubt on its parts", doubts)
    stated, spec = contents.stated.approval or {}, contents.spec_with_hash
    approval = Approval(spec, stated["time"], approval_number(store, stated)) if stated.get("time") else None
    now = standing(store, serial, {}, entry, None if signature is None else signature.seq, approval=approval)
    given = [*map(NonconformanceDecided.from_json, entry.dispositions)]
    known = {*entry.nonconformances, *(words for each in given for words in each.nonconformances)}
    unknown = [words_of(each) for each in given if is_held and each not in now.decided]
    yield from _lacks("the bench's store holds no such decision", unknown)
    undecided = [words for words in now.open if words not in entry.nonconformances]
    yield from _lacks("the bench's store holds a nonconformance without a decision", undecided)
    released = [words for each in now.released for words in each.nonconformances if words not in known]
    yield from _lacks("the bench's store holds a nonconformance that it does not state", released)
    later = _decided(now.decided, entry.nonconformances)
    yield Step("; ".join(map(words_of, later)), remark="; ".join(map(_decided_words, later)))


def _lacks(words: str, found: Sequence[str]) -> Iterator[Step]:
    if found:
        yield Step(f"{words}: {'; '.join(found)}", complete=False)


def _parts(store: Store, contents: CertificateContent, roots: _Authorities) -> Iterator[Step]:
    """Yield what the store has of the parts, and of theirs, and raises no doubt: what held before the judgement that
    accepted each, a spec without approval, parts that are left out now."""
    named = [*map(spelling_key, contents.record.parts.values())]
    yield from (Step("", remark=f"it {words}") for words in _left_out(store, contents.serial, contents.record.parts))
    for name, part, within, last in parts_below(store, contents.record):
        events = list(counted(store, store.events(part)))
        yield from _unread(events)
        said = ["has events here and was never judged"] if events else []
        if last is not None:
            said, ends = [*_unsigned(events, last.seq)], ends_before(fold(events, before=last.seq))
            if ends and ends.not_accepted and last.data["result"]["verdict"] == UnitVerdict.ACCEPTED:
                said.append(ends.not_accepted.words)
            if not is_approved(store, home(), last.spec, UnitJudged.of(last).result.models, roots):
                by = quoted(last.spec.partition("@")[0])
                said.append(f"was {last.data['result']['verdict']} by {by}, {NOT_APPROVED}")
            said += _left_out(store, part, UnitJudged.of(last).result.parts)
        said += map(_decided_words, _decided(standing(store, part, {}).decided))
        said += ["stands in two places"] if named.count(spelling_key(part)) > 1 else []
        others = [quoted(one) for one in store.naming(part) if one != within[-1]]
        said += [f"has stood in {listed(others)}"] if others else []
        yield from (Step("", remark=f"{quoted(f'{name} {part}')}: {words}") for words in said)


def _left_out(store: Store, serial: str, parts: Mapping[str, str]) -> list[str]:
    """Return that a unit was judged with parts before, in whose places it names none: what speaks against them would
    speak against it."""
    void, before = voids(store, serial), dict[str, str]()
    for event in store.events(serial, UnitJudged.KIND):
        before |= {} if event.seq in void else UnitJudged.of(event).result.parts
    gone = [quoted(f"{place} {part}") for place, part in sorted(before.items()) if place not in parts]
    return [f"was judged with {listed(gone)} before and names nothing in the place now"] if gone else []
