"""The serial of a unit against the name of its folder and the serials of others: a folder that was copied and whose
`unit.toml` was forgotten, a letter that was typed for a digit.

A folder may be called as one likes, with the serial in its name or without. If its name reads like the serial of
another unit, or the serial looks like one that the store had before, a person confirms which of the two was measured,
or the unit is conditional at best.
"""

import hashlib
import re
from collections.abc import Mapping

from accept.base.documents.results import ALIKE, CONFIRMED, NAME
from accept.base.spelling import difference, spelling_key
from accept.store import Store
from accept.store.payloads import SerialConfirmed, UnitJudged
from accept.units import UNIT_FILE, UnitFolder, attempt_number

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
    or when the same `unit.toml` was judged last; and the known serial that looks like it; or {}. Raises StoreError."""
    alike = doubted_serial(store, unit.serial)
    name = folder_of(unit)
    known = spelling_key(name) != spelling_key(unit.serial) and store.latest(name, UnitJudged.KIND) is not None
    if not known and not is_other_serial(name, unit.serial):
        return alike
    last = store.latest(unit.serial, UnitJudged.KIND)
    if last is not None and not confirmed_by:
        judged = UnitJudged.of(last)
        same = judged.inputs.get(UNIT_FILE) == hashlib.sha256(unit.text).hexdigest()
        if same and judged.result.folder.get(NAME) == name:
            confirmed_by = judged.result.folder.get(CONFIRMED, "")
    return {NAME: name} | ({CONFIRMED: confirmed_by} if confirmed_by else {}) | alike


def serial_doubt(store: Store, serial: str, unit: UnitFolder | None) -> str | None:
    """Return the question about a serial in doubt, or None. unit: its folder, or None. Raises StoreError."""
    doubted = doubted_serial(store, serial) if unit is None else doubted_folder(store, unit)
    return serial_question(serial, doubted) if doubted else None


def doubted_serial(store: Store, serial: str) -> dict[str, str]:
    """Return the earlier serial that looks like this one, empty if they were told apart. Raises StoreError."""
    known = unconfirmed(store, serial)
    return {ALIKE: known[0]} if known else {}


def unconfirmed(store: Store, serial: str) -> list[str]:
    """Return the earlier serials that look like this one and from which no person told it apart. Raises StoreError."""
    known = store.look_alikes(serial)
    told = {each for event in (store.events(serial, SerialConfirmed.KIND) if known else ())
            for each in SerialConfirmed.of(event).unlike}  # fmt: skip
    return [each for each in known if each not in told]


def tell_apart(store: Store, serial: str, who: str) -> None:
    """Store that a person told a serial apart from those that look like it, so that it is asked once. Raises
    StoreError."""
    if known := unconfirmed(store, serial):
        store.write(SerialConfirmed(tuple(known)), serial, who=who)


def serial_question(serial: str, doubted: Mapping[str, str]) -> str:
    """Return the question about a serial. doubted: as `doubted_folder` states it."""
    words = [difference(serial, doubted[ALIKE])] if ALIKE in doubted else []
    if NAME in doubted:
        words.append(f"the folder is called {doubted[NAME]}, its {UNIT_FILE} says {serial}")
    return f"{'; '.join(words)}: is the unit {serial}?"
