"""Parsing of typed entries: `4.99 uF`, `4,99`, `4.99 ± 0.02 uF`; an invalid one is refused with the reason."""

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import unquote

from accept.base import spelling
from checks.declare import Measured, Scalar, Vector
from specs.errors import AcceptError
from specs.spec import Limit, Spec, SpecDocument
from specs.units import BASES, PREFIXES, UnitMismatch, factor

_ATTEMPT = re.compile(r"_(attempt|superseded)-\d+$", re.IGNORECASE)  # accept.workflow names files so

_NUMBER = r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?"
_ENTRY = re.compile(
    rf"\s*(?P<value>{_NUMBER})\s*(?:(?:±|\+/-|\+-)\s*(?P<U>{_NUMBER}))?\s*(?P<unit>[^\d\s.,+±-]\S*)?\s*"
)
_MAX_LENGTH = 80  # characters: a number, its uncertainty and their units are far shorter


class EntryError(AcceptError, ValueError):
    """An entry that is refused; the text says why, short enough to stand beside the field."""


def parse_scalar(text: str, declared: Scalar) -> Measured:
    """Return the value, and U if it was typed, in the declared unit. Raises EntryError."""
    measured = parse_number(text, declared.unit)
    check_plausible(measured.value, declared)
    return measured


def check_plausible(value: float, declared: Scalar) -> None:
    """Raise EntryError if a value is impossible."""
    if value <= 0.0 < declared.lo:
        raise EntryError(f"{value:g} {declared.unit} is not plausible: expected a positive number")
    if not declared.lo <= value <= declared.hi:
        raise EntryError(
            f"{value:g} {declared.unit} is not plausible: expected {declared.lo:g} to {declared.hi:g} {declared.unit}"
        )


_POWERS = (1, -1, 2, -2, 3, -3, 6, -6)  # of ten: a slipped decimal point, or another prefix of the unit


def usual_range(declared: Scalar | Vector, limits: Mapping[str, Limit]) -> tuple[float, float] | None:
    """Return the range in which a value commonly lies: as declared, else a factor of two about the limits of the
    quantity of that name; None if neither is given. A limit on one side reaches to three times itself."""
    if declared.usual is not None:
        return declared.usual
    limit = _limit(declared, limits)
    if limit is None:
        return None
    lower, upper = limit.lower, limit.upper
    if lower is not None and lower > 0:
        return lower / 2, 2 * (upper if upper is not None else 1.5 * lower)
    return None


def passing_range(declared: Scalar | Vector, limits: Mapping[str, Limit]) -> tuple[float, float] | None:
    """Return the limits of the quantity of that name; None without two of them."""
    limit = _limit(declared, limits)
    return None if limit is None or limit.lower is None or limit.upper is None else (limit.lower, limit.upper)


def _limit(declared: Scalar | Vector, limits: Mapping[str, Limit]) -> Limit | None:
    return limits.get(declared.name) or limits.get(declared.name.replace("k_", "k_closed_", 1))


def doubt(
    value: float, unit: str, usual: tuple[float, float] | None, passing: tuple[float, float] | None = None
) -> str:
    """Return the question to ask before a value is stored that a mistyped point or another unit would explain, or that
    lies ten times outside the usual range; "" if none is needed. A value that is simply bad is not doubted: a dead
    stack reads a third. passing: the limits; no value beyond them is proposed in place of the one typed."""
    if usual is None or usual[0] <= value <= usual[1]:
        return ""
    meant = next((value * 10.0**p for p in _POWERS if usual[0] <= value * 10.0**p <= usual[1]), None)
    if usual[0] > 0 and meant is not None:
        if passing is not None and not passing[0] <= meant <= passing[1]:
            return f"{value:.6g} {unit} is unusual; {passing[0]:g} to {passing[1]:g} {unit} would pass"
        return f"{value:.6g} {unit}: {meant:.6g} {unit} would be usual"
    if usual[0] > 0 and usual[0] / 10 <= value <= usual[1] * 10:
        return ""
    return f"{value:.6g} {unit} is unusual; most are {usual[0]:g} to {usual[1]:g} {unit}"


