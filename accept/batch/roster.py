"""The units of one batch, in a private temporary file on disk: memory stays flat however many there are."""

import pickle
import sqlite3
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from accept.base.documents.results import UnitRecord
from accept.base.spelling import spelling_key
from accept.units import unit_folder
from accept.units.unit_folder import UnitFolder

HELD = 2000  # units kept as they were read; the others are read again


class Roster:
    """Folders by serial, and which of them were judged, by which event. A context manager.

    One serial in two folders is a clash, also if they differ only in capitals: a file system may take a and A for one.
    """

    def __init__(self) -> None:
        self._file = sqlite3.connect("")  # in memory while it is small, else in a temporary file without a name
        self._file.execute(
            "CREATE TABLE unit (place TEXT PRIMARY KEY, path TEXT, serial TEXT, key TEXT, "
            "refused INTEGER DEFAULT 0, seq INTEGER, unchanged INTEGER, found BLOB, "
            "earlier INTEGER DEFAULT 0, since INTEGER DEFAULT 1)"
        )
        self._held: dict[Path, UnitFolder] = {}
        self._file.execute("CREATE INDEX by_key ON unit (key)")
        self._file.execute("CREATE INDEX by_serial ON unit (serial)")

    def __enter__(self) -> "Roster":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, unit: UnitFolder) -> None:
        """Add a folder; a folder that is named twice counts once."""
        if len(self._held) < HELD:
            self._held.setdefault(unit.path, unit)
        row = (str(unit.path.resolve()), str(unit.path), unit.serial, spelling_key(unit.serial))
        self._file.execute("INSERT OR IGNORE INTO unit (place, path, serial, key) VALUES (?, ?, ?, ?)", row)

    def clashes(self) -> Iterator[tuple[str, Path, list[str]]]:
        """Yield (serial, folder, the other folders) of each that shares a serial; they are refused from here on."""
        twice = "SELECT key FROM unit GROUP BY key HAVING COUNT(*) > 1"
        rows = self._file.execute(f"SELECT serial, path, key FROM unit WHERE key IN ({twice}) ORDER BY serial, path")
        for serial, path, key in rows.fetchall():
            others = self._file.execute("SELECT path FROM unit WHERE key = ? AND path != ? ORDER BY path", (key, path))
            yield serial, Path(path), [other for (other,) in others]
        self._file.execute(f"UPDATE unit SET refused = 1 WHERE key IN ({twice})")

    def folders(self) -> Iterator[Path]:
        """Yield the folders of the units that are not refused, by serial."""
        rows = self._file.execute("SELECT path FROM unit WHERE refused = 0 ORDER BY serial")
        return (Path(path) for (path,) in rows)

    def unit(self, path: Path) -> UnitFolder:
        """Return the cached unit, read again if it was evicted. Raises UnitError."""
        return self._held.get(path) or unit_folder.read(path)

    def folder(self, serial: str) -> Path | None:
        """Return the folder of a unit of this batch, None if it has no such unit."""
        row = self._file.execute("SELECT path FROM unit WHERE serial = ? AND refused = 0", (serial,)).fetchone()
        return None if row is None else Path(row[0])

    def place(self, serial: str) -> int:
        """Return the place of a unit among the folders, in the order in which they were found."""
        row = self._file.execute("SELECT rowid FROM unit WHERE serial = ? AND refused = 0", (serial,)).fetchone()
        return int(row[0]) - 1

    def refuse(self, path: Path) -> None:
        self._file.execute("UPDATE unit SET refused = 1 WHERE place = ?", (str(path.resolve()),))

    def judged(self, serial: str, seq: int | None, unchanged: bool = False) -> None:
        """Note the event that holds the unit's result; a later one replaces an earlier one."""
        row = (seq, int(unchanged), serial)
        self._file.execute("UPDATE unit SET seq = ?, unchanged = ? WHERE serial = ? AND refused = 0", row)

    def event(self, serial: str) -> int | None:
        """Return the number of the event that holds the unit's result, None before it was judged."""
        row = self._file.execute("SELECT seq FROM unit WHERE serial = ? AND refused = 0", (serial,)).fetchone()
        return None if row is None else row[0]

    def keep(self, result: UnitRecord) -> None:
        """Keep the result of a unit in this run, without its pictures."""
        row = (zlib.compress(pickle.dumps(replace(result, panels={})), 1), result.serial)
        self._file.execute("UPDATE unit SET found = ? WHERE serial = ? AND refused = 0", row)

    def found(self, serial: str) -> UnitRecord | None:
        """Return the result of a unit in this run, None if it was not judged in it."""
        row = self._file.execute("SELECT found FROM unit WHERE serial = ? AND refused = 0", (serial,)).fetchone()
        result: UnitRecord | None = None if row is None or row[0] is None else pickle.loads(zlib.decompress(row[0]))
        return result

    def known(self, serial: str, earlier: int, since: int) -> None:
        """Note how many judgements of the serial were counted, in events before number `since`."""
        row = (earlier, since, serial)
        self._file.execute("UPDATE unit SET earlier = ?, since = ? WHERE serial = ? AND refused = 0", row)

    def results(self) -> Iterator[tuple[str, int, int, int]]:
        """Yield (serial, number of its event, and what `known` counted: earlier, since), by serial."""
        columns = "serial, seq, earlier, since"
        return iter(self._file.execute(f"SELECT {columns} FROM unit WHERE seq IS NOT NULL ORDER BY serial"))

    def count(self, which: str = "refused = 0") -> int:
        """Return the number of units that are not refused. which: `seq IS NOT NULL` for judged, `unchanged` for those
        judged before."""
        found: tuple[int] = self._file.execute(f"SELECT COUNT(*) FROM unit WHERE {which}").fetchone()
        return found[0]
