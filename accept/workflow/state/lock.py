"""One program at a unit: a lock that the system frees when the program dies, however it dies."""

from pathlib import Path

from filelock import FileLock, Timeout

from specs.errors import AcceptError


class UnitBusy(AcceptError, RuntimeError):
    """Another program has the unit open; the text says what to do."""


class UnitLock:
    """Held from the first screen of a unit to its last."""

    def __init__(self, folder: Path) -> None:
        """Raise UnitBusy, OSError."""
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = FileLock(folder / ".lock", mode=0o600, thread_local=False)
        try:
            self._lock.acquire(blocking=False)
        except Timeout as e:
            raise UnitBusy(f"{folder.name} is open in another program; finish there, then go on here") from e

    def release(self) -> None:
        self._lock.release()
