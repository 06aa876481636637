"""One recording is one piece of evidence: given twice, it measures neither of the two things that it is named for."""

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from checks.errors import RecordError
from checks.record import Record


def vet_twins(values: Mapping[str, Any]) -> None:
    """Raise RecordError if two inputs of a section hold the same recording, also under another name or format.

    Noise makes two recordings of one thing differ in their last digits, so equal samples are a copy."""
    records = {name: value for name, value in values.items() if isinstance(value, Record)}
    for (a, one), (b, other) in combinations(records.items(), 2):
        if one.sha256 == other.sha256 or _same_samples(one, other):
            a, b = (name.replace("_", " ") for name in (a, b))
            raise RecordError(f"{a} ({one.name}) and {b} ({other.name}) hold the same recording; give each its own")


def _same_samples(one: Record, other: Record) -> bool:
    shared = one.channels.keys() & other.channels.keys()
    return bool(shared) and all(np.array_equal(one[c], other[c]) for c in shared)
