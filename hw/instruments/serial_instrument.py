"""What all serial drivers do alike: connect when needed, ask only on a silent line, read twice, bound everything."""

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Generic, TypeVar

from pydantic import Field

from hw.errors import Garbled, InstrumentError
from hw.instruments.reading import Identity, Reading, agreed, check_identity
from hw.link import Deadline, Link
from specs.strict import Strict

Seconds = Annotated[float, Field(gt=0, le=60, allow_inf_nan=False)]


class SerialSettings(Strict):
    """Settings of every serial driver. All times are assumptions: no manual page gives the instruments' own.

    timeout_s : for one reply. quiet_s : how long the line must be silent before a new session, so that no late reply
    answers another question. deadline_s : for one whole reading, connecting included.
    """

    timeout_s: Seconds = 1.0
    quiet_s: Seconds = 0.3
    deadline_s: Seconds = 10.0


S = TypeVar("S", bound=SerialSettings)


class SerialInstrument(ABC, Generic[S]):
    """A driver: `read` gives a value or raises InstrumentError within `deadline_s` (plus one look at the port).

    After any error the next reading starts a new session: silent line, identity, settings.
    """

    unit: str
    reminders: tuple[str, ...] = ()

    def __init__(self, name: str, link: Link, settings: S, model: str | None = None, serial: str | None = None) -> None:
        self.name, self.link, self.settings, self.model, self.serial = name, link, settings, model, serial
        self._session = 0  # value of link.opened when the session began; 0: none

    @property
    def deadline_s(self) -> float:
        return self.settings.deadline_s

    def connect(self) -> Identity:
        """Start a session; who answers. Raises InstrumentError."""
        deadline = self.link.deadline(self.deadline_s)
        with self._session_ends_on_error():
            self._start(deadline)
            return self._who(deadline)

    def read(self) -> Reading:
        """One reading that two answers agree on. Raises InstrumentError."""
        deadline = self.link.deadline(self.deadline_s)
        with self._session_ends_on_error():
            if self._session == 0 or self._session != self.link.opened:
                self._start(deadline)
            self._who(deadline)
            return agreed(self.name, self._measure(deadline), self._measure(deadline), self._within)

    def close(self) -> None:
        self._session = 0
        self.link.close()

    def _start(self, deadline: Deadline) -> None:
        self.link.drop_until_quiet(self.settings.quiet_s, deadline)
        self._begin(deadline)
        self._session = self.link.opened

    def _who(self, deadline: Deadline) -> Identity:
        said = self._identify(deadline)
        check_identity(self.name, said, self.model, self.serial)
        return said

    @contextmanager
    def _session_ends_on_error(self) -> Iterator[None]:
        try:
            yield
        except InstrumentError as e:
            self._session = 0
            self.link.note(f"{type(e).__name__}: {e}")
            raise

    @property
    @abstractmethod
    def _within(self) -> float:
        """How far two answers in a row may differ [SI]."""

    @abstractmethod
    def _begin(self, deadline: Deadline) -> None:
        """Make the session: everything that must be set before a value means what it should."""

    @abstractmethod
    def _identify(self, deadline: Deadline) -> Identity:
        """Ask who it is, as far as the protocol has it."""

    @abstractmethod
    def _measure(self, deadline: Deadline) -> Reading:
        """Ask for one value."""

    def _ask(self, message: bytes, end: bytes, deadline: Deadline, harmless: bytes = b"") -> bytes:
        """Send a message and return the reply with its end. Raises Garbled when bytes lay on the line before it: they
        could be taken for the answer. harmless : bytes that an instrument may leave behind."""
        self._say(message, harmless)
        return self.link.read_until(end, deadline.within(self.settings.timeout_s))

    def _say(self, message: bytes, harmless: bytes = b"") -> None:
        if left := self.link.drop().strip(harmless):
            raise Garbled(f"{self.name}: {left[:40]!r} came unasked; is it sending by itself, or was DATA pressed?")
        self.link.send(message)

    def _now(self) -> float:
        return time.time()


def text_of(who: str, line: bytes) -> str:
    """A reply as text. Raises Garbled for any byte that is not printable ASCII."""
    if any(not 0x20 <= byte < 0x7F for byte in line):
        raise Garbled(f"{who}: {line!r} holds bytes that are no text; check baud rate, data bits and parity")
    return line.decode("ascii")
