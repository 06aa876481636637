"""What a unit's records hold, in a few hundred bytes each: by it a recording that was given twice is recognised."""

import hashlib
from collections.abc import Iterable, Mapping

import numpy as np

from accept.units.loaded_unit import LoadedUnit
from checks.errors import RecordError
from checks.record import Record
from checks.signals.sketch import sketch

DRIVES = frozenset({"t", "Va", "V"})  # one excitation serves every unit: no evidence of what was measured
FEW_NUMBERS = 16  # different numbers in a table, below which two honest ones may be equal

Samples = Mapping[str, Mapping[str, str]]
"""`section/input` of a unit -> channel -> its sketch as text, or `table` -> hash of a table's numbers."""


def samples_of(held: LoadedUnit, sections: Iterable[str]) -> dict[str, dict[str, str]]:
    """Of the records of these sections that can be read; what cannot gives no result anyway."""
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
    return found


def _told(value: object) -> dict[str, str]:
    if isinstance(value, Record):
        sketched = {c: sketch(x) for c, x in sorted(value.channels.items()) if c not in DRIVES}
        return {channel: str(found) for channel, found in sketched.items() if found is not None}
    if isinstance(value, Mapping):
        numbers = np.array([np.asarray(column, dtype=float) for _, column in sorted(value.items())])
        if np.unique(numbers).size >= FEW_NUMBERS:
            return {"table": hashlib.sha256(numbers.astype("<f4").tobytes()).hexdigest()[:16]}
    return {}
