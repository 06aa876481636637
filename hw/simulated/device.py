"""Base of every simulated instrument: bytes in, replies out, and the switches that faults set."""

from abc import ABC, abstractmethod
from collections.abc import Callable

Source = Callable[[], float | None]
"""What the instrument would measure now, in SI; None: nothing is connected to it."""


class Device(ABC):
    """One instrument's protocol. silent: a menu is open; overrange: the measured value is outside its range;
    other_unit: the unit was changed at the instrument. Replies come whole, one per entry."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.silent = self.overrange = self.other_unit = False
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Return the replies to received bytes; bytes of an unfinished message wait for the rest."""
        self._buffer += data
        return [reply for message in self._messages() for reply in self._answers(message)]

    def unsolicited(self) -> list[bytes]:
        """Return the bytes that it sends by itself now."""
        return []

    def unplugged(self) -> None:
        """Forget half a message: the line was cut."""
        self._buffer.clear()

    def _answers(self, message: bytes) -> list[bytes]:
        return [] if self.silent else self.answer(message)

    @abstractmethod
    def _messages(self) -> list[bytes]:
        """Remove the finished messages from the buffer and return them without their ends."""

    @abstractmethod
    def answer(self, message: bytes) -> list[bytes]:
        """Return the replies to one message, with their ends."""

    def _lines(self, end: bytes) -> list[bytes]:
        *lines, rest = bytes(self._buffer).split(end)
        self._buffer[:] = rest
        return lines
