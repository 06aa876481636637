"""The list on the first screen: what the units of the bench wait for, and a tray of new ones by their serials."""

from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

from accept.workflow.dialogue.begin import Begun
from accept.workflow.dialogue.start_state import SCAN, StartDialogue, Turn, refuse, say, without_serial
from accept.workflow.dialogue.turn import Common, FootWords

if TYPE_CHECKING:
    from accept.workflow.steps.overview import Overview
    from accept.workflow.steps.unit_list import KnownUnit

Do = Enum("Do", "LOOK")  # list the units anew; `listed` follows


@dataclass(frozen=True)
class Add:
    """Begin a unit of the tray; `added` follows, or `add_confirmed` if its serial looks like a known one and is asked
    for once more."""

    begun: Begun


@dataclass(frozen=True)
class TakeOff:
    """Take a unit off the list; `taken_off` follows."""

    unit: "KnownUnit"
    operator: str


def listed(d: StartDialogue, found: "Overview") -> Turn:
    """Show the units as they are now. The cursor goes to the one whose serial stands there, or that was open before."""
    meant = d.value("serial") or ("" if d.adds else d.left)
    d = replace(d, lists=False, listed=found)
    return Turn(replace(d, row=next((n for n, unit in enumerate(d.units) if unit.serial == meant), 0)))


def move(d: StartDialogue, rows: int) -> Turn:
    """Move the cursor among the units: the one that it comes to stands in the line, as if it had been scanned."""
    if not d.units or d.cursor not in ("serial", None):
        return Turn(d)
    at_mark = d.adds or (d.here is not None and d.here.serial == d.value("serial"))
    row = d.row + rows if at_mark or abs(rows) > 1 else d.row  # the marked one is taken first, not passed
    return point(d, max(0, min(row, len(d.units) - 1)))


def point(d: StartDialogue, row: int) -> Turn:
    """Put the cursor on a unit."""
    d = replace(d, row=row, cursor="serial")
    if d.here is None or d.adds:
        return Turn(d)
    texts = {**d.texts, "serial": d.here.serial, "kind": d.here.kind}
    d = replace(d, texts=texts, known=d.here, looks=False, begins=False)
    return say(d, d.scan_words, "quiet", Common.SELECT)


def show_queue(d: StartDialogue, place: int) -> Turn:
    """Show another queue; the unit on top of it is the next."""
    if not 0 <= place < len(d.queues):
        return Turn(d)
    shown = d.queues[place]
    d = replace(without_serial(d), at=(shown.name, shown.kind) if place else None)
    words = f"{shown.title}: Enter opens the marked one, then one unit after the other"
    return say(d, words if place else SCAN)


def turn(d: StartDialogue, way: int) -> Turn:
    """Show the next queue; while a tray is added, take another kind."""
    if d.adds and d.bench is not None:
        kinds = d.bench.kinds
        kind = kinds[(kinds.index(d.value("kind")) + way) % len(kinds)]
        d = replace(d, texts={**d.texts, "kind": kind})
        return say(d, d.scan_words)
    if d.queue is None:
        return Turn(d)
    return show_queue(d, (d.queues.index(d.queue) + way) % len(d.queues))


def take_off(d: StartDialogue) -> Turn:
    """Take the unit under the cursor off the list, when asked twice; the last one that was added stands on top."""
    unit = d.here
    if unit is None:
        return say(d, "No unit to take off the list", "bad")
    if d.name_problem:
        return refuse(d, "operator", d.name_problem)
    if unit.last or unit.notes or unit.attempt > 1:
        return say(d, f"{unit.serial} stays: something was done at it", "bad")
    if d.doubted != unit.serial:
        words = f"Ctrl+Z again: take {unit.serial} off the list, as if it had not been scanned"
        return Turn(replace(d, ends=False, doubted=unit.serial), words=FootWords(words, "doubt"))
    return Turn(replace(d, doubted=""), (TakeOff(unit, d.value("operator")),))


def taken_off(d: StartDialogue, asked: TakeOff) -> Turn:
    """Show the list without a unit."""
    serial = asked.unit.serial
    d = replace(d, added=d.added - {serial})
    d = without_serial(d) if d.value("serial") == serial else d
    return say(d, f"{serial} is off the list. {d.scan_words}", "saved", Do.LOOK)


def tray(d: StartDialogue) -> Turn:
    """Begin to add the units of a tray, add one, or end it. All units are shown, the last added on top."""
    if d.bench is None:
        return Turn(d)
    if d.name_problem:
        return refuse(d, "operator", d.name_problem)
    if d.adds and not d.value("serial"):
        return end_tray(d, f"{len(d.added)} added. Tab: choose what to measure at one after the other", "good")
    if not d.adds:
        is_new = d.typed == d.texts["serial"] and d.known is None  # the unit that is proposed is not added
        kind = d.value("kind") if d.value("kind") in d.bench.kinds else d.bench.kinds[0]
        d = d if is_new else without_serial(d)
        d = replace(d, texts={**d.texts, "kind": kind}, cursor="serial", adds=True, begins=False, at=None, row=0)
    return _add(d) if d.value("serial") else say(d, d.scan_words)


def end_tray(d: StartDialogue, words: str = SCAN, role: str = "quiet") -> Turn:
    """Go back to one unit at a time."""
    return say(replace(without_serial(d), adds=False), words, role)


def _add(d: StartDialogue) -> Turn:
    """Begin a unit, unless its serial is not valid. A kind that follows from the serial is taken."""
    serial, kind = d.value("serial"), d.follows or d.value("kind")
    assert d.bench is not None  # noqa: S101 - a tray is added at an open bench only
    if problem := d.bench.problem(serial, kind):
        return say(d, f"'{serial}': {problem}", "bad", Common.SELECT, Common.BELL)
    return Turn(without_serial(d), (Add(Begun(serial, kind, d.value("operator"))),))


def added(d: StartDialogue, serial: str, is_new: bool) -> Turn:
    """Show a unit that was begun; scanned twice it is one unit."""
    if not is_new:
        return say(d, f"{serial} is here already. {d.scan_words}", "doubt", Do.LOOK)
    d = replace(d, added=d.added | {serial})
    return say(d, f"{serial} added ({len(d.added)}). {d.scan_words}", "saved", Do.LOOK)


def add_confirmed(d: StartDialogue, begun: Begun, answer: str | None) -> Turn:
    """Add a unit whose serial was asked about if it was typed once more."""
    if answer is not None and answer.strip() == begun.serial:
        return Turn(d, (Add(replace(begun, confirmed=True)),))
    return say(d, f"{begun.serial} was not confirmed, and not added. {d.scan_words}", "doubt", Do.LOOK)
