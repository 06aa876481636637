"""Comparison of a certificate with the benches' published list: whether its bench's store holds it, and whether the
unit was judged since. It needs the authority's certificate and the file, and no store."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509

from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.outcome import Step
from accept.certificate.contents.provenance import Earlier, Replaced
from accept.certificate.trust.authority import public_of
from accept.certificate.trust.published_list import (
    JUDGED,
    SIGNED,
    VOIDED,
    BenchList,
    Entry,
    ListError,
    check,
    read,
    unit_key,
)
from accept.certificate.trust.revocation import Revoked, aged
from accept.certificate.verify.clock_check import runs_out, too_late
from accept.certificate.verify.stated_check import SAME_SECOND
from accept.certificate.verify.statements import OF_THE_RESULT

_PROVENANCE = ("attempt", "replaces", "earlier", "judged", "head")
_LISTED = (*(f"provenance.{name}" for name in _PROVENANCE), *OF_THE_RESULT)  # the result by its hash


def trusted_lists(paths: Sequence[Path], roots: Sequence[x509.Certificate]) -> list[BenchList]:
    """Return the newest list of each bench in these files. Earlier copies must be the beginning of later ones.

    Raises ListError, OSError."""
    newest: dict[str | None, BenchList] = {}
    for path in paths:
        lists = read(path)
        check(lists, roots, path)
        for one in lists:
            other = newest.setdefault(public_of(one.bench), one)
            longer, shorter = (one, other) if len(one.entries) > len(other.entries) else (other, one)
            if not longer.extends(shorter):
                raise ListError(f"{path}: the list of {one.name} was rewritten: an earlier copy is not its beginning")
            newest[public_of(one.bench)] = longer
    return list(newest.values())


def _doubt(one: BenchList, revoked: Sequence[Revoked]) -> str:
    """Return why a list is in doubt: the certificate of its bench was revoked before the list was published, or its key
    was lost, so that others may have signed it; "" if it is not."""
    for entry in revoked:
        if entry.serial_number == one.bench.serial_number and (entry.compromised or one.published >= entry.since):
            return f"the key of {one.name}, which signed its list, was revoked on {entry.since:%Y-%m-%d}"
    return ""


def check_list(
    signed: bytes,
    contents: CertificateContent,
    when: datetime,
    lists: Sequence[BenchList],
    revoked: Sequence[Revoked] = (),
) -> list[Step]:
    """Compare a certificate with the published lists.

    signed: the bytes up to the technician's signature, it included; when: its time; revoked: certificates of benches
    whose lists are in doubt. Steps are not complete if its bench's list is in doubt or lacks the certificate or its
    judgement, and if a later attempt is listed. A doubt about the list of another bench is said in the first line: that
    list may lack a later attempt."""
    bench = contents.stated.head_bench
    doubts = [(words, public_of(one.bench) == bench) for one in lists if (words := _doubt(one, revoked))]
    said = [Step(words, complete=not own, remark="" if own else words) for words, own in doubts]
    return [*said, *_comparison(signed, contents, when, lists)]


def _comparison(signed: bytes, contents: CertificateContent, when: datetime, lists: Sequence[BenchList]) -> list[Step]:
    bench = contents.stated.head_bench
    own = next((one for one in lists if public_of(one.bench) == bench), None)
    if own is None:
        return [Step("its bench published nothing in this list", complete=False)]
    mine = [e for e in own.entries if e.unit == unit_key(contents.serial)]
    digest = hashlib.sha256(signed).hexdigest()
    signature = next((e for e in mine if e.what == SIGNED and e.content == digest), None)
    if signature is None:
        older = datetime.fromisoformat(own.time).replace(microsecond=0) <= when  # a signature's time has whole seconds
        why = "was published before it was signed" if older else "does not hold it: it is not of that bench's store"
        return [Step(f"the list of {own.name} of {_minute(own.time)} {why}", complete=False)]
    judged = [e for e in mine if e.what == JUDGED and e.seq < signature.seq and e.content == contents.record_sha256]
    if not judged:
        return [Step(f"the list of {own.name} holds no judgement with this result", complete=False)]
    steps = [Step(f"the list of {own.name} of {_minute(own.time)}{aged(own.published)} holds judgement and signature")]
    if contents.stated.attempt != judged[-1].attempt:
        words = f"it states attempt {contents.stated.attempt or None}, the list of its bench {judged[-1].attempt}"
        steps.append(Step(words, complete=False))
    if problem := _problem_of_replaced(contents.stated.replaces, judged[-1], mine):
        steps.append(Step(f"{problem} (provenance.replaces)", complete=False))
    if problem := _problem_of_earlier(contents.stated.earlier, judged[-1], mine):
        steps.append(Step(f"{problem} (provenance.earlier)", complete=False))
    if contents.stated.judged not in ("", judged[-1].time):
        steps.append(Step(f"the list holds that it was judged on {_minute(judged[-1].time)}", complete=False))
    steps += _too_late(own, judged[-1], signature, contents)
    void = next((e for e in mine if e.what == VOIDED and e.content == judged[-1].content), None)
    if void is not None:
        words = f"the list says that this attempt was declared void, on {_minute(void.time)}"
        return [*steps, Step(words, complete=False, current=False)]
    if all(step.complete for step in steps):
        steps[0] = replace(steps[0], looked_up=_LISTED)
    return [*steps, _later(own, judged[-1], lists)]


def _too_late(own: BenchList, judged: Entry, signature: Entry, contents: CertificateContent) -> Iterator[Step]:
    """Yield that a calibration had run out by the order of the entries, whatever the clock said."""
    rows, now = (contents.record.calibration or {}).get("instruments", ()), datetime.now(UTC)
    for entry, what in ((judged, "its judgement"), (signature, "its signature")):
        times = [e.time for e in own.entries if e.seq < entry.seq]
        before = [max(given) for given in ([t for t in times if datetime.fromisoformat(t) <= now], times) if given]
        yield from too_late(what, datetime.fromisoformat(entry.time), before, runs_out(rows, None), now)


def _problem_of_replaced(stated: Replaced | None, judged: Entry, mine: Sequence[Entry]) -> str | None:
    """Return why the stated judgement before is not the one that the list has, None if it is. In the workflow an
    attempt may be judged more than once: then what it replaces is of the attempt before."""
    earlier = [e for e in mine if e.what == JUDGED and e.seq < judged.seq]
    if stated is None:
        first = all(e.attempt == judged.attempt for e in earlier)
        return None if first else "it states that it replaces nothing, the list holds an earlier judgement"
    other = [e for e in earlier if e.attempt != judged.attempt]
    if stated.time not in {e.time for e in (*earlier[-1:], *other[-1:])}:
        return f"it states that it replaces a judgement of {_minute(stated.time)}, which the list does not hold so"
    known = {e.content for e in mine if e.what == SIGNED and e.seq < judged.seq} | {None}
    if not {stated.certificate, stated.earlier_certificate or None} <= known:
        return "it states that it replaces a certificate that the list does not hold before it"
    return None


def _problem_of_earlier(stated: Earlier | None, judged: Entry, mine: Sequence[Entry]) -> str | None:
    """Return why the attempts before are not as many, or the last that was not accepted not of the time, as the list
    has; None if they are. An earlier program did not state them."""
    if stated is None:
        return None
    earlier = [e for e in mine if e.what == JUDGED and e.seq < judged.seq]
    if (total := sum(stated.verdicts.values())) != len(earlier):
        return f"it states {total} earlier judgements, the list holds {len(earlier)}"
    if (last := stated.not_accepted) is None:
        return None
    known = 1 <= last.attempt <= len(earlier) and earlier[last.attempt - 1].time == last.time
    return None if known else f"the list holds no judgement {last.attempt} of {_minute(last.time)}"


def _later(own: BenchList, judged: Entry, lists: Sequence[BenchList]) -> Step:
    """Compare with later judgements by any bench: the newest wins. Benches that share a store publish the same
    events."""
    since = datetime.fromisoformat(judged.time) + SAME_SECOND
    known = {e.event for e in own.entries}
    later = [
        entry
        for one in lists
        for entry in one.entries
        if entry.what == JUDGED
        and entry.unit == judged.unit
        and (
            entry.seq > judged.seq
            if one is own
            else entry.event not in known and datetime.fromisoformat(entry.time) > since
        )
    ]
    if later:
        last = max(later, key=lambda e: e.time)
        return Step(f"the list knows a later attempt, of {_minute(last.time)}", complete=False, current=False)
    oldest = min(lists, key=lambda one: one.published)
    return Step(f"the list knows no later attempt, up to {_minute(oldest.time)}{aged(oldest.published)}", current=True)


def _minute(text: str) -> str:
    return f"{text[:16].replace('T', ' ')} UTC"
