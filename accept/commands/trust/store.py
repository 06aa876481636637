"""`accept store`."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from accept.base.atomic_files import check_place
from accept.base.console import say
from accept.base.documents.listings import EventList, EventListed, StoreChecked
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.base.plain_text import one_line
from accept.certificate import DispositionError, InvalidCertificate, parse_disposition, read_certificate, read_contents
from accept.certificate.trust import keys
from accept.certificate.trust.published_list import publish
from accept.commands.answer import STDOUT, Answer, File, Remark, command
from accept.commands.options import FirstDay, JsonAnswer, LastDay, QaPassphrase
from accept.commands.trust.bench_keys import decision_signer
from accept.judging.reservations import decide, open_nonconformances, settle_copies, void
from accept.store import (
    BENCH_KEY,
    START,
    Event,
    StoreError,
    StoreHead,
    back_up,
    check_lines,
    head_problem,
    open_store,
    own_key,
    restore,
)
from accept.store.payloads import (
    BaselineSet,
    CertificateSigned,
    CopiesResolved,
    Disposition,
    NonconformanceDecided,
    SpecApproved,
    UnitJudged,
    payload_of,
)
from checks.verdict import UnitVerdict, Verdict
from specs.files import json_of
from specs.spec import listed_name


@dataclass(frozen=True)
class EventFilter:
    """Which events are listed."""

    who: Annotated[str | None, Option(help="Only of a person whose name holds this.")] = None
    what: Annotated[str | None, Option(help="Only events whose kind holds this, as nonconformance.")] = None
    word: Annotated[str | None, Option(help="Only events in whose payload this word stands.")] = None
    since: FirstDay = None
    until: LastDay = None


@command
def check(
    head: Annotated[Path | None, Option(help="An exported head, or a certificate that states one.")] = None,
    json: JsonAnswer = None,
) -> Answer:
    """Walk the chain of events. Names the first that is altered or missing."""
    kept = _kept_head(head) if head else None
    with open_store(check=False) as store:
        unbroken, lines = check_lines(store, kept)
    document = File(json, StoreChecked(unbroken, tuple(lines)))
    return Answer(document, *lines) if unbroken else Answer(document, *map(Remark, lines), exit=Exit.REJECTED)


def _kept_head(path: Path) -> StoreHead:
    """Return the head in a file that `accept store head` wrote, or in a certificate. Raises StoreError, OSError."""
    content = read_certificate(path)
    try:
        if content.startswith(b"%PDF-"):
            stated: Mapping[str, Any] | None = read_contents(content).provenance.get("head")
        else:
            stated = json_of(content)
        if stated is None:
            raise StoreError(f"{path}: states no head of a store")
        given = dict(stated)
        if "signature" in given and (problem := head_problem(given)):
            raise StoreError(f"{path}: {problem}")
        return StoreHead.parse(f"{given['seq']} {given['hash']}")
    except (ValueError, KeyError, TypeError, InvalidCertificate) as e:
        raise StoreError(f"{path}: holds no head of a store ({e})") from e


@command
def head(out: Annotated[Path | None, Option(help="File to write; else stdout.")] = None) -> Answer:
    """Export the signed head of the chain, to be kept elsewhere."""
    if out is not None:
        check_place(out, ".json")
    with open_store() as store:
        signed = store.signed_head()
    if signed is None or signed.head == START:
        raise StoreError("the store holds no event yet, so it has no head")
    words = f"event {signed.head.seq}: head in {out}; `accept store check --head {out}` holds the store against it"
    return Answer(File(out or STDOUT, signed.to_json()), Remark(words if out else ""))


@command
def publish_list(
    file: Annotated[Path, Argument(help="The list, shared with other benches; made if absent.")],
) -> Answer:
    """Publish the list of judgements and signatures. Hashes of this bench's events, for `accept verify --log FILE`."""
    ca = keys.ca(home())
    bench = keys.bench_certificate(home(), ca)
    if bench is None:
        raise keys.KeysError("this bench has no certificate of the authority: accept keys request --role bench")
    with open_store() as store:
        new = publish(store, file, bench, own_key(home() / BENCH_KEY), ca)
    return Answer(f"{new.name}: {len(new.entries)} entries up to event {new.head.seq} in {file}")


