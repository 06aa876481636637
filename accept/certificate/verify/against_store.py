"""What a bench's own store knows of a certificate: whether it still holds what the certificate states, whether the
program signed it, and whether its recordings were given for another unit too and its parts are in order."""

import hashlib
import os

from accept.base.home import home
from accept.certificate.contents.content import BEFORE, CertificateContent
from accept.certificate.contents.step import Step
from accept.judging.copies import Copy, copies_of
from accept.judging.parts import part_doubts
from accept.store import Store, StoreError, StoreHead, open_store
from accept.store.chain import START
from accept.store.opening import BENCH_KEY
from accept.store.seal import bench_of


def check_store(signed: bytes, contents: CertificateContent) -> list[Step]:
    """Ask the bench's store. signed: the bytes up to the technician's signature, it included. Not complete where the
    store cannot be asked or does not hold, and where this bench made the certificate and its store is gone."""
    if not _store_is_there():
        stated = (contents.provenance.get("head") or {}).get("bench")
        gone = stated is not None and stated == bench_of(home() / BENCH_KEY)
        return [Step("this bench made it, and its store is gone", complete=False)] if gone else []
    try:
        with open_store() as store:
            return [_held(store, signed, contents), _copied(store, contents), _built(store, contents)]
    except StoreError as e:
        return [Step(f"the bench's store could not be asked: {e}", complete=False)]


def _held(store: Store, signed: bytes, contents: CertificateContent) -> Step:
    """Not complete where the store of the bench that made it holds another event under the stated number, or nothing of
    this signature; and where neither is known. Of a certificate from before heads were stated nothing is expected."""
    head = contents.provenance.get("head")
    if head is not None:
        stated, own = StoreHead(int(head["seq"]), str(head["hash"])), store.signed_head()
        if not _holds(store, stated) or stated == START:
            if own is None or head["bench"] != own.bench:
                return Step("it was made at another bench, whose store is not this one")
            if stated != START:
                words = f"this bench's store does not hold event {stated.seq} as stated: it was put back or rewritten"
                return Step(f"{words} (accept store check --head)", complete=False)
    digest = hashlib.sha256(signed).hexdigest()
    if any(event.data["sha256"] == digest for event in store.events(contents.serial, "certificate_signed")):
        return Step("this bench's store holds that it was signed")
    if head is None and contents.format == BEFORE:
        return Step("")
    words = "this bench's store does not hold that it was signed: another program signed it, or this one was stopped"
    return Step(f"{words} before it had said so", complete=False)


def _holds(store: Store, head: StoreHead) -> bool:
    event = next(store.events(after=head.seq - 1), None)
    return event is not None and StoreHead(event.seq, event.hash) == head


def _copied(store: Store, contents: CertificateContent) -> Step:
    """Not complete where the store has a judgement of another unit by the same samples, nobody has said whose they are,
    and the certificate counts them."""
    samples = contents.result.get("samples") or {}
    if not samples:
        return Step("")
    found = copies_of(store, contents.serial, None, samples)
    stated = {copy["sample"] for copy in contents.result.get("copies", []) if copy["withheld"]}
    counted = [copy for copy in found if copy["withheld"] and copy["sample"] not in stated]
    if not counted:
        return Step("the bench's store holds its recordings for no other unit")
    same = "; ".join(f"{copy['sample']} is also {_others(copy)}" for copy in counted)
    return Step(f"its recordings were given for other units too, and nobody said whose they are: {same}", False)


def _built(store: Store, contents: CertificateContent) -> Step:
    """Not complete where the store knows something against its parts that the certificate does not state."""
    found = part_doubts(store, contents.serial, contents.result.get("parts") or {})
    new = [words for words in found if words not in contents.result.get("part_doubts", ())]
    return Step(f"the bench's store speaks against its parts: {'; '.join(new)}", False) if new else Step("")


def _others(copy: Copy) -> str:
    return ", ".join(f"{other['serial']} {other['sample']}" for other in copy["with"])


def _store_is_there() -> bool:
    """Whether there is a store to ask; none is made for it."""
    return bool(os.environ.get("ACCEPT_STORE_URL")) or (home() / "store.sqlite").exists()
