"""Sketches of a unit's records, and hashes of typed readings: they reveal what was given twice."""

import hashlib
from collections.abc import Iterable, Mapping
from decimal import Decimal

import numpy as np

from accept.base.documents.results import TYPED
from accept.units import FileEntry, LoadedUnit, UnitFolder, UnitSection
from checks.acceptance import CHECKS
from checks.declare import Check, Measured
from checks.errors import RecordError
from checks.record import Record
from checks.signals import Sketch

DRIVES = frozenset({"t", "Va", "V"})  # one excitation serves every unit: no evidence of a measurement
FEW_NUMBERS = 16  # different numbers in a table, below which two honest ones may be equal
FEW_READINGS = 6  # different readings of two digits or more, below which those of two honest units may be equal

Samples = Mapping[str, Mapping[str, str]]
"""`section/input` of a unit -> channel -> its sketch as text, or `table` -> hash of a table's numbers, or of all
that was typed."""


def samples_of(held: LoadedUnit, sections: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return the sketches of the records of these sections; a record that cannot be read gives no result anyway."""
    found: dict[str, dict[str, str]] = {}
    for section in sections:
        try:
            values = held.values(section) if section in held.folder.sections else {}
        except RecordError:
            continue
        for name, value in values.items():
            told = _told(value)
            if told:
                found[f"{section}/{name}"] = told
    return found | _typed(held.folder, sections)


def section_read_by(check: str) -> str:
    """Return the section that a check reads; one of a package that is not installed any more reads its own."""
    return CHECKS[check].reads if check in CHECKS else check


def is_typed(sample: str) -> bool:
    """Return whether a sample is of typed values, not of a record."""
    return sample.partition("/")[2] == TYPED


def _typed(unit: UnitFolder, sections: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return the sketches of sections with readings only; two units share one only if every reading is equal.

    Two readings that scatter by five steps of their last digit or more agree by chance in at most 0.28/5 of pairs, six
    in 3e-8: among a thousand honest units (5e5 pairs) with a probability of 1.5 percent at most, less with every
    further reading, such as the heights of one digit. APA-02 of [STB] has six of that kind."""
    typed = {name: _readings(unit.sections[name]) for name in sections if name in unit.sections}
    told = repr(sorted((name, readings) for name, readings in typed.items() if readings))
    different = {n for readings in typed.values() for _, numbers in readings for n in numbers if _digits(n) > 1}
    if len(different) < FEW_READINGS:
        return {}
    return {f"{name}/{TYPED}": {"table": _hash(f"{name} {told}".encode())} for name, found in typed.items() if found}


def _readings(section: UnitSection[Check]) -> list[tuple[str, list[float]]]:
    """Return typed numbers by input. None beside records, where they are settings, and none of an unusable section."""
    if section.files or section.problem:
        return []
    entries = [(name, entry) for name, entry in sorted(section.entries.items()) if not isinstance(entry, FileEntry)]
    return [(name, [e.value] if isinstance(e, Measured) else e.tolist()) for name, e in entries]


def _digits(number: float) -> int:
    """Return the significant digits without zeros at the end, which a person may add."""
    return len(Decimal(repr(number)).normalize().as_tuple().digits)


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def _told(value: object) -> dict[str, str]:
    if isinstance(value, Record):
        sketched = {c: Sketch.of(x) for c, x in sorted(value.channels.items()) if c not in DRIVES}
        return {channel: str(found) for channel, found in sketched.items() if found is not None}
    if isinstance(value, Mapping):
        numbers = np.array([np.asarray(column, dtype=float) for _, column in sorted(value.items())])
        if np.unique(numbers).size >= FEW_NUMBERS:
            return {"table": _hash(numbers.astype("<f4").tobytes())}
    return {}
