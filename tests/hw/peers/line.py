"""A serial line to a peer, by a clock of its own, with everything that happens to lines and benches.

Bytes keep their order, as in every adapter and buffer: what is late holds up what comes after it. A person at the panel
needs `DWELL_S` from one change to the next, longer than any reading here; a change that is undone within one reading
is the one thing that no question can see.
"""

import errno
import random
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from hw.serial_port import DamagedCharacter

DWELL_S = 8.0
OFF_S = 1.5  # from switching off to answering again
KINDS = (
    "panel", "panel", "panel", "noise", "noise", "lost_byte", "parity", "echo", "glued", "late", "lost", "half",
    "power", "unplug", "chatter",
)  # fmt: skip


class Peer(Protocol):
    """byte_s: time of a character. panel: what a person can change at the instrument, by name."""

    byte_s: float
    panel: Mapping[str, Callable[[], None]]

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        """Replies to bytes, each with the time [s] that it takes to begin."""
        ...

    def alone(self, now: float) -> list[bytes]:
        """What it sends by itself now."""
        ...

    def switch_on(self) -> None:
        """As after power came back."""
        ...


@dataclass(frozen=True)
class Fault:
    """kind: of KINDS; "panel:NAME" is one change of the panel, "panel" any of them.

    at: number of the message at which it strikes, before it is heard or (answered) after it."""

    kind: str
    at: int
    answered: bool
    seed: int


def random_faults(rng: random.Random, most: int = 6, span: int = 90, kinds: tuple[str, ...] = KINDS) -> list[Fault]:
    """span: messages over which they are spread; the first few, where a session begins, as often as all the others."""
    return [
        Fault(
            rng.choice(kinds),
            rng.randrange(rng.choice((12, span))),
            rng.random() < 0.5,
            rng.randrange(10**9),
        )
        for _ in range(rng.randint(1, most))
    ]


