"""The wires between a peer and a driver, a pseudo-terminal and a socket, and what can happen on them."""

import os
import random
import select
import socket
import threading
import time
import tty
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Answers = list[tuple[float, bytes]]  # after how many seconds, what


class Peer:
    """An instrument at the end of a wire. truth: what it measures now, SI. ends: bytes that end a message to it."""

    ends = b"\r"
    skipped = b""  # bytes of line ends that may follow or precede a message

    def __init__(self) -> None:
        self.truth = 0.0
        self.silent = False  # a menu is open
        self.refuses: bytes | None = None  # said in place of every value
        self.streams = False  # sends values by itself
        self._heard = b""

    def power_cycle(self) -> None:
        """Forget what was set over the wire."""
        self._heard = b""

    def hear(self, data: bytes) -> Answers:
        """Return the answers to whatever is complete now."""
        answers: Answers = []
        for byte in data:
            one = bytes([byte])
            if one in self.ends:
                message, self._heard = self._heard.strip(self.skipped), b""
                if not self.silent:
                    answers += [(0.0, a) for a in self.answer(message)]
            else:
                self._heard += one
        return answers

    def answer(self, message: bytes) -> Sequence[bytes]:
        """Return the whole replies to a message."""
        raise NotImplementedError

    def unasked(self) -> bytes:
        """Return what it sends when it sends by itself."""
        raise NotImplementedError

    def panel(self) -> dict[str, Callable[[], None]]:
        """Return what a person can do at the panel and a protocol can tell, by name."""
        raise NotImplementedError

    def untold(self) -> dict[str, Callable[[], None]]:
        """Return what a person can do at the panel that no question of the protocol shows."""
        return {}


@dataclass
class State:
    """What a fault remembers, and its dice."""

    dice: random.Random
    kept: list[bytes] = field(default_factory=list)


@dataclass(frozen=True)
class WireFault:
    """change: (reply, state) -> what comes in its place; echo: what is sent comes back first; stays: it can last. No
    line turns every sign of every reply and nothing else: what looks so is a formula or a factor."""

    name: str
    change: Callable[[bytes, State], Answers]
    echo: bool = False
    stays: bool = True


def _flip(reply: bytes, s: State) -> Answers:
    at = s.dice.randrange(len(reply))
    changed = reply[at] ^ (1 << s.dice.randrange(7))
    return [(0.0, reply[:at] + bytes([changed]) + reply[at + 1 :])]


def _lost(reply: bytes, s: State) -> Answers:
    at = s.dice.randrange(len(reply))
    return [(0.0, reply[:at] + reply[at + 1 :])]


def _digit(reply: bytes, s: State, new: Callable[[int], bytes]) -> Answers:
    digits = [i for i, b in enumerate(reply) if chr(b).isdigit()]
    if not digits:
        return [(0.0, reply)]
    at = s.dice.choice(digits)
    return [(0.0, reply[:at] + new(reply[at]) + reply[at + 1 :])]


def _before(reply: bytes, s: State) -> Answers:
    s.kept.append(reply)
    return [(0.0, s.kept.pop(0))] if len(s.kept) > 1 else []


def _merged(reply: bytes, s: State) -> Answers:
    if not s.kept:
        s.kept.append(reply.rstrip(b"\r\n"))
        return []
    return [(0.0, s.kept.pop() + reply)]


def _swapped(reply: bytes, s: State) -> Answers:
    if not s.kept:
        s.kept.append(reply)
        return []
    return [(0.0, reply), (0.0, s.kept.pop())]


def _noise(n: int) -> Callable[[bytes, State], Answers]:
    return lambda reply, s: [(0.0, s.dice.randbytes(n)), (0.0, reply)]


def _late(seconds: float) -> Callable[[bytes, State], Answers]:
    return lambda reply, s: [(seconds, reply)]


def wire_faults(timeout: float) -> list[WireFault]:
    """Return what can happen on a wire to a driver that waits `timeout` seconds for a reply."""
    half = lambda r: len(r) // 2  # noqa: E731
    return [
        WireFault("silence", lambda r, s: []),
        WireFault("3 bytes of noise before", _noise(3)),
        WireFault("60 bytes of noise before", _noise(60)),
        WireFault("late, in time", _late(0.5 * timeout)),
        WireFault("late, just too late", _late(1.1 * timeout)),
        WireFault("late, one question", _late(1.9 * timeout)),
        WireFault("late, three questions", _late(3.3 * timeout)),
        WireFault("the answer before", _before),
        WireFault("half of it", lambda r, s: [(0.0, r[: half(r)])]),
        WireFault("the second half", lambda r, s: [(0.0, r[half(r) :])]),
        WireFault("half, then the rest", lambda r, s: [(0.0, r[: half(r)]), (1.3 * timeout, r[half(r) :])]),
        WireFault("drop by drop", lambda r, s: [(0.1 * timeout * i, bytes([b])) for i, b in enumerate(r)]),
        WireFault("echo", lambda r, s: [(0.0, r)], echo=True),
        WireFault("wrong baud", lambda r, s: [(0.0, bytes((b * 37 + 11) & 0xFF for b in r[::2]))]),
        WireFault("decimal comma", lambda r, s: [(0.0, r.replace(b".", b","))]),
        WireFault("NUL inside", lambda r, s: [(0.0, r[:3] + b"\0" + r[3:])]),
        WireFault("eighth bit", lambda r, s: [(0.0, bytes(b | 0x80 for b in r))]),
        WireFault("one bit flipped", _flip),
        WireFault("one character lost", _lost),
        WireFault("one digit another", lambda r, s: _digit(r, s, lambda b: b"%d" % ((b - 47) % 10))),
        WireFault("one digit twice", lambda r, s: _digit(r, s, lambda b: bytes([b, b]))),
        WireFault("one digit lost", lambda r, s: _digit(r, s, lambda b: b"")),
        WireFault("sign turned", lambda r, s: [(0.0, r.translate(bytes.maketrans(b"+-", b"-+")))], stays=False),
        WireFault("two replies as one", _merged),
        WireFault("two replies swapped", _swapped),
        WireFault("twice", lambda r, s: [(0.0, r), (0.0, r)]),
        WireFault("twice, later", lambda r, s: [(0.0, r), (0.7 * timeout, r)]),
        WireFault("without its end", lambda r, s: [(0.0, r.rstrip(b"\r\n"))]),
        WireFault("flood before", lambda r, s: [(0.0, b"7" * 4000), (0.0, r)]),
    ]


