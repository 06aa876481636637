"""A unit with its files, each read once: the same bytes are hashed, judged, explained and attached to the certificate,
and estimates of a record are kept for the next caller."""

import hashlib
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from accept.units import unit_folder
from accept.units.unit_entry import EXPERIMENTS, FileEntry, UnitSection
from accept.units.unit_folder import UNIT_FILE, UnitFolder, inside, record_channels, vet_shared
from checks.cause import Cause, Reason, because
from checks.declare import CsvTable, Series, Values
from checks.errors import RecordError
from checks.record import Record
from hw.records import Source, list_channels, load_bytes, record_of, table_of
from specs.plugins import product_named, products
from specs.units import CHANNEL_LABELS, parse_column


def pointed_to_variant(
    error: RecordError, kind: str, declared: Series | CsvTable, read: Callable[[Series], Record]
) -> RecordError:
    """Return why a record was refused, with the variant of its product that it fits, if any. read: reads the file as
    declared, or raises RecordError."""
    for product in products().values():
        lost = isinstance(declared, Series) and declared.channels.keys() & product.absent.keys()
        if product.variant_of != kind or not isinstance(declared, Series) or not lost:
            continue
        try:
            read(declared.without(product.absent))
        except RecordError:
            continue
        title = f"{product.title[0].lower()}{product.title[1:]}"
        return RecordError(because(Cause.OTHER_VARIANT, detail=str(error.reason), title=title, kind=product.name))
    return error


RESPONSES = "frf"  # the section that experiments repeat under other conditions
HELD_BYTES = 256_000_000  # of one unit's files kept in memory: twenty times a strut's; the rest is read again


