"""Files that are either whole or absent."""

import errno
import os
import re
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from specs.errors import AcceptError
from specs.files import UNIT_FILE

PART = ".part"  # how the name of a temporary file ends
LEFTOVER_S = 3600.0  # writing one file takes seconds
HEADS: Mapping[str, tuple[bytes, ...]] = {  # how the files begin that this program writes
    ".pdf": (b"%PDF",),
    ".json": (b"{", b"["),
    ".png": (b"\x89PNG",),
    ".svg": (b"<",),
    ".html": (b"<",),
}

_TIMES = (b"t", b"time")  # columns with which a recording begins

_UMASK = os.umask(0o077)  # can only be read by setting it; here, before any thread is there
os.umask(_UMASK)


class ReplaceError(AcceptError, ValueError):
    """A file that is not an earlier output; nothing is written over it."""


def check_place(path: Path, kind: str = "") -> None:
    """Raise, before long work, the OSError that would prevent `path` from being written after it, or ReplaceError.
    kind: ending of such an output; "": that of the path."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    there = next(folder for folder in path.absolute().parents if folder.exists())
    if not there.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(there))
    if not os.access(there, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(there))
    if path.is_file():
        _check_replaced(path, kind or path.suffix.lower())


def check_table(path: Path, content: bytes) -> None:
    """Raise ReplaceError if a table would replace one of other columns, such as a recording that belongs to no unit. An
    earlier output with more or fewer columns begins with the same one, unless that is the time."""
    if path.is_file():
        with path.open("rb") as file:
            before, now = file.readline(len(content)).strip(), content.partition(b"\n")[0].strip()
        first = now.partition(b",")[0]
        if before and before != now and (first.lower() in _TIMES or before.partition(b",")[0] != first):
            raise ReplaceError(_OTHER.format(path, ".csv"))


def check_places(*paths: Path | None, **kinds: Path | None) -> None:
    """Check the places that are given, those with a keyword as outputs of this ending: see `check_place`."""
    for path in filter(None, paths):
        check_place(path)
    for kind, place in kinds.items():
        if place is not None:
            check_place(place, f".{kind}")


def _check_replaced(path: Path, kind: str) -> None:
    """Raise ReplaceError if a file is evidence of a unit, or not an earlier output of this kind."""
    _check_no_evidence(path)
    if kind in HEADS:
        with path.open("rb") as file:
            head = file.read(16).lstrip(b"\xef\xbb\xbf \r\n\t")
        ours = not head or head.startswith(HEADS[kind])
    else:  # its content does not distinguish an output from a recording
        ours = path.suffix.lower() == kind and not path.with_name(UNIT_FILE).exists()
    if not ours:
        raise ReplaceError(_OTHER.format(path, kind))


def _check_no_evidence(path: Path) -> None:
    place = path.absolute()
    for folder in place.parents if place.is_file() else ():
        unit = folder / UNIT_FILE
        if unit.is_file() and (unit.samefile(place) or any(map(place.samefile, _named_files(unit)))):
            raise ReplaceError(_EVIDENCE.format(path, unit))


def _named_files(unit: Path) -> list[Path]:
    """Return the files named by quoted text in a unit.toml, also in one that cannot be parsed."""
    quoted = re.split("[\"']", unit.read_text(encoding="utf-8", errors="replace"))
    return [unit.parent / name for name in quoted if name and os.path.isfile(unit.parent / name)]


_EVIDENCE = "{}: is evidence of the unit in {}, and nothing is written over it. Name another file for the output"
_OTHER = "{}: exists, and is not an earlier {} output, so it is not replaced. Name another file, or move this one away"


def write_atomic(path: Path, content: bytes, mode: int = 0o666, of_unit: bool = False) -> None:
    """Replace `path` by `content`; a crash at any moment leaves the old file or the new one, never half of one. mode:
    permissions, of which the umask takes its part. of_unit: as `writing_atomic`."""
    with writing_atomic(path, mode, of_unit=of_unit) as file:
        file.write(content)


def write_new(path: Path, content: bytes) -> None:
    """Write a new file with permissions for its owner only. If several programs write it at the same time, one succeeds
    and none reads an incomplete file. Raises FileExistsError."""
    with writing_atomic(path, 0o600, put=_put_new) as file:
        file.write(content)


@contextmanager
def writing_atomic(
    path: Path, mode: int = 0o666, put: Callable[[str, Path], None] = os.replace, of_unit: bool = False
) -> Iterator[IO[bytes]]:
    """Yield a file to write piece by piece; `put` moves it to `path` at the end unless an error is raised. of_unit: it
    is written into its unit, so it may replace evidence; else raises ReplaceError."""
    if not of_unit:
        _check_no_evidence(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=PART)
    except OSError as e:
        raise OSError(e.errno, e.strerror, str(path)) from e  # the caller does not know the temporary name
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, mode & ~_UMASK)
        put(temporary, path)
    except OSError as e:
        Path(temporary).unlink(missing_ok=True)
        raise OSError(e.errno, e.strerror, str(path)) from e  # the error of writing does not name the file
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def remove_leftovers(*folders: Path, older_s: float = LEFTOVER_S) -> None:
    """Remove old temporary files of killed programs from these folders. Another program, on any machine, may still be
    writing a young one."""
    for folder in folders:
        for path in folder.glob(f".*{PART}"):
            with suppress(OSError):  # of another user, or gone meanwhile
                if path.is_file() and time.time() - path.stat().st_mtime > older_s:
                    path.unlink()


def _put_new(temporary: str, path: Path) -> None:
    """Move a file to a new path. Raises FileExistsError."""
    try:
        os.link(temporary, path)
    except OSError:  # it is there, or a file system without hard links: until it is moved, others find an empty file
        os.close(os.open(path, os.O_CREAT | os.O_EXCL, 0o600))
        os.replace(temporary, path)
    else:
        os.unlink(temporary)


def _sync_folder(folder: Path) -> None:
    """Sync a folder, so that a rename survives a power cut. Windows cannot open a folder."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