@command
def backup(file: Annotated[Path, Argument(help="File to write, with its head beside it.")]) -> Answer:
    """Copy the whole store into one file."""
    with open_store() as store:
        kept = back_up(store, file)
    return Answer(f"{kept.seq} events in {file}; its signed head in {file}.head.json")


@command
def take_back(file: Annotated[Path, Argument(help="A file that `accept store backup` wrote.")]) -> Answer:
    """Make a backup the bench's store; what was there is set aside."""
    if os.environ.get("ACCEPT_STORE_URL"):
        raise StoreError("ACCEPT_STORE_URL names another store; restore works on the file in the bench's folder")
    kept, aside = restore(file, home() / "store.sqlite")
    words = f"the store that was there is in {aside}"
    return Answer(f"restored: {kept.seq} events, head {kept.hash}", Remark(words) if aside else None)


@command
def copies() -> Answer:
    """List recordings filed in two places, and the decisions about them."""
    with open_store() as store:
        last = store.last_of_each(UnitJudged.KIND)
        found = [(event.subject, copy) for event in last for copy in UnitJudged.of(event).result.copies]
    lines = []
    for serial, copy in found:
        decision = copy["resolved"]
        words = "open" if decision is None else f"resolved by {decision['who']}: {decision['reason']}"
        lines.append(f"{serial}:{copy['sample']}  same samples as {_others(copy)}  {words}")
    left = sum(copy["resolved"] is None for _, copy in found)
    way = f"{left} open; `accept store resolve SERIAL --measured SERIAL --reason WORDS` decides where one belongs"
    return Answer(*lines, Remark(way), exit=Exit.INCOMPLETE if left else Exit.ACCEPTED)


def _others(copy: Mapping[str, Any]) -> str:
    return ", ".join(f"{w['serial']}:{w['sample']}" for w in copy["with"])


@command
def resolve_copies(
    serial: Annotated[str, Argument(help="A unit whose recording is filed elsewhere too.")],
    measured: Annotated[list[str], Option(help="Where it belongs: SERIAL, or SERIAL:section/input, of one unit.")],
    reason: Annotated[str, Option(help="Why it is filed in two places.")],
    passphrase_file: QaPassphrase = None,
) -> Answer:
    """Decide to which unit a recording belongs. Quality assurance signs the decision with its key."""
    signer = decision_signer(passphrase_file, reason)
    with open_store() as store:
        resolved = list(settle_copies(store, serial, measured, reason, signer))
    at = ", ".join(measured)
    lines = (f"{serial}:{copy['sample']} and {_others(copy)}: measured at {at}" for copy in resolved)
    return Answer(*lines, Remark("judge the units again: accept batch, or accept report"))


@command
def void_attempt(
    serial: Annotated[str, Argument(help="Serial of a unit.")],
    attempt: Annotated[int, Argument(min=1, help="Number of the attempt, as `accept history` shows it.")],
    reason: Annotated[str, Option(help="What was wrong with the attempt.")],
    passphrase_file: QaPassphrase = None,
) -> Answer:
    """Declare an attempt at a unit void. Quality assurance signs the decision with its key."""
    signer = decision_signer(passphrase_file, reason)
    with open_store() as store:
        verdict = void(store, serial, attempt, reason, signer)
    return Answer(
        f"{serial}: attempt {attempt}, '{verdict}', is void: {' '.join(reason.split())} ({signer().person})",
        Remark("it counts in no yield or chart, and its certificate is no longer valid; judge the unit again"),
    )


@command
def dispose(
    serial: Annotated[str, Argument(help="Serial of a unit that a nonconformance holds.")],
    disposition: Annotated[str, Option(help="use-as-is, rework, measure-again, return or scrap.")],
    because: Annotated[str, Option(help="Why: the reason of the disposition.")],
    passphrase_file: QaPassphrase = None,
) -> Answer:
    """Decide about a nonconformance that holds a unit. Quality assurance signs the decision with its key."""
    stated = parse_disposition(serial, UnitVerdict.CONDITIONAL, disposition, because)
    if stated is None:
        raise DispositionError(f"{serial} needs no disposition")
    signer = decision_signer(passphrase_file, because)
    with open_store() as store:
        held = open_nonconformances(store, serial, {})
        for words in held:
            say(f"{serial}: held by {one_line(words)}")
        decided = decide(store, serial, Disposition(stated.choice, stated.reason), signer, held)
    lines = (f"{serial}: {nonconformance}: {stated} ({signer().person})" for nonconformance in decided)
    return Answer(*lines, Remark("judge the unit again: accept batch, or accept report"))


