"""One passphrase for a shift: it is typed at the first signature, and kept in the memory of this program only."""

import time
from collections.abc import Callable
from dataclasses import dataclass

SHIFT_S = 8 * 3600.0  # after it the passphrase is asked for again
NOT_TAKEN = "That is a passphrase: it was not taken and is stored nowhere. The summary asks for it, by ^S"
IDLE_S = 15 * 60.0  # without a key: the technician has left the bench


@dataclass(frozen=True)
class _Kept:
    operator: str
    passphrase: str
    since: float


class SigningShift:
    """The technician whose key is open at this bench. Quality assurance types its passphrase every time."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin without a key. clock: seconds."""
        self._clock, self._touched = clock, clock()
        self._kept: _Kept | None = None

    def touch(self) -> None:
        """Note that a key was pressed."""
        self.passphrase("")  # one that comes too late opens nothing
        self._touched = self._clock()

    def keep(self, operator: str, passphrase: str) -> None:
        """Keep a passphrase that opened the key of an operator."""
        self._touched = self._clock()
        if self._kept is None or (self._kept.operator, self._kept.passphrase) != (operator, passphrase):
            self._kept = _Kept(operator, passphrase, self._touched)

    def passphrase(self, operator: str) -> str | None:
        """Return the passphrase kept for an operator, None if it must be typed: at first, after the shift, after a
        pause, for another person."""
        now, kept = self._clock(), self._kept
        if kept is None:
            return None
        if now - kept.since > SHIFT_S or now - self._touched > IDLE_S:
            self._kept = None
            return None
        return kept.passphrase if kept.operator == operator else None

    def hand_over(self, operator: str) -> None:
        """Forget the passphrase of anyone else: another person works at the bench now."""
        if self._kept is not None and self._kept.operator != operator:
            self._kept = None

    def lock(self) -> bool:
        was, self._kept = self._kept is not None, None
        return was
