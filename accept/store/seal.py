"""The seal of the checked events: number and hash of the last one, signed with the bench's own key.

The seal saves the walk along the whole chain of a long store. It contains the state of the database at the check. For
SQLite that is the file itself with its log (inode, size and times of change), which a program without the rights of an
administrator cannot change unseen; for PostgreSQL it is the transactions that wrote the sealed rows. If they differ,
the whole chain is walked again. The head in a file beside the database reveals that a tail was cut off together with
the head's row."""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, PublicFormat
from sqlalchemy import URL, Connection, text

from accept.base.atomic_files import write_atomic, write_new
from accept.store import tables
from accept.store.chain import StoreHead
from accept.store.event import StoreError
from specs.files import json_of, read_bounded

OLDEST_S = 24 * 3600.0  # a seal is valid for a day: then the chain is walked whole, even if the file is unchanged


@dataclass(frozen=True)
class Seal:
    """The end of the chain when it was last checked. head: the last event that was checked. looks: state of the
    database at that time. made: time of sealing [s]."""

    head: StoreHead
    looks: str
    made: float

    def text(self) -> str:
        return json.dumps({"head": str(self.head), "looks": self.looks, "made": self.made}, sort_keys=True)


@dataclass(frozen=True)
class SignedHead:
    """A head with the bench's signature, both hexadecimal; in certificates and exported by `accept store head`."""

    head: StoreHead
    bench: str  # its public key
    signature: str

    def to_json(self) -> dict[str, Any]:
        return {"seq": self.head.seq, "hash": self.head.hash, "bench": self.bench, "signature": self.signature}


@dataclass(frozen=True)
class Sealer:
    """Reads and writes one seal. file: its path; key_file: the bench's own key, made if absent. The key belongs to no
    person and has no passphrase, so that a bench can work unattended: any user who can read it can seal."""

    file: Path
    key_file: Path

    def read(self, old_too: bool = False) -> Seal | None:
        """Return the seal; None if it is absent, not signed by this bench, or too old (unless `old_too`)."""
        try:
            inner = json_of(self.text_of(read_bounded(self.file)) or "")
            seal = Seal(StoreHead.parse(inner["head"]), str(inner["looks"]), float(inner["made"]))
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return seal if old_too or 0.0 <= time.time() - seal.made <= OLDEST_S else None

    def write(self, head: StoreHead, looks: str, made: float | None = None) -> None:
        """Write the seal. A bench with an unwritable folder has none: the chain is then walked every time."""
        seal = Seal(head, looks, time.time() if made is None else made).text()
        try:
            write_atomic(self.file, self.signed(seal), 0o600)
        except (OSError, ValueError):
            self.file.unlink(missing_ok=True)

    def signed(self, text: str) -> bytes:
        """Return a text with the bench's signature, on one line. Raises OSError, ValueError."""
        signature = own_key(self.key_file).sign(text.encode()).hex()
        return json.dumps({"sealed": text, "signature": signature}).encode()

    def text_of(self, signed: bytes) -> str | None:
        """Return the text that `signed` made, None if this bench did not sign it."""
        try:
            stored = json_of(signed)
            text = str(stored["sealed"])
            own_key(self.key_file).public_key().verify(bytes.fromhex(stored["signature"]), text.encode())
        except (OSError, ValueError, KeyError, TypeError, InvalidSignature):
            return None
        return text

    @property
    def bench(self) -> str:
        """Return the public key of the bench. Raises OSError."""
        return _public(own_key(self.key_file))

    def signed_head(self, head: StoreHead) -> SignedHead:
        """Return a head with the bench's signature. Raises OSError."""
        return SignedHead(head, self.bench, own_key(self.key_file).sign(_said(head)).hex())


def own_key(key_file: Path) -> Ed25519PrivateKey:
    """Return the bench's own key, made if absent. Raises OSError."""
    try:
        return _stored_key(key_file)
    except FileNotFoundError:
        pass
    raw = Ed25519PrivateKey.generate().private_bytes(Encoding.Raw, PrivateFormat.Raw, NoEncryption())
    try:
        key_file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        write_new(key_file, raw.hex().encode() + b"\n")
    except FileExistsError:
        pass  # another program made it meanwhile
    return _stored_key(key_file)


