"""The list that benches publish: every judgement and every signature, open to inspection by anyone. It has serials as
hashes, and neither values nor verdicts.

A bench writes its part with `accept store publish FILE`: an entry for each judgement and each signature of its store,
and a signed checkpoint with the Merkle root over them. A holder of the authority's certificate and the file sees
whether a certificate is in its bench's store, and whether the unit was judged again since. A holder of an earlier file
sees that the new one was only appended to.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path, PurePath
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base.atomic_files import write_atomic
from accept.certificate.contents.content import canonical
from accept.certificate.trust import authority, merkle
from accept.certificate.trust.authority import BENCH, public_of
from accept.certificate.trust.revocation import CLOCK_SLACK
from accept.certificate.trust.revocation_record import stored_lists
from accept.store import Event, Store, StoreHead
from accept.store.payloads import KeysRevoked
from accept.units import attempt_number
from specs.errors import AcceptError
from specs.files import json_of, read_bounded

JUDGED, SIGNED, VOIDED = "unit_judged", "certificate_signed", "attempt_voided"
REVOKED = KeysRevoked.KIND
_STARTED = "attempt_started"
LARGEST = 200_000_000  # bytes of a list: half a million entries
LEAST = 24  # bytes of a list for each of its values: an entry has seven, three of them hashes
_KEYS = {"seq": int, "time": str, "what": str, "unit": str, "content": str, "event": str, "attempt": int}


class ListError(AcceptError, ValueError):
    """A published list that cannot be used; the text names the file and what is wrong."""


@dataclass(frozen=True)
class Entry:
    """One event. unit: hash of the serial; content: hash of the result, or of the signed certificate; event: hash in
    the store's chain; attempt: number of the judgement, 0 for a signature. A judgement that was declared void gives its
    content and attempt once more. Of a list of revoked keys: unit: hash of the authority's certificate; content: hash
    of the list; attempt: its number."""

    seq: int
    time: str
    what: str
    unit: str
    content: str
    event: str
    attempt: int = 0

    def leaf(self) -> bytes:
        """Return the hash of this entry in the tree."""
        return merkle.leaf_hash(json.dumps(vars(self), sort_keys=True, separators=(",", ":")).encode())


@dataclass(frozen=True)
class BenchList:
    """The list of one bench. bench: its certificate; head: of its store; time: of publishing, UTC, ISO 8601."""

    bench: x509.Certificate
    entries: tuple[Entry, ...]
    head: StoreHead
    time: str
    signature: str = ""

    @property
    def name(self) -> str:
        """The name of the bench."""
        return authority.person_of(self.bench)

    @property
    def published(self) -> datetime:
        """The time of publishing. A time without a zone is that of UTC."""
        when = datetime.fromisoformat(self.time)
        return when if when.tzinfo else when.replace(tzinfo=UTC)

    @cached_property
    def leaves(self) -> list[bytes]:
        """Return the hashes of the entries, in order."""
        return [entry.leaf() for entry in self.entries]

    def text(self) -> bytes:
        """Return the bytes that the bench signs: number of entries, their root, the head of its store, the time."""
        root = merkle.root(self.leaves).hex()
        return f"accept list\n{len(self.entries)}\n{root}\n{self.head}\n{self.time}\n".encode()

    def extends(self, earlier: "BenchList") -> bool:
        """Return whether an earlier list of the same bench is the beginning of this one, by a consistency proof."""
        if not earlier.entries:
            return True
        if len(earlier.entries) > len(self.entries):
            return False
        proof = merkle.consistency_proof(self.leaves, len(earlier.entries))
        sizes = len(earlier.entries), len(self.entries)
        return merkle.is_consistent(*sizes, merkle.root(earlier.leaves), merkle.root(self.leaves), proof)


def unit_key(serial: str) -> str:
    """Return the hash that stands for a serial in a list."""
    return hashlib.sha256(f"accept unit {serial}".encode()).hexdigest()


def entries_of(events: Iterable[Event]) -> tuple[Entry, ...]:
    """Return the entries of a store's events, in order."""
    found, judged = list[Entry](), dict[str, int]()
    started, since = dict[str, int](), dict[str, set[str]]()  # number of a unit's last attempt, folders judged since
    for event in events:
        if event.what == _STARTED:
            started[event.subject], since[event.subject] = int(event.data["number"]), set()
        if event.what == REVOKED:
            listed = KeysRevoked.of(event)
            digest = hashlib.sha256(listed.crl.encode()).hexdigest()
            found.append(Entry(event.seq, event.time, REVOKED, listed.authority, digest, event.hash, listed.number))
        if event.what not in (JUDGED, SIGNED, VOIDED) or not event.subject:
            continue
        content, attempt = str(event.data.get("sha256", "")), 0
        if event.what == JUDGED:
            judged[event.subject] = attempt = judged.get(event.subject, 0) + 1
            content = hashlib.sha256(canonical(event.data["result"])).hexdigest()
            path, others = str(event.data["path"]), since.setdefault(event.subject, set())
            others.add(path)
            # A folder of that name hides no attempt: its number is that of the last one, and no other was judged since.
            number = attempt_number(PurePath(path).name)
            if number is not None and number == started.get(event.subject) and others == {path}:
                attempt = number
        elif event.what == VOIDED:
            void = next((e for e in found if e.seq == event.data.get("judged")), None)
            content, attempt = (void.content, void.attempt) if void else ("", 0)
        found.append(Entry(event.seq, event.time, event.what, unit_key(event.subject), content, event.hash, attempt))
    return tuple(found)


