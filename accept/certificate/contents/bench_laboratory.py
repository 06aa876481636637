"""`laboratory.toml` of a bench.

The file lies in the folder of the bench (`ACCEPT_HOME`). Every key may be absent: an absent one is left out of the
certificate, and `accept spec check --iso17025` names it.
"""

from pathlib import Path
from typing import Any

from accept.certificate.contents.laboratory import LABORATORY_FILE, LaboratoryFile
from specs.strict import file_bytes, parse_as


class Laboratory(LaboratoryFile):
    """A `laboratory.toml` that was read."""

    sha256: str
    text: str
    path: str


def laboratory_of(home: Path) -> Laboratory | None:
    """Return the content of a bench's `laboratory.toml`, None without that file. Raises SpecError."""
    path = home / LABORATORY_FILE
    if not path.exists():
        return None
    return parse_as(Laboratory, LaboratoryFile, file_bytes(path), str(path), path=str(path))


def contents_of(laboratory: LaboratoryFile) -> dict[str, Any]:
    """Return the keys of the file that are given, as `LaboratoryFile` takes them."""
    return laboratory.model_dump(include=set(LaboratoryFile.model_fields), exclude_defaults=True)
