"""`accept store`."""

import json as jsonlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from accept.base.atomic_files import write_atomic
from accept.base.console import clear_errors, say, stdout, tell
from accept.base.documents.answers import check_answer, wants_text
from accept.base.documents.listings import EventList, EventListed, StoreChecked
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.certificate.contents.disposition import DispositionError, parse_disposition
from accept.certificate.contents.errors import InvalidCertificate
from accept.certificate.trust import keys
from accept.certificate.trust.published_list import publish
from accept.certificate.verify import attachments
from accept.certificate.verify.rejudge import read_certificate
from accept.certificate.verify.structure import read_unknown
from accept.commands.options import JsonAnswer, QaPassphrase
from accept.commands.trust.bench_keys import decision_signer
from accept.judging.copies import resolve
from accept.judging.nonconformance import decide
from accept.judging.voids import void
from accept.store import Event, StoreError, StoreHead, check_lines, fold, open_store
from accept.store.backup import back_up, restore
from accept.store.chain import START
from accept.store.opening import BENCH_KEY
from accept.store.payloads import (
    CertificateSigned,
    CopiesResolved,
    Decision,
    NonconformanceDecided,
    UnitJudged,
    payload_of,
)
from accept.store.seal import head_problem, own_key
from checks.verdict import UnitVerdict, Verdict


@clear_errors
def check(
    head: Annotated[Path | None, typer.Option(help="An exported head, or a certificate that states one.")] = None,
    json: JsonAnswer = None,
) -> Exit:
    """Walk the chain of events. Names the first that is altered or missing."""
    check_answer(json)
    kept = _kept_head(head) if head else None
    with open_store(check=False) as store:
        unbroken, lines = check_lines(store, kept)
    as_text = wants_text(json, StoreChecked(unbroken, tuple(lines)))
    for line in lines if as_text or not unbroken else ():
        (stdout.print if unbroken else say)(line)
    return Exit.ACCEPTED if unbroken else Exit.REJECTED


def _kept_head(path: Path) -> StoreHead:
    """Return the head in a file that `accept store head` wrote, or in a certificate. Raises StoreError, OSError."""
    content = read_certificate(path)
    try:
        if content.startswith(b"%PDF-"):
            stated: Mapping[str, Any] | None = read_unknown(attachments.read, content).provenance.get("head")
        else:
            stated = jsonlib.loads(content)
        if stated is None:
            raise StoreError(f"{path}: states no head of a store")
        given = dict(stated)
        if "signature" in given and (problem := head_problem(given)):
            raise StoreError(f"{path}: {problem}")
        return StoreHead.parse(f"{int(given['seq'])} {given['hash']}")
    except (ValueError, KeyError, TypeError, InvalidCertificate) as e:
        raise StoreError(f"{path}: holds no head of a store ({e})") from e


@clear_errors
def head(out: Annotated[Path | None, typer.Option(help="File to write; else stdout.")] = None) -> Exit:
    """Export the signed head of the chain, to be kept elsewhere."""
    check_answer(out)
    with open_store() as store:
        signed = store.signed_head()
    if signed is None or signed.head == START:
        raise StoreError("the store holds no event yet, so it has no head")
    text = jsonlib.dumps(signed.to_json(), indent=1) + "\n"
    if out is None:
        tell(*text.splitlines())
    else:
        write_atomic(out, text.encode())
        say(f"event {signed.head.seq}: head in {out}; `accept store check --head {out}` holds the store against it")
    return Exit.ACCEPTED


@clear_errors
def publish_list(
    file: Annotated[Path, typer.Argument(help="The list, shared with other benches; made if absent.")],
) -> Exit:
    """Publish the list of judgements and signatures. Hashes of this bench's events, for `accept verify --log FILE`."""
    ca = keys.ca(home())
    bench = keys.bench_certificate(home(), ca)
    if bench is None:
        raise keys.KeysError("this bench has no certificate of the authority: accept keys request --role bench")
    with open_store() as store:
        new = publish(store, file, bench, own_key(home() / BENCH_KEY))
    stdout.print(f"{new.name}: {len(new.entries)} entries up to event {new.head.seq} in {file}")
    return Exit.ACCEPTED


@clear_errors
def backup(file: Annotated[Path, typer.Argument(help="File to write, with its head beside it.")]) -> Exit:
    """Copy the whole store into one file."""
    with open_store() as store:
        kept = back_up(store, file)
    stdout.print(f"{kept.seq} events in {file}; its signed head in {file}.head.json")
    return Exit.ACCEPTED


@clear_errors
def take_back(file: Annotated[Path, typer.Argument(help="A file that `accept store backup` wrote.")]) -> Exit:
    """Make a backup the bench's store; what was there is set aside."""
    if os.environ.get("ACCEPT_STORE_URL"):
        raise StoreError("ACCEPT_STORE_URL names another store; restore works on the file in the bench's folder")
    kept, aside = restore(file, home() / "store.sqlite")
    stdout.print(f"restored: {kept.seq} events, head {kept.hash}")
    if aside is not None:
        say(f"the store that was there is in {aside}")
    return Exit.ACCEPTED