def _is_signed(event: Event, ca: x509.Certificate) -> bool:
    """Return whether a list of revoked keys has the number that its event states, if it is of this authority: a
    number that it has not would make every newer list look old."""
    told = KeysRevoked.of(event)
    numbers = [listed.number for _, listed in stored_lists([event], ca)]
    return told.authority != authority.fingerprint(ca) or numbers == [told.number]


def publish(
    store: Store, path: Path, bench: x509.Certificate, key: Ed25519PrivateKey, ca: x509.Certificate
) -> BenchList:
    """Write what this bench's store holds into a list, beside the lists of other benches in the same file.

    ca: its authority. Raises ListError if the store does not continue what the bench published before, StoreError,
    OSError."""
    others = read(path) if path.exists() else []
    now = datetime.now(UTC).isoformat(timespec="seconds")
    events = (event for event in store.events() if event.what != REVOKED or _is_signed(event, ca))
    unsigned = BenchList(bench, entries_of(events), store.head(), now)
    for earlier in others:
        if public_of(earlier.bench) == public_of(bench) and not unsigned.extends(earlier):
            raise ListError(f"{path}: this bench published {len(earlier.entries)} entries that its store does not hold")
    new = BenchList(bench, unsigned.entries, unsigned.head, now, key.sign(unsigned.text()).hex())
    kept = [other for other in others if public_of(other.bench) != public_of(bench)]
    document = {"format": 1, "lists": [_to_json(one) for one in sorted([*kept, new], key=lambda one: one.name)]}
    write_atomic(path, json.dumps(document, indent=0).encode() + b"\n")
    return new


def read(path: Path) -> list[BenchList]:
    """Return the lists in a file. Raises ListError, OSError."""
    try:
        raw = read_bounded(path, LARGEST)
        values = sum(map(raw.count, (b"[", b"{", b",")))
        if values > 1000 + len(raw) // LEAST:  # empty lists would fill memory
            raise ListError(f"{path}: has {values} values in {len(raw)} bytes, more than any list of a bench")
        document = json_of(raw)
        if document["format"] != 1:
            raise ListError(f"{path}: has format {document['format']!r}, this program reads 1")
        return [_from_json(given) for given in document["lists"]]
    except ListError:
        raise  # it is a ValueError too
    except (KeyError, TypeError, ValueError) as e:
        raise ListError(f"{path}: is not a published list ({type(e).__name__}: {e})") from e


def check(lists: Sequence[BenchList], roots: Sequence[x509.Certificate], path: Path) -> None:
    """Raise ListError if a list is not signed, as it is, by a bench of a trusted authority, or is dated in the
    future."""
    for one in lists:
        if one.published > datetime.now(UTC) + CLOCK_SLACK:
            when = f"{one.published:%Y-%m-%d %H:%M} UTC"
            raise ListError(f"{path}: the list of {one.name} is dated {when}, in the future; fetch the list again")
        key = one.bench.public_key()
        if not any(authority.issued_by(one.bench, ca) for ca in roots) or authority.role_of(one.bench) != BENCH:
            raise ListError(f"{path}: the list of {one.name} is of no bench of a trusted authority")
        try:
            if not isinstance(key, Ed25519PublicKey):
                raise ListError(f"{path}: the key of {one.name} is of another kind")
            key.verify(bytes.fromhex(one.signature), one.text())
        except (InvalidSignature, ValueError) as e:
            raise ListError(f"{path}: the list of {one.name} was changed after the bench signed it") from e


def _to_json(one: BenchList) -> dict[str, Any]:
    return {
        "bench": one.bench.public_bytes(Encoding.PEM).decode("ascii"),
        "entries": [list(vars(entry).values()) for entry in one.entries],
        "head": str(one.head),
        "time": one.time,
        "root": merkle.root(one.leaves).hex(),
        "signature": one.signature,
    }


def _from_json(given: Mapping[str, Any]) -> BenchList:
    bench = x509.load_pem_x509_certificate(str(given["bench"]).encode("ascii"))
    entries: list[Entry] = []
    for row in given["entries"]:
        if len(row) != len(_KEYS) or any(type(v) is not kind for v, kind in zip(row, _KEYS.values(), strict=True)):
            raise ListError(f"entry {len(entries) + 1} is not of {', '.join(_KEYS)}")
        entries.append(Entry(*row))
    datetime.fromisoformat(given["time"])
    return BenchList(bench, tuple(entries), StoreHead.parse(given["head"]), given["time"], str(given["signature"]))