class Line:
    """A port for a link, a peer at its other end, and faults in between. clock: for the link."""

    def __init__(self, peer: Peer, faults: list[Fault] = ()) -> None:  # type: ignore[assignment]
        self.peer, self.faults = peer, list(faults)
        self.now = self.stalled = self.off_until = self.gone_until = 0.0
        self.last_panel = -DWELL_S
        self.log: list[str] = []
        self._messages = self._echoes = 0
        self._held = b""
        self._next: deque[Callable[[bytes], bytes]] = deque()
        self._coming: deque[tuple[float, int]] = deque()  # when, and the byte; -1: damaged

    def clock(self) -> float:
        return self.now

    def open(self, settings: object) -> "Line":
        """What the link calls to open the port."""
        self.now += 0.01
        if self.now < self.gone_until:
            raise OSError(errno.ENOENT, "No such file or directory")
        return self

    @property
    def in_waiting(self) -> int:
        self._there()
        self._stream()
        return sum(1 for when, _ in self._coming if when <= self.now)

    def read(self, size: int = 1, /) -> bytes:
        self._there()
        self._stream()
        if not self._coming or self._coming[0][0] > self.now:
            self.now = min(self.now + 0.02, max(self.now, self._coming[0][0])) if self._coming else self.now + 0.02
            self._there()
        came = bytearray()
        while self._coming and self._coming[0][0] <= self.now and len(came) < size:
            if self._coming[0][1] < 0:
                if came:
                    break  # first what came well
                self._coming.popleft()
                raise DamagedCharacter("a character with wrong parity")
            came.append(self._coming.popleft()[1])
        return bytes(came)

    def write(self, data: bytes, /) -> int:
        self._there()
        self._messages += 1
        self.now += len(data) * self.peer.byte_s
        self._strike(answered=False)
        self._there()
        if self._echoes > 0:
            self._echoes -= 1
            self._send(data)
        if self.now >= self.off_until:
            for delay, reply in self.peer.hear(data):
                self._reply(delay, reply)
        self._strike(answered=True)
        return len(data)

    def close(self) -> None:
        """Nothing to do."""

    def _there(self) -> None:
        if self.now < self.gone_until:
            self._coming.clear()
            raise OSError(errno.EIO, "Input/output error")

    def _stream(self) -> None:
        if self.now >= self.off_until:
            for line in self.peer.alone(self.now):
                self._send(line)

    def _reply(self, delay: float, reply: bytes) -> None:
        for change in [self._next.popleft()] if self._next else []:
            reply = change(reply)
        if reply:
            self._send(self._held + reply, delay)
            self._held = b""

    def _send(self, data: bytes, delay: float = 0.0) -> None:
        when = max(self.now + delay, self.stalled, self._coming[-1][0] if self._coming else 0.0)
        for byte in data:
            when += self.peer.byte_s
            self._coming.append((when, byte))

    def _strike(self, answered: bool) -> None:
        for fault in [f for f in self.faults if f.at <= self._messages and f.answered == answered]:
            if fault.kind.startswith("panel") and self.now < self.last_panel + DWELL_S:
                continue  # the person is not that quick
            self.faults.remove(fault)
            self.log.append(f"{self.now:.2f} s, message {self._messages}: {fault.kind}")
            kind, _, name = fault.kind.partition(":")
            getattr(self, f"_{kind}")(random.Random(fault.seed), *([name] if name else []))

    def _panel(self, rng: random.Random, name: str = "") -> None:
        name = name or rng.choice(sorted(self.peer.panel))
        self.log[-1] += f" {name}"
        self.last_panel = self.now
        if name in self.peer.panel:  # else this one has no such key
            self.peer.panel[name]()

    def _noise(self, rng: random.Random) -> None:
        self._next.append(lambda reply: damaged(reply, rng))

    def _lost_byte(self, rng: random.Random) -> None:
        """A character of one reply, or the same one of every reply for a while, as a full buffer loses it."""
        at = rng.randrange(16)
        self._next.extend([lambda reply: reply[:at] + reply[at + 1 :]] * rng.choice((1, 1, 12)))

    def _parity(self, rng: random.Random) -> None:
        at = rng.randrange(12)

        def hit(reply: bytes) -> bytes:
            self._send(reply[:at])
            self._coming.append((self._coming[-1][0] if self._coming else self.now, -1))
            self._send(reply[at + 1 :])
            return b""

        self._next.append(hit)

    def _echo(self, rng: random.Random) -> None:
        self._echoes = rng.randint(1, 30)

    def _glued(self, rng: random.Random) -> None:
        def hold(reply: bytes) -> bytes:
            self._held += reply
            return b""

        self._next.append(hold)

    def _late(self, rng: random.Random) -> None:
        self.stalled = self.now + rng.choice((0.1, 0.5, 1.2, 3.0, 12.0))

    def _lost(self, rng: random.Random) -> None:
        self._next.append(lambda reply: b"")

    def _half(self, rng: random.Random) -> None:
        at = rng.randrange(14)
        self._next.append(lambda reply: reply[:at])

    def _power(self, rng: random.Random) -> None:
        self.off_until = self.now + OFF_S
        self._coming.clear()
        self.peer.switch_on()

    def _unplug(self, rng: random.Random) -> None:
        self.gone_until = self.now + rng.choice((0.05, 0.5, 3.0))
        self._coming.clear()
        self._held = b""

    def _chatter(self, rng: random.Random) -> None:
        self._send(rng.choice((b"\r", b"\n", b"\r\n", b"\x00", b"\x13", b"\xff", b"0.0\r\n", b"?", b"ERR1\r\n")))


def damaged(data: bytes, rng: random.Random) -> bytes:
    """One to four characters replaced, lost or added; digits by digits as often as anything by anything."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at, byte = rng.randrange(len(changed) + 1), rng.choice((rng.randrange(256), rng.choice(b"0123456789.- ")))
        how = rng.choice(("replace", "lose", "add"))
        if how == "add":
            changed[at:at] = bytes([byte])
        else:
            changed[at : at + 1] = bytes([byte]) if how == "replace" else b""
    return bytes(changed)