ON_SOCKETS = (
    "silence", "late, in time", "late, just too late", "late, one question", "late, three questions",
    "the answer before", "half of it", "half, then the rest", "drop by drop", "twice", "twice, later",
    "two replies as one", "two replies swapped", "without its end", "flood before", "3 bytes of noise before",
)  # fmt: skip


class Wire:
    """A peer at a wire, answering in a thread. `fault` is on it until it is taken off; `strike` once, n replies on."""

    address: str

    def __init__(self, peer: Peer, seed: int) -> None:
        self.peer, self.fault = peer, None
        self.state = State(random.Random(seed))
        self._strike: tuple[int, WireFault] | None = None
        self._due: list[tuple[float, bytes]] = []
        self._ended = False
        self._lock = threading.RLock()
        self._open()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    fault: WireFault | None

    def strike(self, fault: WireFault, after: int) -> None:
        """Let a fault strike one reply, after so many more."""
        with self._lock:
            self._strike = (after, fault)

    def clear(self) -> None:
        """Take the fault off, and what it has kept back."""
        with self._lock:
            self.fault, self._strike = None, None
            self.state.kept.clear()

    def close(self) -> None:
        self._ended = True
        self._thread.join()
        self._shut()

    def _open(self) -> None: ...
    def _shut(self) -> None: ...
    def _receive(self) -> bytes: ...  # type: ignore[empty-body]
    def _send(self, data: bytes) -> None: ...
    def replug(self) -> None: ...

    def _serve(self) -> None:
        streamed = 0.0
        while not self._ended:
            with self._lock:
                try:
                    data = self._receive()
                    if data:
                        self._heard(data)
                    now = time.monotonic()
                    if self.peer.streams and now - streamed > 0.05:
                        streamed = now
                        self._send(self.peer.unasked())
                    ready = [x for x in self._due if x[0] <= now]
                    for item in ready:
                        self._due.remove(item)
                        self._send(item[1])
                except OSError:
                    pass  # the other end went away
            time.sleep(0.001)

    def _heard(self, data: bytes) -> None:
        now = time.monotonic()
        if self.fault and self.fault.echo:
            self._due.append((now, data))
        for delay, reply in self.peer.hear(data):
            fault = self.fault
            if self._strike is not None:
                count, once = self._strike
                self._strike = (count - 1, once) if count else None
                fault = fault if count else once
            changed = fault.change(reply, self.state) if fault else [(0.0, reply)]
            self._due += [(now + delay + more, part) for more, part in changed]


class Pty(Wire):
    """A serial line: a pseudo-terminal, found by a link that stays when it is plugged in again."""

    def __init__(self, peer: Peer, place: Path, seed: int) -> None:
        self.address = str(place)
        super().__init__(peer, seed)

    def _open(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        link = Path(self.address)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(self._slave))

    def _shut(self) -> None:
        for fd in (self._master, self._slave):
            os.close(fd)

    def replug(self) -> None:
        """Unplug and plug in again: another device behind the same link."""
        with self._lock:
            self._shut()
            self._due.clear()
            self._open()

    def _receive(self) -> bytes:
        ready, _, _ = select.select([self._master], [], [], 0)
        return os.read(self._master, 4096) if ready else b""

    def _send(self, data: bytes) -> None:
        _, ready, _ = select.select([], [self._master], [], 0.05)
        if ready:  # nobody reads a full buffer
            os.write(self._master, data)


class Tcp(Wire):
    """A socket of this machine; one client at a time."""

    _client: socket.socket | None = None

    def _open(self) -> None:
        self._door = socket.socket()
        self._door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._door.bind(("127.0.0.1", getattr(self, "port", 0)))
        self._door.listen(4)
        self.port = self._door.getsockname()[1]
        self.address = f"127.0.0.1:{self.port}"

    def _shut(self) -> None:
        if self._client:
            self._client.close()
            self._client = None
        self._door.close()

    def replug(self) -> None:
        """Close the connection; the next is a new one."""
        with self._lock:
            if self._client:
                self._client.close()
                self._client = None
            self._due.clear()

    def _receive(self) -> bytes:
        ready, _, _ = select.select([self._door], [], [], 0)
        if ready:
            if self._client:
                self._client.close()
            self._client, _ = self._door.accept()
            self._due.clear()
        if self._client is None:
            return b""
        ready, _, _ = select.select([self._client], [], [], 0)
        if not ready:
            return b""
        data = self._client.recv(65536)
        if not data:
            self._client.close()
            self._client = None
        return data

    def _send(self, data: bytes) -> None:
        if self._client:
            self._client.settimeout(0.2)
            self._client.sendall(data)


def set_to(peer: Any, **values: Any) -> Callable[[], None]:
    """Return an action at the panel: attributes get these values."""

    def act() -> None:
        for name, value in values.items():
            setattr(peer, name, value)

    return act