def parse_number(text: str, unit: str) -> Measured:
    """Return a number in `unit`; another unit of the same kind is converted, and a number without a unit is in `unit`.
    Raises EntryError."""
    if not text.strip():
        raise EntryError(f"enter a number in {unit}")
    found = _ENTRY.fullmatch(text) if len(text) <= _MAX_LENGTH and text.isprintable() else None
    if found is None:
        raise EntryError(f"'{text.strip()[:20]}' is not a number. Example: 4.99 {unit}")
    try:
        scale = factor(found["unit"], unit) if found["unit"] else 1.0
    except UnitMismatch as e:
        raise EntryError(str(e)) from e
    value = _number(found["value"]) * scale
    U = _number(found["U"]) * scale if found["U"] else None
    if not math.isfinite(value) or not (U is None or (math.isfinite(U) and U > 0)):
        raise EntryError(f"'{text.strip()}' is too large, or its uncertainty is not above zero")
    return Measured(value, U)


def is_value(text: str) -> bool:
    """Return whether text reads as a measured value, or several, and not as a serial."""
    return all(map(_is_number, text.replace(";", " ").split())) or _is_number(text)


def _is_number(word: str) -> bool:
    found = _ENTRY.fullmatch(word) if len(word) <= _MAX_LENGTH else None
    unit = "" if found is None else found["unit"] or ""
    return found is not None and (unit in ("", *BASES) or (unit[0] in PREFIXES and unit[1:] in BASES))


def are_several(text: str, size: int) -> bool:
    """Return whether text is as many entries as a vector has places, or more than one number, separated by spaces or
    semicolons; a number with its unit is one."""
    words = text.replace(";", " ").split()
    return len(words) == size or (len(words) > 1 and all(re.fullmatch(_NUMBER, word) for word in words))


def parse_list(text: str, declared: Vector) -> list[float]:
    """Return all values of a vector at once, separated by spaces or semicolons. Raises EntryError."""
    words = text.replace(";", " ").split()
    if len(words) != declared.size:
        raise EntryError(f"{len(words)} values; enter all {declared.size} at once, or one at a time")
    return [parse_number(word, declared.unit).value for word in words]


def _number(text: str) -> float:
    return float(text.replace(",", "."))


def is_described(serial: str, spec: Spec) -> bool:
    """Return whether a spec says itself what its serials look like, and this is one."""
    own = spec.serial_pattern != SpecDocument.model_fields["serial_pattern"].default
    return own and re.fullmatch(spec.serial_pattern, serial) is not None


def serial_problem(serial: str, spec: Spec) -> str | None:
    """Return why a serial is not valid for a unit of this spec, None if it is."""
    if problem := spelling.serial_problem(serial):
        return problem
    if _ATTEMPT.search(serial):
        return "ends as the name of a later attempt's certificate does"
    if not re.fullmatch(spec.serial_pattern, serial):
        return f"does not fit the pattern {spec.serial_pattern} of spec {spec.name}"
    return None


def parse_path(text: str, folder: Path) -> Path:
    """Return a path as it is typed, pasted or dropped by a file manager: in quotes, as file:// or with escaped blanks.
    A relative one is in `folder`."""
    words = text.strip()
    if len(words) > 1 and words[0] == words[-1] and words[0] in "'\"":
        words = words[1:-1]
    if words.startswith("file://"):
        words = unquote(words.removeprefix("file://"))
    elif os.sep == "/":
        words = words.replace("\\ ", " ")
    return folder / Path(words).expanduser()


def plain_words(text: str, what: str) -> str:
    """Return text on one line. Raises EntryError if it is empty, too long, or not printable."""
    words = " ".join(text.split())
    if not words:
        raise EntryError(f"{what} is empty")
    if not words.isprintable() or len(words) > 2000:
        raise EntryError(f"{what} is too long or holds characters that cannot be printed")
    return words
