"""One serial line: explicit settings, deadlines, bounded reads, and a transcript of every byte."""

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import serial

from hw.errors import Garbled, NoReply, Unplugged
from hw.serial_port import DamagedCharacter, Port, cause, open_serial, why_not_opened

Clock = Callable[[], float]

_ENDS = {b"\r\n": "CR LF", b"\r": "CR", b"\n": "LF"}
MAX_LINE = 200  # no reply of any of these instruments is half as long
MAX_TRAFFIC = 200_000  # entries not taken yet; a stroke, the longest run, has some 10,000
log = logging.getLogger("accept.line")
MAX_DISCARDED = 100_000  # a line that never falls silent is said to be one


@dataclass(frozen=True)
class Traffic:
    """Bytes that went over the line at a time [s since 1970]. way: "sent", "read", "dropped" (read, but belonging to
    no question), or "note", where `data` are words about the line."""

    t: float
    way: str
    data: bytes

    def to_json(self) -> list[float | str]:
        """Return [time, way, text], a character per byte."""
        return [round(self.t, 6), self.way, self.data.decode("latin-1")]


class Deadline:
    """A moment that nothing waits beyond."""

    def __init__(self, seconds: float, clock: Clock = time.monotonic) -> None:
        self._clock, self._end = clock, clock() + seconds

    @property
    def left(self) -> float:
        return max(0.0, self._end - self._clock())

    def within(self, seconds: float) -> "Deadline":
        """Return the earlier of this deadline and `seconds` from now."""
        return Deadline(min(seconds, self.left), self._clock)


class Place(Protocol):
    """The address of an instrument: the name of its port, and a full description."""

    @property
    def port(self) -> str: ...


