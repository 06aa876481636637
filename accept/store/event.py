"""One event: its fields, and the hash that ties it to the event before; and the errors of the store."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from accept.base.names import shown_name
from accept.base.plain_text import as_utf8
from specs.errors import AcceptError


class StoreError(AcceptError, RuntimeError):
    """The store cannot be used; the text states its name, the reason and the remedy."""


class Overtaken(StoreError):
    """Another program stored an event about the unit since the writer read them: nothing was stored. Read again."""


GENESIS = "0" * 64  # stands for the event before the first


@dataclass(frozen=True)
class Event:
    """One stored event, its fields in the order in which they are stored and hashed.

    seq : 1, 2, 3 ...; time : UTC, ISO 8601 with microseconds; who : the operator; what : the kind of event;
    subject : a unit's serial or ""; spec : name@sha256 or ""; code : hash of the program; payload : canonical JSON;
    prev : hash of the event before; hash : over all the fields above."""

    seq: int
    time: str
    who: str
    what: str
    subject: str
    spec: str
    code: str
    payload: str
    prev: str
    hash: str

    @property
    def data(self) -> dict[str, Any]:
        content: dict[str, Any] = json.loads(self.payload)
        return content

    @property
    def by(self) -> str:
        """The operator as shown: a name for which no key was opened is marked. Earlier versions stored no mark."""
        return shown_name(self.who, self.data.get("typed") is True)

    @property
    def name(self) -> str:
        """The event's name in messages: `event 57 (unit_judged APA-03)`."""
        words = " ".join(str(word) for word in (self.what, self.subject) if word)
        return f"event {self.seq} ({as_utf8(words)})"

    @property
    def intact(self) -> bool:
        """Whether the hash is that of the content; never if a field has another type, such as bytes."""
        fields = tuple(vars(self).values())  # in the order above
        typed = type(self.seq) is int and all(type(value) is str for value in fields[1:])
        return typed and digest(*fields[:-1]) == self.hash


def digest(*fields: int | str) -> str:
    """Return the SHA-256 of the fields as one JSON list without spaces, all beyond ASCII escaped.

    JSON quotes every string, so no two different events have the same encoding, and anyone can recompute the hash:
    `json.dumps([seq, time, who, what, subject, spec, code, payload, prev], separators=(",", ":"))`."""
    return hashlib.sha256(json.dumps(fields, separators=(",", ":"), ensure_ascii=True).encode("ascii")).hexdigest()


@dataclass(frozen=True)
class NewEvent:
    """An event to append; the store adds number, time, operator, code and hashes. after: number of the previous event
    about its subject; if the store has a later one, the event is not appended."""

    what: str
    subject: str = ""
    payload: Mapping[str, Any] = field(default_factory=dict)
    spec: str = ""
    after: int | None = None

    def text(self) -> str:
        """Return the canonical JSON of the payload. Raises StoreError if it is not JSON, NaN and infinity included."""
        try:
            return json.dumps(dict(self.payload), sort_keys=True, separators=(",", ":"), allow_nan=False)
        except (TypeError, ValueError) as e:
            raise StoreError(f"{self.what} {self.subject}: the payload is not JSON: {e}") from e


def sealed(seq: int, time: str, who: str, entry: NewEvent, code: str, prev: str) -> Event:
    """Return an entry's event with its hash. Raises StoreError if a database would change a field."""
    if not who or not entry.what:
        raise StoreError(f"an event needs its operator and its kind (got who={who!r}, what={entry.what!r})")
    words = (time, who, entry.what, entry.subject, entry.spec, code, entry.text(), prev)
    for word in words:
        if "\0" in word or any("\ud800" <= c <= "\udfff" for c in word):
            raise StoreError(f"{word!r} holds a character that cannot be stored (NUL, or half of a surrogate pair)")
    return Event(seq, *words, hash=digest(seq, *words))
