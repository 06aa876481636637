"""A section of `unit.toml` and its entries as declared: numbers, lists of numbers, file names; and `[[experiments]]`,
the unit's responses once more under another condition."""

import math
import posixpath
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from accept.base.documents.manifest import MODEL_FOLDER
from checks.acceptance import CHECKS
from checks.declare import Check, CsvTable, Input, Measured, Scalar, Series, Vector
from checks.gap import EXPERIMENT_KINDS, ExperimentKind
from specs.units import factor

# What a certificate attaches beside the records; a record of such a name could not be attached and judged again.
RESERVED = ("unit.toml", "results.json", "manifest.json", "spec.toml", "panels.json")
# A Windows path between double quotes: "data\flatness.csv" is data, a form feed, "latness.csv".
_ESCAPED = str.maketrans({"\b": "/b", "\t": "/t", "\n": "/n", "\f": "/f", "\r": "/r"})
LEAST_U = 1e-9  # of the value: below it is a slip of the exponent, or a guard band that was to be switched off


@dataclass(frozen=True)
class FileEntry:
    """A file that `unit.toml` names, and the input that declares what must be in it."""

    name: str
    declared: Series | CsvTable


Entry = Measured | NDArray[np.float64] | FileEntry
Declared = TypeVar("Declared", Check, ExperimentKind)


@dataclass(frozen=True, eq=False)
class UnitSection(Generic[Declared]):
    """Entries by their keys, of a check or of an experiment; problem: why its values cannot be used at all."""

    declared: Declared
    entries: Mapping[str, Entry]
    problem: str | None = None

    @property
    def files(self) -> list[str]:
        return [e.name for e in self.entries.values() if isinstance(e, FileEntry)]

    def number(self, key: str) -> float | None:
        given = self.entries.get(key)
        return given.value if isinstance(given, Measured) else None


def section_of(
    declared: Declared, where: str, inputs: Mapping[str, Input], content: Mapping[str, Any], problems: list[str]
) -> UnitSection[Declared]:
    """Return the section from its content. Each key must be an input. called: its name in the file."""
    entries: dict[str, Entry] = {}
    unusable: list[str] = []
    for key, value in content.items():
        entry = entry_of(where, inputs[key], value, problems, unusable)
        if entry is not None:
            entries[key] = entry
    return UnitSection(declared, entries, "; ".join(unusable) or None)


def entry_of(section: str, declared: Input, value: Any, problems: list[str], unusable: list[str]) -> Entry | None:
    """Return the entry of a key. A wrong type is a problem of the file, an impossible number one of the section."""
    where = f"{section} {declared.name}"
    match declared:
        case Scalar():
            return _scalar(where, declared, value, problems, unusable)
        case Vector():
            return _vector(where, declared, value, problems, unusable)
        case _:
            if not isinstance(value, str) or not value or "\0" in value:
                problems.append(f"{where} = {value!r}: expected a file name")
                return None
            if value != (meant := value.translate(_ESCAPED)):
                problems.append(f"{where} = {value!r}: a backslash makes a control character in TOML; write '{meant}'")
                return None
            if is_reserved(value):
                problems.append(f"{where} = {value!r}: a certificate keeps this name for itself; rename the record")
                return None
            return FileEntry(value, declared)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _scalar(where: str, declared: Scalar, value: Any, problems: list[str], unusable: list[str]) -> Measured | None:
    U = None
    if isinstance(value, dict):
        if set(value) - {"value", "U"} or "value" not in value:
            problems.append(f"{where} = {value!r}: expected a number or {{ value, U }}")
            return None
        value, U = value["value"], value.get("U")
    if not _is_number(value) or not (U is None or _is_number(U)):
        problems.append(f"{where} = {value!r}: expected a number in {declared.unit}")
        return None
    number = _float(value)
    if not math.isfinite(number):
        unusable.append(f"{declared.name} is {number}")
    elif not declared.lo <= number <= declared.hi:
        unusable.append(
            f"{declared.name} = {number:g} {declared.unit} is not plausible"
            f" (expected {declared.lo:g} to {declared.hi:g} {declared.unit}{_other_unit(declared, number)})"
        )
    if U is not None and not (math.isfinite(_float(U)) and _float(U) > 0):
        unusable.append(f"the uncertainty U of {declared.name} is {_float(U):g}, expected a positive number")
    elif U is not None and _float(U) < LEAST_U * abs(number):
        unusable.append(f"the uncertainty U of {declared.name} is {U:g} {declared.unit}: no instrument is that exact")
    return Measured(number, None if U is None else _float(U))


