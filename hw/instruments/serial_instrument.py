"""Base of all serial drivers: they connect when needed, ask only on a silent line, ask for identity and settings before
and after every reading, read more than once, and bound everything."""

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from typing import Annotated, ClassVar, Generic, TypeVar

from pydantic import Field

from hw.errors import Garbled, InstrumentError
from hw.instruments.reading import Identity, Reading, agreed, check_identity, check_unchanged
from hw.link import Deadline, Link
from specs.strict import Strict

Seconds = Annotated[float, Field(gt=0, le=60, allow_inf_nan=False)]


class SerialSettings(Strict):
    """Settings of every serial driver. All times are assumptions: no manual page gives the instruments' own.

    timeout_s : for one reply. quiet_s : how long the line must be silent before a new session, so that no late reply
    answers another question. deadline_s : for one whole reading, connecting included."""

    timeout_s: Seconds = 1.0
    quiet_s: Seconds = 0.3
    deadline_s: Seconds = 10.0


S = TypeVar("S", bound=SerialSettings)


class SerialInstrument(ABC, Generic[S]):
    """A driver: `read` gives a value or raises InstrumentError within `deadline_s` (plus one look at the port).

    After any error the next reading starts a new session: silent line, settings. The settings that the instrument
    states at the first reading since `connect` must hold until `close`, over all sessions: a change in between is an
    error."""

    unit: str
    answers: ClassVar[int] = 2
    reminders: tuple[str, ...] = ()
    asked: Mapping[str, str]

    def __init__(self, name: str, link: Link, settings: S, model: str | None = None, serial: str | None = None) -> None:
        self.name, self.link, self.settings, self.model, self.serial = name, link, settings, model, serial
        self.asked = {}
        self._session = 0  # value of link.opened when the session began; 0: none
        self._found: Mapping[str, str] = {}  # its settings before the first change

    @property
    def deadline_s(self) -> float:
        return self.settings.deadline_s

    def connect(self) -> Identity:
        """Start a run and return the identity. All settings are made and must hold. Raises InstrumentError."""
        deadline = self.link.deadline(self.deadline_s)
        self.asked = {}
        with self._session_ends_on_error():
            self._start(deadline)
            return self._state(deadline)[0]

    def read(self) -> Reading:
        """Return one reading that two answers agree on. Raises InstrumentError."""
        deadline = self.link.deadline(self.deadline_s)
        with self._session_ends_on_error():
            if not self._in_session:
                self._start(deadline)
            _, before = self._state(deadline)  # nothing is measured by another instrument, or with a bias on
            reading = self._read_agreed(deadline)
            _, after = self._state(deadline)  # a change during the measurement shows in one of the two
            check_unchanged(self.name, before, after)
            settings = {**after, **reading.settings}
            check_unchanged(self.name, self.asked, settings)
            self.asked = {**self.asked, **settings}
            return replace(reading, settings=settings)

    def confirm(self) -> Identity:
        """End a run and return the identity. Identity and settings must be the same before anything is set. Raises
        InstrumentError."""
        deadline = self.link.deadline(self.deadline_s)
        with self._session_ends_on_error():
            if not self._in_session:
                self.link.drop_until_quiet(self.settings.quiet_s, deadline)
                self._open(deadline)
            identity, now = self._state(deadline)
            check_unchanged(self.name, self.asked, now)
            return identity

    def close(self) -> None:
        """Restore the instrument's settings if it answers, close the line, and forget identity and settings."""
        if self._found and self.link.is_open:
            deadline = self.link.deadline(self.deadline_s)
            try:
                self.link.drop_until_quiet(self.settings.quiet_s, deadline)
                self._give_back(self._found, deadline)
            except InstrumentError as e:
                self.link.note(f"not set back as it was found: {e}")
        self._session, self.asked, self._found = 0, {}, {}
        self.link.close()

    @property
    def _in_session(self) -> bool:
        return self._session != 0 and self._session == self.link.opened

    def _start(self, deadline: Deadline) -> None:
        self.link.drop_until_quiet(self.settings.quiet_s, deadline)
        self._open(deadline)
        self._found = self._found or self._settings_found(deadline)
        self._set_up(deadline)
        self._session = self.link.opened

    def _state(self, deadline: Deadline) -> tuple[Identity, dict[str, str]]:
        """Return the instrument's identity and settings. Raises InstrumentError if the bench file names another one."""
        identity = self._identify(deadline)
        check_identity(self.name, identity, self.model, self.serial)
        stated = {key: value for key, value in asdict(identity).items() if value is not None}
        return identity, stated | dict(self._ask_settings(deadline))

    def _read_agreed(self, deadline: Deadline) -> Reading:
        """Return the mean of as many answers as are needed to rely on it."""
        readings = [self._measure(deadline) for _ in range(self.answers)]
        return agreed(self.name, readings, self._within(readings[0]), self._more_within)

    @contextmanager
    def _session_ends_on_error(self) -> Iterator[None]:
        try:
            yield
        except InstrumentError as e:
            self._session = 0
            self.link.note(f"{type(e).__name__}: {e}")
            raise

    @abstractmethod
    def _within(self, first: Reading) -> float:
        """Return how far two answers in a row may differ [SI]."""

    @property
    def _more_within(self) -> float:
        """Return the difference allowed between the accompanying values."""
        return 0.0

    def _open(self, deadline: Deadline) -> None:
        """Make the instrument answer, without a setting that affects a value."""

    def _settings_found(self, _: Deadline) -> Mapping[str, str]:
        """Return the instrument's settings before `_set_up` changes them; nothing if it sets nothing."""
        return {}

    def _give_back(self, found: Mapping[str, str], deadline: Deadline) -> None:
        """Restore the settings that `_settings_found` returned."""

    def _set_up(self, deadline: Deadline) -> None:
        """Set everything that a valid reading needs; the default sets nothing."""

    def _identify(self, _: Deadline) -> Identity:
        """Ask for the identity, as far as the protocol has a question for it."""
        return Identity()

    def _ask_settings(self, _: Deadline) -> Mapping[str, str]:
        """Return the settings if they are as the bench file requires; nothing without a question for them. Raises
        InstrumentError."""
        return {}

    @abstractmethod
    def _measure(self, deadline: Deadline) -> Reading:
        """Ask for one value."""

    def _ask(self, message: bytes, end: bytes, deadline: Deadline, harmless: bytes = b"\r\n") -> bytes:
        """Send a message and return the reply with its end. Raises Garbled for bytes on the line before it, which could
        be taken for the answer. harmless : bytes that an instrument may leave behind."""
        self._say(message, harmless)
        return self.link.read_until(end, deadline.within(self.settings.timeout_s))

    def _say(self, message: bytes, harmless: bytes = b"\r\n") -> None:
        if left := self.link.drop().strip(harmless):
            raise Garbled(f"{self.name}: {left[:40]!r} came unasked; is it sending by itself, or was DATA pressed?")
        self.link.send(message)

    def _now(self) -> float:
        return time.time()


def text_of(who: str, line: bytes) -> str:
    """Return a reply as text. Raises Garbled for any byte that is not printable ASCII."""
    if b"\x13" in line or b"\x11" in line:
        raise Garbled(f"{who}: {line!r} holds XON or XOFF: the bench file needs handshake = 'xonxoff'")
    if any(not 0x20 <= byte < 0x7F for byte in line):
        raise Garbled(f"{who}: {line!r} holds bytes that are not text; check baud rate, data bits and parity")
    return line.decode("ascii")