class LoadedUnit:
    """A unit's folder and its files as they were when they were read; lives as long as the unit is worked on.

    Beyond `HELD_BYTES` a file is hashed in passing, read again when it is needed, and refused if it changed."""

    def __init__(self, folder: UnitFolder, held_bytes: int = HELD_BYTES) -> None:
        self.folder = folder
        self._room = held_bytes
        self._sources: dict[str, Source] = {}
        self._values: dict[str, Values | RecordError] = {}

    def __repr__(self) -> str:
        sections = ", ".join(self.folder.sections)
        return f"LoadedUnit({self.folder.serial}, {self.folder.kind}, in {self.folder.path}: {sections})"

    @cached_property
    def hashes(self) -> dict[str, str]:
        """Return file name -> sha256 of `unit.toml` and of every readable named file."""
        found = {name: self._taken(name) for name in self.folder.files}
        text = hashlib.sha256(self.folder.text).hexdigest()
        return {UNIT_FILE: text} | {name: sha256 for name, sha256 in found.items() if sha256 is not None}

    @property
    def contents(self) -> dict[str, bytes]:
        """Return file name -> bytes, of the files that are held."""
        return {UNIT_FILE: self.folder.text} | {name: source.raw for name, source in self._sources.items()}

    def values(self, section: str) -> Values:
        """Return the values of a section with its files. Raises RecordError, which leaves all its findings without
        result, and KeyError for a section that the unit does not have."""
        return self._remembered(section, lambda: self._read(section))

    def experiment(self, name: str) -> Values:
        """Return records and value of an experiment. Raises RecordError, KeyError."""
        return self._remembered(f"{EXPERIMENTS} {name}", lambda: self._entries(self.folder.experiments[name]))

    def unexpected_channel(self, section: str) -> Reason | None:
        """Return the question about a signal in a channel that the product does not have, None without one. A constant
        channel was not connected."""
        entries = self.folder.sections[section].entries.items() if section in self.folder.sections else ()
        files = [(name, e.name, e.declared) for name, e in entries if isinstance(e, FileEntry)]
        records = [(name, file, declared) for name, file, declared in files if isinstance(declared, Series)]
        for name, file, declared in records:
            for channel, unit in declared.absent.items():
                with suppress(RecordError):
                    self._file(FileEntry(file, Series(name, name, {channel: unit}, step=declared.step)))
                    part = CHANNEL_LABELS.get(channel, channel).removesuffix(f" {channel}")
                    why = product_named(self.folder.kind).absent[channel]
                    asked = because(Cause.CHANNEL_NOT_EXPECTED, channel=channel, why=why, part=part)
                    return asked.within(name, file)
        return None

    def renames(self, name: str, source: str | None, section: UnitSection[Any]) -> bool:
        """Return whether a channel is read by another name than its own from a section's records, though they hold one
        of its name, or by the name of another channel. source: its name in the file, None for its own."""
        there = name if source is None else bare_name(source)
        return there != name and (there in record_channels() or name in self._names_in_files(section))

    def _names_in_files(self, section: UnitSection[Any]) -> set[str]:
        """Return the channel names in a section's readable records, without units and places."""
        found: set[str] = set()
        for name in section.files:
            with suppress(RecordError, OSError):
                found |= {bare_name(channel) for channel in list_channels(inside(self.folder.path, name))}
        return found

    def _remembered(self, key: str, read: Callable[[], Values]) -> Values:
        """Return the read content, or raise the same error again. Cached by key."""
        if key not in self._values:
            try:
                self._values[key] = read()
            except RecordError as e:
                self._values[key] = e
        values = self._values[key]
        if isinstance(values, RecordError):
            raise values
        return values

    def _read(self, name: str) -> Values:
        values = self._entries(self.folder.sections[name])
        if name == RESPONSES and self.folder.experiments:
            self._vet_experiments(values)
        return values

    def _entries(self, section: UnitSection[Any]) -> Values:
        if section.problem:
            raise RecordError(section.problem)
        values: dict[str, Any] = {}
        for name, entry in section.entries.items():
            try:
                values[name] = self._file(entry) if isinstance(entry, FileEntry) else entry
            except RecordError as e:
                raise RecordError(e.reason.within(name)) from e
        vet_twins(values)
        return values

    def _vet_experiments(self, values: Values) -> None:
        """Raise RecordError if responses and an experiment, or two experiments, contain the same recording: one of them
        was not measured."""
        every = dict(values)
        for name in self.folder.experiments:
            with suppress(RecordError):  # said where the experiment itself is asked for
                every |= {f"{name} {k}": v for k, v in self.experiment(name).items()}
        vet_twins(every)

    def _file(self, entry: FileEntry) -> Any:
        path = inside(self.folder.path, entry.name)
        known = self.hashes.get(entry.name)
        if entry.name not in self._sources and not path.exists():
            # Said here, without the folder's own path: a certificate is judged again elsewhere.
            raise RecordError(f"{entry.name}: no such file in the unit folder")
        source = self._sources.get(entry.name) or load_bytes(path)
        if isinstance(entry.declared, CsvTable):
            found: Any = table_of(source, entry.declared)
        else:
            found = self._record(source, entry.declared)
        if source.sha256 != known:
            raise RecordError(f"{entry.name} changed while it was read")
        return found

    def _record(self, source: Source, declared: Series) -> Record:
        def read(series: Series) -> Record:
            return record_of(source, series, self.folder.channels)

        try:
            return read(declared)
        except RecordError as e:
            raise pointed_to_variant(e, self.folder.kind, declared, read) from e

    def _taken(self, name: str) -> str | None:
        """Return the hash of a file, None without one. The bytes are kept if there is room. Raises UnitError."""

        def take(path: Path) -> str:
            if not 0 < path.stat().st_size <= self._room:
                return unit_folder.file_hash(path)
            self._sources[name] = source = load_bytes(path)
            self._room -= len(source.raw)
            return source.sha256

        return unit_folder.read_named(self.folder.path, name, take)


def bare_name(channel: str) -> str:
    """Return the name of a channel in a file without its unit and its structure."""
    return re.split(r"[./]", parse_column(channel)[0])[-1]


def loaded(unit: Path | UnitFolder | LoadedUnit) -> LoadedUnit:
    """Return the unit, loaded if it is a path. Raises UnitError without a unit there, or if another machine sees the
    folder otherwise."""
    if isinstance(unit, LoadedUnit):
        return unit
    folder = unit_folder.read(unit) if isinstance(unit, Path) else unit
    vet_shared(folder)
    return LoadedUnit(folder)


def contents_of(unit: Path | LoadedUnit) -> Mapping[str, bytes]:
    """Return the contents of a loaded unit; nothing for a path."""
    return unit.contents if isinstance(unit, LoadedUnit) else {}


def vet_twins(values: Mapping[str, Any]) -> None:
    """Raise RecordError if two inputs of a section contain the same recording, also under another name or format.

    Noise makes the last digits of two recordings differ, so equal samples are a copy."""
    records = {name: value for name, value in values.items() if isinstance(value, Record)}
    for (a, one), (b, other) in combinations(records.items(), 2):
        if one.sha256 == other.sha256 or _same_samples(one, other):
            a, b = (name.replace("_", " ") for name in (a, b))
            raise RecordError(f"{a} ({one.name}) and {b} ({other.name}) hold the same recording; give each its own")


def _same_samples(one: Record, other: Record) -> bool:
    shared = one.channels.keys() & other.channels.keys()
    return bool(shared) and all(np.array_equal(one[c], other[c]) for c in shared)
