"""One program at a unit: a lock that the system frees when the program dies, however it dies."""

import fcntl
import os
from pathlib import Path

from specs.errors import AcceptError


class UnitBusy(AcceptError, RuntimeError):
    """Another program has the unit open; the text says what to do."""


class UnitLock:
    """Held from the first screen of a unit to its last."""

    def __init__(self, folder: Path) -> None:
        """Raises UnitBusy, OSError."""
        folder.mkdir(parents=True, exist_ok=True)
        self._handle = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as e:
            os.close(self._handle)
            raise UnitBusy(f"{folder.name} is open in another program; finish there, then go on here") from e

    def release(self) -> None:
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
