"""Records that stand in the folders of two units: one of them was not measured."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from accept.units.unit_folder import UNIT_FILE

SHOWN = 3  # files of a pair


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