def _other_unit(declared: Scalar, number: float) -> str:
    """Return the question whether a number is in another unit of the same kind, if it is plausible there."""
    before, micro, after = declared.unit.rpartition("u")  # "um", "N/um"
    if not micro:
        return ""
    units = (f"{before}{prefix}{after}" for prefix in ("", "m", "n", "p"))
    meant = (u for u in units if declared.lo <= number * factor(u, declared.unit) <= declared.hi)
    return "".join(f"; did you mean {number:g} {unit}?" for unit in islice(meant, 1))


def _float(number: float) -> float:
    """Return the float of a TOML number. An integer too long for one is infinite, never a value."""
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _vector(
    where: str, declared: Vector, value: Any, problems: list[str], unusable: list[str]
) -> NDArray[np.float64] | None:
    if not isinstance(value, list) or not all(_is_number(v) for v in value):
        problems.append(f"{where} = {value!r}: expected a list of {declared.size} numbers in {declared.unit}")
        return None
    array = np.array([_float(v) for v in value])
    if array.size != declared.size:
        unusable.append(f"{declared.name} has {array.size} values, expected {declared.size}")
    elif not np.isfinite(array).all():
        first = int(np.flatnonzero(~np.isfinite(array))[0])
        unusable.append(f"{declared.name}: value {first + 1} is {array[first]}")
    return array


def is_reserved(name: str) -> bool:
    """Return whether the certificate uses this file name itself, in any case of its letters."""
    folded = name.replace("\\", "/").casefold()
    return posixpath.normpath(folded) in RESERVED or folded.split("/")[0] == MODEL_FOLDER


EXPERIMENTS = "experiments"
RECORDS = ("low", "high", "low_repeat", "high_repeat")
REQUIRED = ("low", "high")
Experiments = Mapping[str, UnitSection[ExperimentKind]]  # by kind, the second and later of one with its number


def experiments_of(data: Mapping[str, Any], product: str, problems: list[str]) -> Experiments:
    """Return the experiments in order; faults are added to `problems`."""
    listed = data.get(EXPERIMENTS, [])
    if not isinstance(listed, list) or not all(isinstance(each, dict) for each in listed):
        problems.append(f"{EXPERIMENTS} = {listed!r}: expected sections [[{EXPERIMENTS}]]")
        return {}
    found: dict[str, UnitSection[ExperimentKind]] = {}
    for number, content in enumerate(listed, 1):
        one = _experiment(f"[[{EXPERIMENTS}]] {number}:", content, product, problems)
        if one is not None:
            name, count = one.declared.name, 1 + sum(other.declared is one.declared for other in found.values())
            found[name if count == 1 else f"{name}_{count}"] = one
    return found


def _experiment(
    where: str, content: Mapping[str, Any], product: str, problems: list[str]
) -> UnitSection[ExperimentKind] | None:
    given = content.get("kind")
    if not isinstance(given, str) or given not in EXPERIMENT_KINDS:
        said = "kind is missing" if given is None else f"kind = {given!r}"
        problems.append(f"{where} {said}: expected one of {', '.join(EXPERIMENT_KINDS)}")
        return None
    kind, records = EXPERIMENT_KINDS[given], CHECKS.of_kind("frf", product).inputs
    known = {key: records[key] for key in RECORDS} | ({kind.value.name: kind.value} if kind.value else {})
    problems += [
        f"{where} {key}: unknown key (known of {given}: kind, {', '.join(known)})"
        for key in content
        if key != "kind" and key not in known
    ]
    needed = (*REQUIRED, *([kind.value.name] if kind.value else []))
    problems += [f"{where} {key} is missing: {given} needs {', '.join(needed)}" for key in needed if key not in content]
    if "high_repeat" in content and "low_repeat" not in content:
        problems.append(f"{where} high_repeat without low_repeat: a second realisation begins with the low record")
    return section_of(kind, where, known, {key: content[key] for key in known if key in content}, problems)
