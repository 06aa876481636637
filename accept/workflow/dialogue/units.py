"""The dialogue at the list of units: what they wait for, and a tray of new ones by their serials."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

from accept.workflow.dialogue import turn
from accept.workflow.dialogue.begin import Begun, BenchKinds, LookForPassphrase, LookUp
from accept.workflow.dialogue.turn import Common, FootWords, by_key
from accept.workflow.entry.shift import NOT_TAKEN
from accept.workflow.steps.unit_list import ALL, KnownUnit, Queue

SCAN = "Scan a unit: Enter opens it"

Do = Enum("Do", "LOOK")  # list the units anew; `listed` follows


@dataclass(frozen=True)
class Add:
    """Begin a unit of the tray; `added` follows, or `confirmed` if its serial looks like a known one and is asked for
    once more."""

    begun: Begun


@dataclass(frozen=True)
class TakeOff:
    """Take a unit off the list; `taken_off` follows."""

    unit: KnownUnit
    operator: str


@dataclass(frozen=True)
class CloseList:
    """Close the list. unit: the one to open, None for none; queue: that it was chosen from."""

    unit: KnownUnit | None = None
    queue: Queue | None = None


@dataclass(frozen=True)
class UnitsDialogue:
    """operator, kind: of units that are added; at: name and kind of the queue that is shown; text: what is typed; row:
    place of the cursor among the units; adds: a tray is being added; added: its serials; doubted: serial of the unit at
    which Ctrl+Z was pressed once."""

    bench: BenchKinds
    operator: str
    kind: str
    units: Sequence[KnownUnit] = ()
    queues: Sequence[Queue] = ()
    at: tuple[str, str] = (ALL, "")
    text: str = field(default="", repr=False)
    row: int = 0
    adds: bool = False
    added: frozenset[str] = frozenset()
    doubted: str = ""

    @property
    def serial(self) -> str:
        return self.text.strip()

    @property
    def queue(self) -> Queue | None:
        """Return the queue that is shown, None before the units are there and if it is gone."""
        return next((queue for queue in self.queues if (queue.name, queue.kind) == self.at), None)

    @property
    def shown(self) -> list[KnownUnit]:
        """Return the units of the queue whose serial holds what is typed."""
        waiting = () if self.queue is None else self.queue.units
        return [unit for unit in waiting if self.serial.lower() in unit.serial.lower()]

    @property
    def here(self) -> KnownUnit | None:
        """Return the unit under the cursor, None in an empty list."""
        return self.shown[self.row] if 0 <= self.row < len(self.shown) else None

    @property
    def exact(self) -> KnownUnit | None:
        """Return the unit whose serial is typed."""
        return next((unit for unit in self.units if unit.serial == self.serial), None)

    @property
    def scan_words(self) -> str:
        """Return what a scan does."""
        if not self.adds:
            return SCAN
        other = ". Tab: other kind" if len(self.bench.kinds) > 1 else ""
        return f"Adding units of kind {self.kind}{other}. Scan every unit of the tray. F6: that was all"


Turn = turn.Turn[UnitsDialogue]


def opening(bench: BenchKinds, operator: str, kind: str) -> Turn:
    """Show the list. kind: that of the first screen, which may be half typed."""
    return Turn(UnitsDialogue(bench, operator, kind if kind in bench.kinds else bench.kinds[0]), (Do.LOOK,))


def _say(d: UnitsDialogue, words: str, role: str = "quiet", *effects: object) -> Turn:
    return Turn(replace(d, doubted=""), effects, FootWords(words, role))  # the question of Ctrl+Z is not seen any more


def edited(d: UnitsDialogue, text: str, row: int) -> Turn:
    """Take what was typed meanwhile, and where the cursor is now: on top of another selection."""
    return Turn(replace(d, text=text, row=row if text == d.text else 0))


def listed(d: UnitsDialogue, units: Sequence[KnownUnit], queues: Sequence[Queue]) -> Turn:
    """Show the units as they are now."""
    d = replace(d, units=units, queues=queues, row=0)
    d = replace(d, at=(ALL, "")) if d.queue is None else d
    return Turn(d) if units or d.adds else _say(d, "No units yet. F6: add the units of a tray")


def _turn(d: UnitsDialogue, way: int) -> Turn:
    """Show another queue; while a tray is added, take another kind."""
    if d.adds:
        kinds = d.bench.kinds
        d = replace(d, kind=kinds[(kinds.index(d.kind) + way) % len(kinds)])
        return _say(d, d.scan_words)
    if d.queue is None:
        return Turn(d)
    shown = d.queues[(d.queues.index(d.queue) + way) % len(d.queues)]
    one_by_one = f"{shown.title}: Enter opens the marked one, then one unit after the other"
    return _say(replace(d, at=(shown.name, shown.kind), row=0), SCAN if shown.name == ALL else one_by_one)


def _take_off(d: UnitsDialogue) -> Turn:
    """Take the unit under the cursor off the list, when asked twice; the last one that was added stands on top."""
    unit = d.here
    if unit is None:
        return _say(d, "No unit to take off the list", "bad")
    if not d.operator:
        return _say(d, "Enter your name on the first screen, then take units off", "bad")
    if unit.last or unit.notes or unit.attempt > 1:
        return _say(d, f"{unit.serial} stays: something was done at it", "bad")
    if d.doubted != unit.serial:
        words = f"Ctrl+Z again: take {unit.serial} off the list, as if it had not been scanned"
        return Turn(replace(d, doubted=unit.serial), words=FootWords(words, "doubt"))
    return Turn(replace(d, doubted=""), (TakeOff(unit, d.operator),))


def taken_off(d: UnitsDialogue, asked: TakeOff) -> Turn:
    """Show the list without a unit."""
    serial = asked.unit.serial
    d = replace(d, added=d.added - {serial})
    return _say(d, f"{serial} is off the list. {d.scan_words}", "saved", Do.LOOK)


def _enter(d: UnitsDialogue) -> Turn:
    """Open the unit that was scanned, else the one under the cursor; while a tray is added, add it."""
    return _open(d) if d.exact is not None else _unless_secret(d, "enter")


def _unless_secret(d: UnitsDialogue, then: str) -> Turn:
    """Answer a key if what is typed is no passphrase."""
    asked = LookForPassphrase((("serial", d.text),), then)
    return Turn(d, (asked,)) if d.serial else _answer(d, then)


def recognized(d: UnitsDialogue, asked: LookForPassphrase, secret: str | None) -> Turn:
    """Answer the key that waited for the search; delete the text if it is a passphrase; search again if it changed."""
    if secret is not None:
        return _say(replace(d, text="", row=0), NOT_TAKEN, "bad", Common.BELL)
    now = press(d, asked.then)
    return _answer(d, asked.then) if now.effects == (asked,) else now


def _answer(d: UnitsDialogue, key: str) -> Turn:
    return _tray(d) if key == "f6" else _open(d)


def _open(d: UnitsDialogue) -> Turn:
    if d.adds:
        return _tray(d)
    if d.exact is not None:
        return _choose(d, d.exact)
    if d.serial:
        return Turn(d, (LookUp(d.serial),))
    return Turn(d) if d.here is None else _choose(d, d.here)


def found(d: UnitsDialogue, asked: LookUp, known: KnownUnit | None) -> Turn:
    """Open a unit that is known though the list is too short for it."""
    if known is not None:
        return _choose(d, known)
    return _say(d, f"{asked.serial} is new here. F6: add it, and the others of its tray", "doubt")


def _choose(d: UnitsDialogue, unit: KnownUnit) -> Turn:
    if unit.kind not in d.bench.kinds:
        return _say(d, f"{unit.serial} is of kind {unit.kind}, for which this bench has no spec", "bad")
    waits = d.queue is not None and d.queue.name != ALL and unit in d.queue.units
    return Turn(d, (CloseList(unit, d.queue if waits else None),))


def _tray(d: UnitsDialogue) -> Turn:
    """Begin to add the units of a tray, add one, or end it. All units are shown meanwhile: the last one that was added
    stands on top."""
    if not d.operator:
        return _say(d, "Enter your name on the first screen, then add units", "bad")
    if d.adds and not d.serial:
        words = f"{len(d.added)} added. Tab: choose what to measure at one after the other"
        return _say(replace(d, adds=False), words, "good")
    d = d if d.adds else replace(d, adds=True, at=(ALL, ""), row=0)
    return _add(d) if d.serial else _say(d, d.scan_words)


def _add(d: UnitsDialogue) -> Turn:
    """Begin a unit, unless its serial is not valid."""
    if problem := d.bench.problem(d.serial, d.kind):
        return _say(d, f"'{d.serial}': {problem}", "bad", Common.SELECT, Common.BELL)
    return Turn(replace(d, text="", row=0), (Add(Begun(d.serial, d.kind, d.operator)),))


def added(d: UnitsDialogue, serial: str, is_new: bool) -> Turn:
    """Show a unit that was begun; scanned twice it is one unit."""
    if not is_new:
        return _say(d, f"{serial} is here already. {d.scan_words}", "doubt", Do.LOOK)
    d = replace(d, added=d.added | {serial})
    return _say(d, f"{serial} added ({len(d.added)}). {d.scan_words}", "saved", Do.LOOK)


def confirmed(d: UnitsDialogue, begun: Begun, answer: str | None) -> Turn:
    """Add a unit whose serial was asked about if it was typed once more."""
    if answer is not None and answer.strip() == begun.serial:
        return Turn(d, (Add(replace(begun, confirmed=True)),))
    return _say(d, f"{begun.serial} was not confirmed, and not added. {d.scan_words}", "doubt", Do.LOOK)


def _leave(d: UnitsDialogue) -> Turn:
    return _say(replace(d, adds=False), SCAN) if d.adds else Turn(d, (CloseList(),))


press: Callable[[UnitsDialogue, str], Turn] = by_key(
    {
        "enter": _enter,
        "tab": lambda d: _turn(d, 1),
        "shift+tab": lambda d: _turn(d, -1),
        "f6": lambda d: _unless_secret(d, "f6"),
        "ctrl+z": _take_off,
        "escape": _leave,
    }
)
