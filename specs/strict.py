"""TOML read strictly: an unknown key, a wrong type, a number that is not finite are errors with their key path."""

import hashlib
import re
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from specs.errors import ProblemsError
from specs.files import read_bounded

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
LONGEST = 2000  # letters of one text: a page of a million takes minutes
Words = Annotated[str, Field(min_length=1, max_length=LONGEST)]
MAX_TOML_BYTES = 4_000_000  # the largest model file of a batch takes a tenth
MAX_KEY_PARTS = 100  # of a dotted key; the files of this program have four
_BETWEEN_DOTTED = re.compile(rb"[=,\[\]{}\n#]")  # dots of one key stand between two of these
Full = TypeVar("Full", bound="Strict")


class SpecError(ProblemsError):
    """The problems of a spec or another TOML file, a line each: file, key path, fault."""


class Strict(BaseModel):
    """A section of a file: frozen, strict about types, without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)  # most are never used


def file_bytes(path: Path) -> bytes:
    """Return a file's bytes. Raises SpecError if it cannot be read."""
    try:
        return read_bounded(path)
    except OSError as e:
        raise SpecError(str(path), [f"cannot be read: {e.strerror}"]) from e


def file_named(name: str | Path, built_in: Mapping[str, Path], kind: str) -> Path:
    """Return the file of a built-in name or of a path. kind: `spec`, `model`. Raises SpecError for any other name."""
    if (found := built_in.get(str(name), Path(name))).suffix != ".toml":
        raise SpecError(str(name), [f"no such {kind} (built-in: {', '.join(built_in)}; or give a .toml file)"])
    return found


def parse_as(full: type[Full], document: type[Strict], raw: bytes, name: str, **origin: str) -> Full:
    """Parse the bytes of a TOML file into a `full`: the keys of `document`, the bytes' sha256 and text, and `origin`.

    name: of the file, for messages. Raises SpecError listing every problem with its key path."""
    try:
        data = toml_of(raw)
        text = raw.decode("utf-8")
        document.model_validate(data)  # first alone, so that a file cannot bring its own hash
        return full.model_validate({**data, "sha256": hashlib.sha256(raw).hexdigest(), "text": text, **origin})
    except ValidationError as e:  # is a ValueError too
        raise SpecError(name, [problem_line(problem) for problem in e.errors()]) from e
    except ValueError as e:
        raise SpecError(name, [str(e)]) from e


def toml_of(raw: bytes) -> dict[str, Any]:
    """Parse the bytes of a TOML file. Raises ValueError with the reason if they are no TOML."""
    check_toml_bounds(raw)
    try:
        return tomllib.loads(raw.decode("utf-8-sig"))  # editors on Windows put a mark in front
    except UnicodeDecodeError as e:
        raise ValueError(f"is not UTF-8: byte {e.start} is 0x{raw[e.start]:02x}") from e
    except tomllib.TOMLDecodeError as e:
        raise ValueError(f"is not TOML: {e}") from e
    except RecursionError as e:
        raise ValueError("is not TOML: it is nested too deeply") from e
    except ValueError as e:  # Python converts no more digits; no measurement has so many
        raise ValueError(f"holds a number of more than {sys.get_int_max_str_digits()} digits") from e


def check_toml_bounds(raw: bytes) -> None:
    """Raise ValueError for bytes that a TOML parser takes long for: too many, or too many parts in a key."""
    if len(raw) > MAX_TOML_BYTES:
        raise ValueError(f"is larger than {MAX_TOML_BYTES} bytes")
    if any(part.count(b".") > MAX_KEY_PARTS for part in _BETWEEN_DOTTED.split(raw)):
        raise ValueError(f"has a dotted key of more than {MAX_KEY_PARTS} parts, or as many dots in one line of words")


def problem_line(problem: Mapping[str, Any]) -> str:
    """Return a problem of a document in words: key path, fault, and the value."""
    key = ".".join(str(k) for k in problem["loc"]) or "top level"
    words = problem["msg"].removeprefix("Value error, ")
    value = problem.get("input")
    # A validator of this program ("value_error") names the value itself.
    got = "" if isinstance(value, dict) or problem["type"] == "value_error" else f" (got {value!r})"
    if problem["type"] == "extra_forbidden":
        words, got = "unknown key", ""
    elif problem["type"] == "missing":
        words, got = "is missing", ""
    return f"[{key}] {words}{got}"
