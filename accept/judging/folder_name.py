"""The folder of a unit against the serial in it: a folder that was copied and whose `unit.toml` was forgotten.

A folder may be called as one likes, with the serial in its name or without. If its name reads like the serial of
another unit, a person confirms which of the two was measured, or the unit is conditional at best.
"""

import re

from accept.store import Store
from accept.store.payloads import UnitJudged
from accept.store.spelling import spelling_key
from accept.units.attempt_folder import attempt_number
from accept.units.unit_folder import UNIT_FILE, UnitFolder

NAME, CONFIRMED = "name", "confirmed_by"  # keys of what a result states about its folder
_NUMBER = re.compile(r"\d+")


def folder_of(unit: UnitFolder) -> str:
    """Return the name of a unit's folder."""
    place = unit.path.resolve()
    return place.name if attempt_number(place.name) is None else place.parent.name


def is_other_serial(name: str, serial: str) -> bool:
    """Return whether the name of a folder reads like another serial of the same series: Q-07 for Q-06, not Q-6."""
    one, other = spelling_key(name), spelling_key(serial)
    numbers, others = ([int(digits) for digits in _NUMBER.findall(text)] for text in (one, other))
    return _NUMBER.sub("0", one) == _NUMBER.sub("0", other) and numbers != others


def doubted_folder(store: Store, unit: UnitFolder, confirmed_by: str = "") -> dict[str, str]:
    """Return the name of a unit's folder if it is the serial of another unit, with who confirmed the serial in it: now,
    or when the same `unit.toml` was judged last. Empty without a doubt. Raises StoreError."""
    name = folder_of(unit)
    known = spelling_key(name) != spelling_key(unit.serial) and store.latest(name, UnitJudged.KIND) is not None
    if not known and not is_other_serial(name, unit.serial):
        return {}
    last = store.latest(unit.serial, UnitJudged.KIND)
    if last is not None and not confirmed_by:
        judged = UnitJudged.of(last)
        same = judged.inputs.get(UNIT_FILE) == unit.input_hashes()[UNIT_FILE]
        if same and judged.result.folder.get(NAME) == name:
            confirmed_by = judged.result.folder.get(CONFIRMED, "")
    return {NAME: name} | ({CONFIRMED: confirmed_by} if confirmed_by else {})


def question(unit: UnitFolder) -> str:
    """Return what is asked about a doubted folder."""
    return f"the folder is called {folder_of(unit)}, its {UNIT_FILE} says {unit.serial}: is the unit {unit.serial}?"
