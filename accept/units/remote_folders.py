"""Unit folders at an address: in an object store, an archive, on a web server. They are fetched first, so that judging,
hashes and attachments use files of this machine, under the same rules as local ones.

Only `unit.toml` and the files it names are fetched, with the size limits of local ones. A unit that cannot be fetched
whole is refused: without a file it would only seem incomplete. File names from a foreign server are not trusted."""

import csv
import hashlib
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from typing import Any

from accept.base.atomic_files import writing_atomic
from accept.base.plain_text import without_secrets
from accept.units import unit_folder
from accept.units.unit_folder import MAX_UNIT_TOML_BYTES, UNIT_FILE, UnitError
from checks.errors import RecordError
from hw.records import DEFAULT_LIMITS
from specs.distribution import install
from specs.errors import AcceptError

FETCHED = "fetched"  # folder of them, in that of the results
LIST = "fetched.csv"
MAX_DEPTH, MAX_ENTRIES = 8, 5_000_000  # of a listing: one that has no end is given up
CHUNK_BYTES = 1 << 20
ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+(::[A-Za-z][A-Za-z0-9+.-]+)*://")

Say = Callable[[str], None]
Refused = tuple[str, str]  # where, and why


class RemoteError(AcceptError, RuntimeError):
    """An address cannot be fetched; the text states the reason and the remedy."""


class _NotWhole(Exception):
    """A file that broke off or has no end."""


def is_remote(where: str) -> bool:
    """Return whether this is an address of fsspec (`s3://BUCKET/units`, `zip://::units.zip`) and no path."""
    return ADDRESS.match(where) is not None and not where.startswith("file://")


def fetched(wheres: Sequence[str], out: Path, say: Say) -> tuple[list[Path], list[Refused]]:
    """Return the named folders on this machine, and the addresses that could not be fetched whole. Paths (and
    `file://`) are returned unchanged; others are fetched into a folder of `out`.

    Raises RemoteError if an address cannot be listed or has no unit, OSError if `out` cannot be written."""
    paths: list[Path] = []
    refused: list[Refused] = []
    for where in wheres:
        if is_remote(where):
            found, lost = _fetch_all(where, out / FETCHED, say)
            paths += found
            refused += lost
        else:
            paths.append(Path(where.removeprefix("file://")))
    return paths, refused


def _fetch_all(where: str, out: Path, say: Say) -> tuple[list[Path], list[Refused]]:
    paths: list[Path] = []
    refused: list[Refused] = []
    place = out / f"{_recognised(without_secrets(where))}-{_short(where)}"
    with _listed(place / LIST) as listed:
        for fs, folder, address in _unit_folders(where):
            target = place / f"{_recognised(folder)}-{_short(folder)}"  # beside each other, whatever is in what there
            try:
                for name, size, sha256 in _fetch(fs, folder, target):
                    listed.writerow([address, name, target.name, size, sha256])
            except Exception as e:  # noqa: BLE001 - every kind of place has its own errors
                words = str(e) if isinstance(e, _NotWhole) else f"{type(e).__name__}: {e}"
                refused.append((address, f"{address}: could not be fetched whole: {without_secrets(words)}"))
            else:
                paths.append(target)
    if not paths and not refused:
        raise RemoteError(f"{without_secrets(where)}: holds no {UNIT_FILE}, neither itself nor in any folder below")
    say(f"{without_secrets(where)}: {len(paths)} units fetched into {place}")
    return paths, refused


def _unit_folders(where: str) -> Iterator[tuple[Any, str, str]]:
    """Yield (file system, unit folder there, its address) of each at or below an address. Raises RemoteError."""
    shown = without_secrets(where)
    try:
        from fsspec.core import url_to_fs
    except ImportError as e:
        raise RemoteError(f"{shown}: fsspec is not installed ({e}): {install('remote')}") from e
    entries = 0
    try:
        fs, root = url_to_fs(where)
        if not fs.exists(root):
            raise FileNotFoundError("there is nothing")
        for folder, folders, files in fs.walk(root, maxdepth=MAX_DEPTH, on_error="raise"):
            entries += len(folders) + len(files)
            if entries > MAX_ENTRIES:
                raise RemoteError(f"{shown}: lists more than {MAX_ENTRIES} names; name a smaller part of it")
            if UNIT_FILE in files and folder.startswith(root):
                yield fs, folder, _below(shown, folder.removeprefix(root).strip("/"))
    except RemoteError:
        raise
    except Exception as e:  # every kind of place has its own errors
        raise RemoteError(f"{shown}: cannot be listed: {type(e).__name__}: {without_secrets(str(e))}") from e


def _below(where: str, relative: str) -> str:
    """Return the address of a folder below another. In a chain (`zip://...::...`) the first link is the innermost."""
    first, chain, rest = where.partition("::")
    return f"{first.rstrip('/') if relative else first}{'/' if relative else ''}{relative}{chain}{rest}"


def _fetch(fs: Any, folder: str, target: Path) -> Iterator[tuple[str, int, str]]:
    """Yield (name, size, sha256) of `unit.toml` and of the files it names. A name that leads outside is not followed;
    judging refuses it. A file that is absent there is removed here."""
    yield _copy(fs, folder, target, UNIT_FILE, MAX_UNIT_TOML_BYTES)
    try:
        names = unit_folder.read(target).files
    except UnitError:
        return  # refused with every other problem, when it is judged
    for name in names:
        try:
            local = unit_folder.inside(target, name)
        except (RecordError, ValueError):
            continue
        try:
            yield _copy(fs, folder, target, name, DEFAULT_LIMITS.max_bytes)
        except FileNotFoundError:
            local.unlink(missing_ok=True)


def _copy(fs: Any, folder: str, target: Path, name: str, limit: int) -> tuple[str, int, str]:
    size, digest = 0, hashlib.sha256()
    with fs.open(f"{folder.rstrip('/')}/{name}", "rb") as source, writing_atomic(target / name, of_unit=True) as file:
        while content := _read(source, name):
            size += len(content)
            if size > limit:
                raise _NotWhole(f"{name} is larger than {limit} bytes")
            digest.update(content)
            file.write(content)
    return name, size, digest.hexdigest()


def _read(source: Any, name: str) -> bytes:
    """Return the next bytes. An error of the source is kept apart from one of the written file."""
    try:
        content: bytes = source.read(CHUNK_BYTES)
    except OSError as e:
        raise _NotWhole(f"{name}: {type(e).__name__}: {e}") from e
    return content


@contextmanager
def _listed(path: Path) -> Iterator[Any]:
    """Open the list of fetched files: address, file, target folder, size and hash."""
    with writing_atomic(path) as file:
        text = TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
        listed = csv.writer(text)
        listed.writerow(["address", "file", "folder", "bytes", "sha256"])
        yield listed
        text.flush()
        text.detach()


def _recognised(where: str) -> str:
    """Return a folder name from the end of an address; `_short` makes it unique."""
    return re.sub(r"[^A-Za-z0-9]+", "-", where).strip("-")[-40:].strip("-") or "units"


def _short(where: str) -> str:
    return hashlib.sha256(where.encode()).hexdigest()[:12]