@command
def log(
    serial: Annotated[str | None, Argument(help="Only events of this unit.")] = None,
    *,
    chosen: EventFilter,
    full: Annotated[bool, Option("--full", help="With payload and hash of every event.")] = False,
    json: JsonAnswer = None,
) -> Answer:
    """List who did what, when, by which spec and code."""
    with open_store(check=False) as store:
        problem = store.check()
        events = [event for event in store.events(subject=serial) if _is_chosen(event, chosen)]
    return Answer(
        Remark(f"warning: the store does not hold: {problem}" if problem else ""),
        File(json, lambda: EventList(not problem, str(problem) if problem else None, tuple(map(_event_row, events)))),
        *(line for event in events for line in _event_lines(event, full)),
        Remark("" if events else _no_event(serial, chosen)),
    )


def _is_chosen(event: Event, chosen: EventFilter) -> bool:
    who, what, day = chosen.who, chosen.what, event.time[:10]
    return (
        (who is None or who.casefold() in event.by.casefold())
        and (what is None or what in event.what)
        and (chosen.since is None or day >= chosen.since.date().isoformat())
        and (chosen.until is None or day <= chosen.until.date().isoformat())
        and (chosen.word is None or chosen.word.casefold() in f"{_verdict(event)} {event.payload}".casefold())
    )


def _no_event(serial: str | None, chosen: EventFilter) -> str:
    of = f" of a unit '{serial}'" if serial is not None else ""
    if any(value is not None for value in vars(chosen).values()):
        return f"no event{of} that is asked for"
    return f"no event{of}" if of else "no event yet"


def event_line(event: Event) -> str:
    """Return an event in words: number, time, who, what, unit, how it ended, spec and program."""
    spec = listed_name(event.spec)
    words = (str(event.seq), event.time[:19], event.by, event.what, event.subject, _verdict(event), spec)
    return "  ".join(word for word in (*words, f"code {event.code[:8]}") if word)


def _event_lines(event: Event, full: bool) -> Iterator[str]:
    yield event_line(event)
    if full:
        yield f"    spec {event.spec}  hash {event.hash}"
        yield f"    {event.payload}"


def _event_row(event: Event) -> EventListed:
    return EventListed(
        event.seq, event.time, event.who, event.what, event.subject, event.spec, event.code, event.hash,
        _verdict(event), event.data,
    )  # fmt: skip


def _verdict(event: Event) -> str:
    try:
        payload = payload_of(event)
    except StoreError as e:
        return str(e)
    match payload:
        case UnitJudged(result=result):
            deciding = ", ".join(f.quantity for f in result.findings if f.verdict is not Verdict.PASS)
            copies = ", ".join(str(c["sample"]) for c in result.copies if c["withheld"])
            shown = f"{result.verdict} ({deciding})" if deciding else str(result.verdict)
            why = f"; reason: {payload.reason}" if payload.reason else ""
            return (f"{shown}; copied: {copies}" if copies else shown) + why
        case CopiesResolved(measured=measured, reason=reason):
            return ", ".join((*map(" ".join, measured), reason))
        case NonconformanceDecided(disposition=decision):
            return f"{decision.choice}: {decision.reason}"
        case CertificateSigned(role=role, disposition=decision):
            why = f"{role}, because: {payload.reason}" if payload.reason else role
            return why if decision is None else f"{role}, {decision.choice}: {decision.reason}"
        case SpecApproved(approval=approval):
            return f"{approval.get('name')}: approved"
        case BaselineSet():
            return f"{payload.quantity}, {payload.group}: {payload.since} to {payload.until} {payload.reason}".rstrip()
    return str(getattr(payload, "reason", ""))
