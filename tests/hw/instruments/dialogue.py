"""A scripted other end of a serial line: what must be sent, and what it answers."""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from hw.link import Link
from hw.serial_port import LineSettings

LINE = LineSettings("/dev/test", 9600, 8, "none", 1, "none")


class ScriptedPort:
    """Answers each expected message with its reply; anything else fails the test at once."""

    def __init__(self, steps: tuple[tuple[bytes, bytes], ...]) -> None:
        self.steps, self.out, self.closed = deque(steps), bytearray(), False
        if self.steps and self.steps[0][0] == b"":  # bytes that lie on the line before anything is asked
            self.out += self.steps.popleft()[1]

    @property
    def in_waiting(self) -> int:
        return len(self.out)

    def read(self, size: int = 1, /) -> bytes:
        if not self.out:
            time.sleep(0.001)
        taken = bytes(self.out[:size])
        del self.out[:size]
        return taken

    def write(self, data: bytes, /) -> int:
        assert self.steps, f"sent {data!r} after the dialogue's end"
        sent, reply = self.steps.popleft()
        assert data == sent, f"sent {data!r}, the dialogue has {sent!r}"
        self.out += reply
        return len(data)

    def close(self) -> None:
        self.closed = True


@contextmanager
def dialogue(*steps: tuple[bytes, bytes], unread: bytes = b"") -> Iterator[Link]:
    """A link whose other end plays these steps. On leaving: all was sent, all was read but `unread`."""
    port = ScriptedPort(steps)
    yield Link(LINE, lambda settings: port)
    assert not port.steps, f"never sent: {[sent for sent, _ in port.steps]}"
    assert bytes(port.out) == unread, f"left unread: {bytes(port.out)!r}"


class DevicePort(ScriptedPort):
    """The line to something that is fed bytes and gives back replies. Time stands still but where a reader waits."""

    def __init__(self, device) -> None:
        super().__init__(())
        self.device, self.now = device, 0.0

    def read(self, size: int = 1, /) -> bytes:
        if not self.out:
            self.now += 0.02
        taken = bytes(self.out[:size])
        del self.out[:size]
        return taken

    def write(self, data: bytes, /) -> int:
        self.out += b"".join(self.device.feed(data))
        return len(data)


def link_to(device) -> Link:
    """A link to a device, by a clock of its own."""
    port = DevicePort(device)
    return Link(LINE, lambda settings: port, lambda: port.now)
