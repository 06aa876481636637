"""The unit's folder on the disk: records copied in, `unit.toml` written from the state."""

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Any

import tomlkit

from accept.base.atomic_files import write_atomic
from accept.units.loaded_unit import pointed_to_variant
from accept.units.unit_entry import is_reserved
from accept.units.unit_folder import UNIT_FILE, file_hash
from checks.declare import CsvTable, Series
from checks.errors import RecordError
from hw import records
from specs.bench import NO_CHANNELS, Channels
from specs.files import read_bounded


def take_in(
    source: Path, declared: Series | CsvTable, folder: Path, channels: Channels = NO_CHANNELS, kind: str = ""
) -> tuple[str, str]:
    """Copy a record into the folder; return its name there and its sha256. If another file has that name, the new one
    gets a number. channels: our name -> source in the file. Raises OSError, and RecordError if it is not as declared;
    that names the variant of the product `kind` that it fits, if any."""
    try:
        if isinstance(declared, CsvTable):
            records.read_table(source, declared)
        else:
            records.read(source, declared, channels)
    except RecordError as e:
        raise pointed_to_variant(e, kind, declared, lambda series: records.read(source, series, channels)) from e
    return copy_in(source, folder, records.DEFAULT_LIMITS.max_bytes)


def copy_in(source: Path, folder: Path, most: int) -> tuple[str, str]:
    """Copy a file into the folder as it is; returns its name there and its sha256. A file of the same name and other
    content stays, the new one gets a number. most: bytes. Raises OSError, also if it has more."""
    content = read_bounded(source, most)
    digest = hashlib.sha256(content).hexdigest()
    name = _free_name(folder, source.name, digest, len(content))
    if not (folder / name).exists():
        write_atomic(folder / name, content)
    return name, digest


def lacks(source: Path, declared: Series | CsvTable, channels: Channels) -> list[str]:
    """Return which declared channels or columns a file lacks, by name only: no data are read; what is wrong with one
    that cannot be read.

    A structure may fit, because its channels are inside it. channels: our name -> source in the file."""
    try:
        found = _channels_now(source)
    except (RecordError, OSError) as e:
        return [" ".join(str(e).split())]
    if isinstance(declared, CsvTable):
        return [name for name in declared.columns if name not in found]

    def there(name: str) -> str:
        return (channels[name].name or name) if name in channels else name

    if not any(max(shape, default=0) > 1 for shape in found.values()):
        return []
    missing = [there(name) for name in declared.channels if name != "t" and there(name) not in found]
    timed = "t" in channels and channels["t"].sampling_time_s is not None
    timed |= any(there(name) in found for name in ("t", declared.step) if name)
    return missing if timed else [there("t"), *missing]


def damage(source: Path) -> str:
    """Return why not even the names of a file's channels can be read, "" if they can."""
    try:
        _channels_now(source)
    except (RecordError, OSError) as e:
        return " ".join(str(e).split())
    return ""


def _channels_now(source: Path) -> dict[str, tuple[int, ...]]:
    status = source.stat()
    found = _channels_of(source, status.st_mtime_ns, status.st_size)
    if isinstance(found, RecordError):
        raise found
    return found


@lru_cache(maxsize=2000)
def _channels_of(source: Path, _mtime_ns: int, _size: int) -> dict[str, tuple[int, ...]] | RecordError:
    """Return the channels of a file, or why they cannot be read. Cached until the file changes. Raises OSError."""
    try:
        return dict(records.list_channels(source))
    except RecordError as e:
        return e


def _free_name(folder: Path, name: str, digest: str, size: int) -> str:
    path, number = Path(name), 1
    tried = name
    while is_reserved(tried) or tried.startswith(".") or (folder / tried).exists():
        there = folder / tried
        if not is_reserved(tried) and there.is_file() and there.stat().st_size == size and file_hash(there) == digest:
            return tried
        number += 1
        tried = f"{path.stem.lstrip('.') or 'record'}-{number}{path.suffix}"
    return tried


def text_of(document: dict[str, Any]) -> bytes:
    """Return `unit.toml`: equal documents give equal bytes."""
    return tomlkit.dumps(document).encode("utf-8")


def write_document(folder: Path, document: dict[str, Any]) -> None:
    """Write `unit.toml`. Raises OSError."""
    write_atomic(folder / UNIT_FILE, text_of(document), of_unit=True)
