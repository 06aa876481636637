"""Reading files from elsewhere: regular files only, and never more bytes than were asked for."""

import errno
import json
import logging
import os
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

UNIT_FILE = "unit.toml"
TEXT_BYTES = 10_000_000  # of a spec, a key, a setting: people's files are far smaller
CERTIFICATE_BYTES = 100_000_000  # with the files attached to it: 13 MB for a strut, 20 MB of records at most
MOST_ENTRIES = 200  # of a table or a list that people write: the store is asked about every part
MOST_LETTERS = 100_000  # of a section: a page of them takes 2 s, of ten times as many 200 s
MOST_IN_TEXT = 20_000  # letters of one text: the time of a page grows with the square of it
CHUNK_BYTES = 65536  # read at once
log = logging.getLogger("accept.files")


def read_bounded(path: Path, limit: int = TEXT_BYTES) -> bytes:
    """Return all bytes of a regular file of at most `limit` bytes.

    A pipe or a device is not read: it may never end. Raises OSError, whose `strerror` states the reason."""
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        found = os.fstat(handle)
        vet_regular(found, limit, path)
        with os.fdopen(handle, "rb", closefd=False) as file:
            # A read allocates its buffer at once: of the file's size, not of the limit's.
            content = file.read(found.st_size + 1)
            while len(content) <= limit and (more := file.read(CHUNK_BYTES)):  # grown, or of untold size
                content += more
    finally:
        os.close(handle)
    if len(content) > limit:
        raise OSError(errno.EFBIG, f"has more than {limit} bytes, which are not read", str(path))
    log.info("read %s, %d bytes", path, len(content))
    return content


def vet_regular(found: os.stat_result, limit: int, path: Path) -> None:
    """Raise OSError unless this is a regular file of at most `limit` bytes."""
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, "is a folder, expected a file", str(path))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "is a pipe or a device, expected a regular file", str(path))
    if found.st_size > limit:
        raise OSError(errno.EFBIG, f"has {found.st_size} bytes, at most {limit} are read", str(path))


def json_of(raw: bytes | str) -> Any:
    """Parse JSON that this process did not write. Raises ValueError if it is not JSON or is nested too deeply."""
    try:
        return json.loads(raw)
    except RecursionError as e:
        raise ValueError("it is nested too deeply") from e


def size_problems(data: Mapping[str, Any], entries: int = MOST_ENTRIES, letters: int = MOST_LETTERS) -> list[str]:
    """Return which sections of a document are larger than anything that a person or a rig writes there."""
    found = [] if len(data) <= entries else [f"has {len(data)} entries, at most {entries} are read"]
    bounds = {"entries": entries, "letters": letters, "letters in one text": MOST_IN_TEXT}
    for key, content in [] if found else data.items():
        nested = [key, *_nested(content)]
        most = max((len(each) for each in nested if not isinstance(each, str)), default=0)
        texts = [len(each) for each in nested if isinstance(each, str)]
        for size, (what, limit) in zip((most, sum(texts), max(texts)), bounds.items(), strict=True):
            found += [f"[{key}] has {size} {what}, at most {limit} are read"] if size > limit else []
    return found


def _nested(content: Any) -> Iterator[Any]:
    if isinstance(content, dict | list | str):
        yield content
    if isinstance(content, dict | list):
        for each in content if isinstance(content, list) else (*content, *content.values()):
            yield from _nested(each)
