"""The head in a file beside the database: it reveals that a tail was cut off together with the head's row."""

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import URL

from accept.base.atomic_files import write_atomic
from accept.store.chain import StoreHead
from accept.store.errors import StoreError
from specs.files import read_bounded

OWNER_WRITES = 0o644  # whatever the umask: another user of the machine must not write the reference of the check


@dataclass(frozen=True)
class Anchor:
    """File that holds one head. It is written after the commit, so it may lag behind the store but never lead it."""

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
