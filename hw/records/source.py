"""The source of a record, from a path to what its file declares: its bytes within the limits, format and variables."""

import hashlib
import struct
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from checks.errors import RecordError
from hw.records.contents.variable import Variable
from hw.records.limits import DEFAULT_LIMITS
from hw.records.mat5 import HEADER_BYTES, open_mat5
from hw.records.text.file import SUFFIXES, open_csv
from hw.records.uff.record import open_uff
from hw.records.uff.set58 import DELIMITER
from specs.files import read_bounded

SIGNATURE = b"\x89HDF\r\n\x1a\n"
TDMS = b"TDSm"
MATLAB5 = (b"\x00\x01IM", b"\x01\x00MI")
USERBLOCK_BYTES = 512  # of text that MATLAB puts before the HDF5 file


@dataclass(frozen=True, eq=False)
class Source:
    """The bytes of a file: the hashed bytes are parsed, even if the file changes meanwhile."""

    file: str
    suffix: str
    raw: bytes

    @cached_property
    def sha256(self) -> str:
        return hashlib.sha256(self.raw).hexdigest()

    @property
    def is_text(self) -> bool:
        """Return whether the file is a table, by its ending, unless its content is that of another format."""
        raw = self.raw
        binary = raw.startswith((SIGNATURE, TDMS)) or raw.startswith(SIGNATURE, USERBLOCK_BYTES)
        other = binary or raw[124:128] in MATLAB5 or DELIMITER.match(raw)
        return self.suffix in SUFFIXES and not other

    def variables(self) -> dict[str, Variable]:
        """Return the variables by name, in file order. Raises RecordError, and what `damage.refused` converts."""
        raw = self.raw
        if raw.startswith(SIGNATURE) or raw.startswith(SIGNATURE, USERBLOCK_BYTES):
            from hw.records.mat73 import open_mat73  # loads h5py: only when wanted

            return open_mat73(self.file, raw)
        if len(raw) >= HEADER_BYTES and raw[124:128] in MATLAB5:
            return open_mat5(self.file, raw)
        if raw.startswith(TDMS):
            from hw.records.tdms import open_tdms  # loads nptdms: only when wanted

            return open_tdms(self.file, raw)
        if DELIMITER.match(raw):
            return open_uff(self.file, raw)
        if self.suffix in SUFFIXES:
            return open_csv(self.file, raw)
        if _is_matlab4(raw):
            raise RecordError(f"{self.file}: is a MATLAB 4 file (save -v4), expected MATLAB 5 to 7.3: save it with -v7")
        raise RecordError(
            f"{self.file}: is none of MATLAB 5 to 7.3 (.mat), .csv, .uff, .tdms; it starts with {ascii(raw[:20])[1:]}"
        )


def _is_matlab4(raw: bytes) -> bool:
    """Return whether the bytes begin with a MATLAB 4 header: type, rows, columns, complex, and its name's length."""
    for order in "<>":
        if len(raw) > 20:
            kind, rows, columns, is_complex, length = struct.unpack_from(f"{order}5i", raw)
            name = raw[20 : 20 + length]
            if 0 <= kind < 5000 and min(rows, columns) >= 0 and is_complex in (0, 1) and 1 < length <= 64:
                return name[-1:] == b"\0" and name[:-1].replace(b"_", b"").isalnum()
    return False


def load_bytes(path: Path, max_bytes: int = DEFAULT_LIMITS.max_bytes) -> Source:
    """Return all bytes of a file. Raises RecordError if it is missing, not a file, empty, too large or not readable."""
    try:
        raw = read_bounded(path, max_bytes)
    except FileNotFoundError as e:
        place = "" if path.parent == Path() else f" in {path.parent}"
        raise RecordError(f"{path.name}: no such file{place}") from e
    except OSError as e:
        raise RecordError(f"{path.name}: cannot be read: {e.strerror}") from e
    if not raw:
        raise RecordError(f"{path.name}: is empty (0 bytes)")
    return Source(path.name, path.suffix.lower(), raw)
