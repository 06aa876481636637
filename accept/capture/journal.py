"""Where readings go the moment they are taken: a file in the unit folder, synced line by line. What a run has said to
have read is on the disk, whatever happens to the run."""

import json
import os
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any

from hw.instruments import Reading

FOLDER = "readings"


class Journal:
    """An open journal of one run; a context manager. A line: what for, the reading, its raw bytes."""

    def __init__(self, unit_folder: Path, section: str) -> None:
        stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S%f")
        self.path = unit_folder / FOLDER / f"{section}-{stamp}.jsonl"
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._file = open(self.path, "xb")  # noqa: SIM115 - closed by __exit__
        self.lines: list[dict[str, Any]] = []

    def __enter__(self) -> "Journal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def keep(self, what: str, reading: Reading, sync: bool = True) -> Reading:
        """Write a reading down; when this returns it is on the disk, without `sync` at the next one with it. Raises
        OSError."""
        line = {
            "what": what,
            "value": reading.value,
            "unit": reading.unit,
            "t": reading.t,
            "more": dict(reading.more),
            "settings": dict(reading.settings),
            "raw": [raw.decode("latin-1") for raw in reading.raw],
        }
        self._file.write(json.dumps(line).encode() + b"\n")
        if sync:
            self.sync()
        self.lines.append(line)
        return reading

    def sync(self) -> None:
        """All that was written is on the disk when this returns. Raises OSError."""
        self._file.flush()
        os.fsync(self._file.fileno())