class Link:
    """A serial line, or another connection, that opens when first used and opens again after it was unplugged.

    opened : how many times it was opened. A driver that remembers the count knows when another instrument may have
    been plugged in. Every OSError of the port ends as Unplugged with the port closed. clock : of all its deadlines [s].
    """

    def __init__(
        self,
        settings: Place,
        opener: Callable[[Any], Port] = open_serial,
        clock: Clock = time.monotonic,
    ) -> None:
        self.settings, self.opened, self.clock = settings, 0, clock
        self._opener = opener
        self._port: Port | None = None
        self._pending = bytearray()
        self._traffic: list[Traffic] = []

    @property
    def is_open(self) -> bool:
        return self._port is not None

    def deadline(self, seconds: float) -> Deadline:
        """Return a deadline by the line's own clock."""
        return Deadline(seconds, self.clock)

    def send(self, data: bytes) -> None:
        """Write all bytes. Raises Unplugged, and NoReply if the other end holds the line by flow control."""
        port = self._open()
        try:
            port.write(data)
        except serial.SerialTimeoutException as e:
            raise NoReply(f"{self.settings}: takes no bytes (flow control?): {data!r} was not sent") from e
        except OSError as e:
            raise self._lost(e) from e
        self._log("sent", data)

    def read_until(self, end: bytes, deadline: Deadline, limit: int = MAX_LINE) -> bytes:
        """Return the bytes up to and with `end`. Raises NoReply after the deadline with the bytes so far, Garbled
        beyond `limit` bytes, Unplugged."""
        while True:
            found = self._pending.find(end)
            if 0 <= found <= limit - len(end):
                return self._take(found + len(end))
            if len(self._pending) >= limit:
                received = self._take(len(self._pending))
                raise Garbled(f"{self.settings}: {len(received)} bytes without {end!r}: {received[:40]!r}...")
            self._more(deadline, f"ending in {_ENDS.get(end, _text(end))}")

    def read_exactly(self, count: int, deadline: Deadline) -> bytes:
        """Return `count` bytes. Raises NoReply with the bytes so far if the deadline passes, Unplugged."""
        while len(self._pending) < count:
            self._more(deadline, f"of {count} bytes")
        return self._take(count)

    def drop(self) -> bytes:
        """Drop and return unsolicited bytes, so that they answer no later question; they stay in the transcript."""
        self._open()
        self._look(block=False)
        dropped = bytes(self._pending)
        self._pending.clear()
        if dropped:
            self._log("dropped", dropped)
        return dropped

    def drop_until_quiet(self, quiet_s: float, deadline: Deadline) -> bytes:
        """Drop bytes until none came for `quiet_s`. Raises Garbled if the line does not fall silent."""
        dropped, quiet = self.drop(), self.deadline(quiet_s)
        while quiet.left > 0:
            if deadline.left <= 0 or len(dropped) > MAX_DISCARDED:
                words = "the instrument sends by itself; is it set to continuous sending?"
                raise Garbled(f"{self.settings}: the line does not fall silent ({dropped[-40:]!r}): {words}")
            self._look()
            if came := self.drop():
                dropped, quiet = dropped + came, self.deadline(quiet_s)
        return dropped

    def close(self) -> None:
        """Close the port; the next use opens it again."""
        if self._port is not None:
            port, self._port = self._port, None
            self._pending.clear()
            port.close()
            self.note("closed")

    def note(self, words: str) -> None:
        """Write words about the line into the transcript."""
        self._log("note", words.encode("utf-8"))

    def take_transcript(self) -> list[Traffic]:
        """Return all traffic since the last call."""
        taken, self._traffic = self._traffic, []
        return taken

    def _open(self) -> Port:
        if self._port is None:
            try:
                self._port = self._opener(self.settings)
            except (OSError, ValueError) as e:
                raise Unplugged(f"{self.settings}: {why_not_opened(self.settings.port, e)}") from e
            self.opened += 1
            self._pending.clear()
            self.note(f"opened {self.settings}")
        return self._port

    def _more(self, deadline: Deadline, expected: str) -> None:
        if deadline.left <= 0:
            received = self._take(len(self._pending))
            what = f"only {_text(received)}" if received else "nothing"
            raise NoReply(f"{self.settings}: {what} came in time, expected a reply {expected}")
        self._look()

    def _look(self, block: bool = True) -> None:
        """Collect received bytes; with `block`, wait up to `POLL_S` for the first."""
        port = self._open()
        try:
            waiting = port.in_waiting
            data = port.read(waiting or 1) if waiting or block else b""
        except DamagedCharacter as e:
            pending = self._take(len(self._pending))
            self.note(f"{e} after {pending!r}")
            words = "check baud rate, data bits, parity and the cable"
            raise Garbled(f"{self.settings}: {e} came after {pending!r}; {words}") from e
        except OSError as e:
            raise self._lost(e) from e
        if data:
            self._pending += data
            self._log("read", data)

    def _lost(self, error: OSError) -> Unplugged:
        pending = bytes(self._pending)
        port, self._port = self._port, None
        self._pending.clear()
        self.note(f"lost: {cause(error)}")
        if port is not None:
            try:
                port.close()
            except OSError as e:  # the device is gone; there is nothing left to close
                self.note(f"closing failed: {cause(e)}")
        after = f" after {pending!r}" if pending else ""
        words = "the instrument or its adapter was unplugged; plug it in, and the next reading opens it again"
        return Unplugged(f"{self.settings}: went away{after} ({cause(error)}): {words}")

    def _take(self, count: int) -> bytes:
        taken = bytes(self._pending[:count])
        del self._pending[:count]
        return taken

    def _log(self, way: str, data: bytes) -> None:
        if len(self._traffic) >= MAX_TRAFFIC:
            del self._traffic[: MAX_TRAFFIC // 2]
            words = f"{MAX_TRAFFIC // 2} entries before this were never taken and are gone"
            self._traffic.insert(0, Traffic(time.time(), "note", words.encode()))
        self._traffic.append(Traffic(time.time(), way, data))
        log.debug("%s %s %r", self.settings, way, data)


def _text(data: bytes) -> str:
    """Return bytes in readable form: quoted, unprintable ones by their code."""
    return repr(data)[1:]