def _stored_key(key_file: Path) -> Ed25519PrivateKey:
    return Ed25519PrivateKey.from_private_bytes(bytes.fromhex(read_bounded(key_file).decode().strip()))


def bench_of(key_file: Path) -> str | None:
    """Return the public key of the bench whose key is in a file, as stated in heads; None if it is unreadable."""
    try:
        return _public(_stored_key(key_file))
    except (OSError, ValueError):
        return None


def _public(key: Ed25519PrivateKey) -> str:
    return key.public_key().public_bytes(Encoding.Raw, PublicFormat.Raw).hex()


def head_problem(given: Mapping[str, Any]) -> str | None:
    """Return why the signature of an exported head is invalid, None if it is valid. Raises KeyError, TypeError,
    ValueError."""
    head = StoreHead(int(given["seq"]), str(given["hash"]))
    try:
        Ed25519PublicKey.from_public_bytes(bytes.fromhex(given["bench"])).verify(
            bytes.fromhex(given["signature"]), _said(head)
        )
    except InvalidSignature:
        return "the head was changed after the bench signed it"
    return None


_INDEX_ROWS = """
UNION ALL SELECT CONCAT_WS(' ', '{0}', seq, count(*), min(xmin::text::bigint), max(xmin::text::bigint)) FROM {0}
WHERE seq <= :upto GROUP BY seq"""
_ROWS = f"""
SELECT encode(sha256(string_agg(looks, ' ' ORDER BY looks)::bytea), 'hex') FROM (
SELECT seq || ' ' || xmin::text AS looks FROM events WHERE seq <= :upto
{"".join(_INDEX_ROWS.format(index.name) for index in tables.INDEXES)}) AS rows
"""


def rows_look(connection: Connection, upto: int) -> str:
    """Return a hash of the transactions that wrote the rows up to an event and those of its indexes, on PostgreSQL. The
    server computes it."""
    return str(connection.scalar(text(_ROWS), {"upto": upto}))


def file_looks(database: Path) -> str:
    """Return the state of the file of an SQLite database and of its log of writes: inodes, sizes, times of change."""
    parts = []
    for path in (database, database.with_name(f"{database.name}-wal")):
        try:
            found = path.stat()
        except FileNotFoundError:
            continue
        if found.st_size or path == database:  # an empty log of writes is as good as none
            parts.append((found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns))
    return repr(parts)


def _said(head: StoreHead) -> bytes:
    return f"accept store head {head}".encode("ascii")


OWNER_WRITES = 0o644  # whatever the umask: another user of the machine must not write the reference of the check


@dataclass(frozen=True)
class Anchor:
    """File that holds one head. It is written after the commit, so it may lag behind the store but never lead it. Of a
    server each bench has one, of the last event that it wrote itself."""

    path: Path

    @classmethod
    def beside(cls, url: URL) -> "Anchor | None":
        """Return `store.head` beside `store.sqlite`; None for a server, a database in memory or an SQLite URI."""
        database = url.database or ":memory:"
        plain = url.get_backend_name() == "sqlite" and not database.startswith((":memory:", "file:"))
        return cls(Path(database).with_suffix(".head")) if plain else None

    def read(self) -> StoreHead | None:
        """Return the head, None if the file does not exist. Raises ValueError if the file holds no head."""
        try:
            return StoreHead.parse(read_bounded(self.path).decode("utf-8", "replace"))
        except FileNotFoundError:
            return None
        except ValueError as e:
            raise ValueError(f"{self.path.name} is damaged: {e}") from e

    def write(self, head: StoreHead) -> None:
        """Replace the head. Raises StoreError if the file cannot be written; the event is stored all the same."""
        try:
            write_atomic(self.path, f"{head}\n".encode("ascii"), OWNER_WRITES)
        except OSError as e:
            raise StoreError(f"{self.path}: cannot be written ({e.strerror}); event {head.seq} itself is stored") from e
