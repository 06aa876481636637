"""One recording is one piece of evidence: given twice, in one unit or in two, it measures one thing at most."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from accept.units.unit_folder import UNIT_FILE
from checks.errors import RecordError
from checks.record import Record

SHOWN = 3  # files of two units that are named


def vet_twins(values: Mapping[str, Any]) -> None:
    """Raises RecordError where two inputs of a section hold the same recording, also under another name or format.

    Noise makes two recordings of one thing differ in their last digits, so equal samples are a copy."""
    records = {name: value for name, value in values.items() if isinstance(value, Record)}
    for (a, one), (b, other) in combinations(records.items(), 2):
        if one.sha256 == other.sha256 or _same_samples(one, other):
            raise RecordError(f"{a} ({one.name}) and {b} ({other.name}) hold the same recording; give each its own")


def _same_samples(one: Record, other: Record) -> bool:
    shared = one.channels.keys() & other.channels.keys()
    return bool(shared) and all(np.array_equal(one[c], other[c]) for c in shared)


def same_records(judged: Iterable[Mapping[str, Any]], known: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """A line for each two units with a file of the same bytes, when one of them is among those `judged` now.

    judged, known: entries of results.json, now and from the store. A verdict does not come of it: the record is one
    unit's own, and only who measured knows whose.
    """
    now = {entry["serial"]: entry for entry in judged}
    units = now | {entry["serial"]: entry for entry in known if entry["serial"] not in now}
    first: dict[str, tuple[str, str]] = {}
    pairs: dict[tuple[str, str], list[str]] = {}
    for serial, entry in units.items():
        for name, sha256 in entry["inputs"].items():
            owner, file = first.setdefault(sha256, (serial, name))
            if owner != serial and name != UNIT_FILE and (owner in now or serial in now):
                pairs.setdefault((owner, serial), []).append(name if name == file else f"{file} as {name}")
    for (one, other), names in pairs.items():
        more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        shown = ", ".join(names[:SHOWN]) + more
        yield f"{one} and {other} have the same recording, byte for byte: {shown}; one of them was not measured"