@clear_errors
def copies() -> Exit:
    """List recordings filed in two places, and the decisions about them."""
    open_ones = 0
    with open_store() as store:
        for serial, unit in sorted(fold(store.events()).units.items()):
            for copy in unit.result.copies:
                others = ", ".join(f"{w['serial']}:{w['sample']}" for w in copy["with"])
                decision = copy["resolved"]
                open_ones += decision is None
                words = "open" if decision is None else f"resolved by {decision['who']}: {decision['reason']}"
                tell(f"{serial}:{copy['sample']}  same samples as {others}  {words}")
    say(f"{open_ones} open; `accept store resolve SERIAL --measured SERIAL --reason WORDS` decides where one belongs")
    return Exit.INCOMPLETE if open_ones else Exit.ACCEPTED


@clear_errors
def resolve_copies(
    serial: Annotated[str, typer.Argument(help="A unit whose recording is filed elsewhere too.")],
    measured: Annotated[
        list[str], typer.Option(help="Where it belongs: SERIAL, or SERIAL:section/input, of one unit.")
    ],
    reason: Annotated[str, typer.Option(help="Why it is filed in two places.")],
    passphrase_file: QaPassphrase = None,
) -> Exit:
    """Decide to which unit a recording belongs. Quality assurance signs the decision with its key."""
    signer = decision_signer(passphrase_file, reason)
    with open_store() as store:
        for copy in resolve(store, serial, measured, reason, signer):
            others = ", ".join(f"{w['serial']}:{w['sample']}" for w in copy["with"])
            stdout.print(f"{serial}:{copy['sample']} and {others}: measured at {', '.join(measured)}")
    say("judge the units again: accept batch, or accept report")
    return Exit.ACCEPTED


@clear_errors
def void_attempt(
    serial: Annotated[str, typer.Argument(help="Serial of a unit.")],
    attempt: Annotated[int, typer.Argument(min=1, help="Number of the attempt, as `accept history` shows it.")],
    reason: Annotated[str, typer.Option(help="What was wrong with the attempt.")],
    passphrase_file: QaPassphrase = None,
) -> Exit:
    """Declare an attempt at a unit void. Quality assurance signs the decision with its key."""
    signer = decision_signer(passphrase_file, reason)
    with open_store() as store:
        verdict = void(store, serial, attempt, reason, signer)
    stdout.print(f"{serial}: attempt {attempt}, '{verdict}', is void: {' '.join(reason.split())} ({signer.person})")
    say("it counts in no yield or chart, and its certificate is no longer valid; judge the unit again")
    return Exit.ACCEPTED


@clear_errors
def dispose(
    serial: Annotated[str, typer.Argument(help="Serial of a unit that a nonconformance holds.")],
    disposition: Annotated[str, typer.Option(help="use-as-is, rework, measure-again, return or scrap.")],
    because: Annotated[str, typer.Option(help="Why: the reason of the disposition.")],
    passphrase_file: QaPassphrase = None,
) -> Exit:
    """Decide about a nonconformance that holds a unit. Quality assurance signs the decision with its key."""
    stated = parse_disposition(serial, UnitVerdict.CONDITIONAL, disposition, because)
    if stated is None:
        raise DispositionError(f"{serial} needs no disposition")
    signer = decision_signer(passphrase_file, because)
    with open_store() as store:
        decided = decide(store, serial, Decision(stated.choice, stated.reason), signer)
    for nonconformance in decided:
        stdout.print(f"{serial}: {nonconformance}: {stated} ({signer.person})")
    say("judge the unit again: accept batch, or accept report")
    return Exit.ACCEPTED


@clear_errors
def log(
    serial: Annotated[str | None, typer.Argument(help="Only events of this unit.")] = None,
    full: Annotated[bool, typer.Option("--full", help="With payload and hash of every event.")] = False,
    json: JsonAnswer = None,
) -> Exit:
    """List who did what, when, by which spec and code."""
    check_answer(json)
    found, as_text = False, True
    with open_store(check=False) as store:
        if problem := store.check():
            say(f"warning: the store does not hold: {problem}")
        if json is not None:
            listed = tuple(_event_row(event) for event in store.events(subject=serial))
            as_text = wants_text(json, EventList(problem is None, None if problem is None else str(problem), listed))
            found = bool(listed)
        for event in store.events(subject=serial) if as_text else ():
            found = True
            spec = event.spec.split("@")[0]
            words = (str(event.seq), event.time[:19], event.by, event.what, event.subject, _verdict(event), spec)
            tell("  ".join(word for word in (*words, f"code {event.code[:8]}") if word))
            if full:
                tell(f"    spec {event.spec}  hash {event.hash}", f"    {event.payload}")
    if not found:
        say("no event yet" if serial is None else f"no event of a unit '{serial}'")
    return Exit.ACCEPTED


def _event_row(event: Event) -> EventListed:
    return EventListed(
        event.seq, event.time, event.who, event.what, event.subject, event.spec, event.code, event.hash,
        _verdict(event), event.data,
    )  # fmt: skip


def _verdict(event: Event) -> str:
    """Return the details of an event for an auditor: the verdict and its causes, the role of a signature, a reason."""
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
    return str(getattr(payload, "reason", ""))
