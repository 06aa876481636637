"""Records of the real-time rig, picked up from a watched folder once they are complete; never moved, never deleted."""

import time
from collections.abc import Callable
from pathlib import Path

from accept import units
from accept.store import Store
from accept.store.payloads import RecordPickedUp
from accept.units import UnitError, toml_edit
from accept.units.attach import take_in
from checks.acceptance import CHECKS
from checks.declare import CsvTable, Input, Series
from checks.errors import RecordError
from specs.bench import NO_CHANNELS, Channels

SUFFIXES = (".mat", ".csv", ".uff", ".tdms")
STABLE_S = 2.0  # a file that is still written grows or is touched within that time


FileState = tuple[Path, int, int]  # a file, with its size and time [ns]


class WatchedFolder:
    """A folder that is looked at again and again. stable_s: how long a file must not change. Files that are there at
    the first look are old: they are not offered unless `old_too`, and are listed in `not_offered`."""

    def __init__(
        self,
        folder: Path,
        stable_s: float = STABLE_S,
        old_too: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.folder, self._stable_s, self._clock = folder, stable_s, clock
        self._seen: dict[FileState, float] = {}  # since when [s] each file is as it is
        self._offered: set[FileState] = set() if old_too else set(self._files())
        self.not_offered = sorted(path.name for path, _, _ in self._offered)

    def stable(self) -> list[Path]:
        """Return files that stopped changing, each once; one that changes later is offered again. Raises OSError."""
        now, before = self._clock(), self._seen
        self._seen = {file: before.get(file, now) for file in self._files()}
        still = {file for file, since in self._seen.items() if file in before and now - since >= self._stable_s}
        found = still - self._offered
        self._offered |= found
        return sorted(path for path, _, _ in found)

    def _files(self) -> list[FileState]:
        found = []
        for path in sorted(self.folder.iterdir()):
            if path.suffix.lower() in SUFFIXES and not path.name.startswith("."):
                try:
                    status = path.stat()
                except OSError:  # gone since the folder was listed, or a link in a circle
                    continue
                found.append((path, status.st_size, status.st_mtime_ns))
        return found


def pick_up(
    source: Path, folder: Path, section: str, name: str, store: Store, who: str, rig: Channels = NO_CHANNELS
) -> str:
    """Copy a record into the unit folder, hash it, enter it as input `name` of `section`; return its name there.

    rig: sources of the channels in the rig's records, written into the unit's [channels] if it has none. Raises
    RecordError for a file that is not as the input declares (an incomplete one is unreadable), UnitError."""
    declared = declared_file(folder, section, name)
    unit = units.read(folder)
    try:
        copy, sha256 = take_in(source, declared, folder, unit.channels or rig)
    except OSError as e:
        raise RecordError(f"{source.name}: cannot be copied ({e.strerror})") from e
    if rig and not unit.channels:
        toml_edit.state_channels(folder, rig)
    toml_edit.enter(folder, section, {name: copy})
    store.write(RecordPickedUp(section, name, copy, sha256, str(source.resolve())), unit.serial, who=who)
    return copy


def declared_file(folder: Path, section: str, name: str) -> Series | CsvTable:
    """Return the file that an input declares. Raises UnitError for any other name."""
    if section not in CHECKS:
        raise UnitError(folder, [f"no check '{section}' (known: {', '.join(CHECKS)})"])
    inputs: dict[str, Input] = CHECKS[section].inputs
    files = {key: i for key, i in inputs.items() if isinstance(i, Series | CsvTable)}
    if name not in files:
        raise UnitError(folder, [f"[{section}] has no file '{name}' (it has: {', '.join(files) or 'none'})"])
    return files[name]
