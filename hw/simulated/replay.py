"""A stored transcript as the other end of a line: an instrument's answers are replayed.

A transcript of a real instrument (`accept hw commission`, the event store) becomes a test of its driver: a driver that
sends other bytes than it sent then fails, and the answers are those of the instrument."""

import time
from collections import deque
from collections.abc import Iterable, Sequence

from hw.link import Link, Place


class ReplayPort:
    """A port that expects the bytes that were sent, in their order, and returns the answers to them. entries: [time,
    way, text] of `Traffic.to_json`. Raises AssertionError in `write` for other bytes."""

    def __init__(self, entries: Iterable[Sequence[float | str]]) -> None:
        traffic = ((str(way), str(text).encode("latin-1")) for _, way, text in entries if way in ("sent", "read"))
        self._traffic = deque(traffic)

    @property
    def in_waiting(self) -> int:
        return len(self._traffic[0][1]) if self._traffic and self._traffic[0][0] == "read" else 0

    @property
    def is_over(self) -> bool:
        return not self._traffic

    def read(self, size: int = 1, /) -> bytes:
        if not self.in_waiting:
            time.sleep(0.001)
            return b""
        _, data = self._traffic.popleft()
        if len(data) > size:
            self._traffic.appendleft(("read", data[size:]))
        return data[:size]

    def write(self, b: bytes, /) -> int:
        way, data = self._traffic.popleft() if self._traffic else ("end", b"")
        if (way, data) != ("sent", b):
            raise AssertionError(f"sent {b!r}; the transcript has {way} {data!r}")
        return len(b)

    def close(self) -> None:
        """Do nothing: a transcript covers several openings of its line."""


def replay(entries: Iterable[Sequence[float | str]], place: Place) -> tuple[Link, ReplayPort]:
    """Return a link to a transcript, and its port, whose `is_over` becomes true at the end."""
    port = ReplayPort(entries)
    return Link(place, lambda _: port), port
