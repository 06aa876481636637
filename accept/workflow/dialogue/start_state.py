"""The state of the first screen: who is at the bench, the serial that is scanned or typed, and the units there are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from accept.workflow.dialogue import turn
from accept.workflow.dialogue.begin import BenchKinds
from accept.workflow.dialogue.turn import Common, FootWords
from specs.plugins import products

if TYPE_CHECKING:
    from accept.workflow.steps.overview import Overview
    from accept.workflow.steps.unit_list import KnownUnit, Queue

OWN = {"operator": "Operator", "serial": "Serial", "kind": "Kind"}  # fields of every unit; the others are parts
SCAN = "Scan a serial, or choose a unit with ↑↓; Enter opens it"
CHOOSE_KIND = "←→: another kind. Enter: goes on"


def labels() -> dict[str, str]:
    """Return the fields and their labels: those of every unit, then the parts of the installed products."""
    return OWN | {name: label for product in products().values() for name, label in product.parts.items()}


def parts_of(kind: str) -> tuple[str, ...]:
    """Return the parts of a product, none of one that is not installed."""
    return tuple(products()[kind].parts) if kind in products() else ()


@dataclass(frozen=True)
class StartDialogue:
    """State of the first screen. texts: by field; cursor: the field that is typed into; problem: why the unit that was
    wanted is not open; bench: None until it is open; opens: that is under way; looks: a serial is being looked up;
    known: its unit; key_problem: why the operator cannot sign here; refused: the field whose refusal stands at the
    foot; ends: Escape was pressed once; confirmed: serials that were typed once more; begins: kind and parts of a new
    unit are asked for; named: the operator who was given, or has entered the name; left: unit that was open before;
    back: the same, where the scan of another one led here.

    lists: the units are being listed; listed: they are there; at: name and kind of the queue that is shown, None for
    all units; typed: letters that the serials of the units shown hold; row: place of the cursor among them; adds: a
    tray is being added; added: its serials; doubted: serial of the unit at which Ctrl+Z was pressed once."""

    texts: Mapping[str, str] = field(repr=False)
    cursor: str | None
    problem: str = ""
    bench: BenchKinds | None = None
    opens: bool = True
    failure: str = ""  # why the bench could not be opened
    looks: bool = False
    known: "KnownUnit | None" = None
    key_problem: str = ""
    refused: str | None = None
    ends: bool = False
    confirmed: frozenset[str] = frozenset()
    begins: bool = False
    named: str = field(default="", repr=False)
    left: str = ""
    back: str = ""
    lists: bool = False
    listed: "Overview | None" = field(default=None, repr=False)
    at: tuple[str, str] | None = None
    typed: str = field(default="", repr=False)
    row: int = 0
    adds: bool = False
    added: frozenset[str] = frozenset()
    doubted: str = ""

    def value(self, name: str) -> str:
        return self.texts[name].strip()

    @property
    def shown(self) -> list[str]:
        """Return the fields that can be typed into: the operator once, kind and parts for a new unit."""
        asked = ["operator"] if self.cursor == "operator" or not self.value("operator") else []
        return [*asked, "serial", *(["kind", *parts_of(self.value("kind"))] if self.begins else [])]

    @property
    def lacking(self) -> str:
        """Return the first field that lacks something; a serial that is proposed is still to be said."""
        return "serial" if self.value("operator") else "operator"

    @property
    def name_problem(self) -> str:
        """Return why nothing is done in the operator's name, "" if it is one. What is a serial was scanned too early; a
        name with digits is taken from the command line alone."""
        name = self.value("operator")
        if not name:
            return "Enter your name"
        known = () if self.listed is None else self.listed.units
        described = self.bench is not None and self.bench.described(name) is not None
        is_serial = described or any(map(str.isdigit, name)) or any(unit.serial == name for unit in known)
        return "That is a serial, and nobody's name. Who is at the bench?" if name != self.named and is_serial else ""

    @property
    def is_last(self) -> bool:
        """Return whether nothing is to be given behind the cursor: behind an empty part the others stay empty too."""
        in_part = self.cursor not in (None, *OWN)
        return self.begins and (self.cursor == self.shown[-1] or (in_part and not self.value(str(self.cursor))))

    @property
    def waits(self) -> bool:
        """Return whether it is still open what a serial means."""
        return self.opens or self.looks

    @property
    def waits_for_list(self) -> bool:
        """Return whether the units are still to come."""
        return self.opens or self.lists

    @property
    def fitting(self) -> list[str]:
        """Return the kinds for which the serial is valid."""
        bench, serial = self.bench, self.value("serial")
        return [] if bench is None else [kind for kind in bench.kinds if bench.problem(serial, kind) is None]

    @property
    def follows(self) -> str | None:
        """Return the kind whose spec describes the serial, None if none does or several do."""
        return None if self.bench is None else self.bench.described(self.value("serial"))

    @property
    def serial_problem(self) -> str:
        """Return why the serial is valid for no kind, "" if it is for one."""
        if self.bench is None or not self.value("serial") or self.fitting:
            return ""
        kind = self.value("kind") if self.value("kind") in self.bench.kinds else self.bench.kinds[0]
        return f"serial '{self.value('serial')}': {self.bench.problem(self.value('serial'), kind)}"

    @property
    def queues(self) -> "Sequence[Queue]":
        return () if self.listed is None else self.listed.queues

    @property
    def queue(self) -> "Queue | None":
        """Return the queue that is shown, all units if that one is gone; None before the units are there."""
        shown = (queue for queue in self.queues if (queue.name, queue.kind) == self.at)
        return next(shown, next(iter(self.queues), None))

    @property
    def units(self) -> "list[KnownUnit]":
        """Return the units of the queue whose serial holds what is typed."""
        waiting = () if self.queue is None else self.queue.units
        return [unit for unit in waiting if self.typed.lower() in unit.serial.lower()]

    @property
    def here(self) -> "KnownUnit | None":
        """Return the unit under the cursor, None in an empty list."""
        return self.units[self.row] if 0 <= self.row < len(self.units) else None

    @property
    def meant(self) -> "KnownUnit | None":
        """Return the unit that is meant: the one of the typed serial, without a serial the one under the cursor."""
        return self.known if self.value("serial") else self.here

    @property
    def at_once(self) -> bool:
        """Return whether Enter begins the new unit whose serial stands there: its kind follows, and has no parts."""
        return self.follows is not None and not parts_of(self.follows)

    @property
    def about(self) -> str:
        """Return what Enter would do with the serial, and what else is to be known."""
        serial, kind = self.value("serial"), self.value("kind")
        if self.bench is None or self.looks:
            return ""
        if self.adds:
            return f"Enter adds {serial} to the tray" if serial and not self.serial_problem else self.scan_words
        if self.serial_problem:
            return f"✗ {self.serial_problem}"
        if self.meant is not None:
            words = f"Enter opens {self.meant.serial} · {self.meant.words} · F8: new attempt"
        elif not serial:
            words = "" if self.listed is None else "A new serial begins a new unit. F6: a whole tray"
        elif self.begins or self.at_once:
            last = self.at_once or self.is_last
            words = f"Enter {'begins' if last else 'goes on with'} {serial}, a new unit of kind {self.follows or kind}"
        else:
            said = self.follows or (self.fitting[0] if len(self.fitting) == 1 else "")
            asked = "of which kind it is" if not said else "what it is made of" if parts_of(said) else "begin it"
            words = f"{serial} is a new unit{f' of kind {said}' if said else ''}. Enter: {asked}"
        return "\n".join(filter(None, (words, self.key_problem)))

    @property
    def scan_words(self) -> str:
        if not self.adds:
            return SCAN
        other = ". Tab: other kind" if self.bench is not None and len(self.bench.kinds) > 1 else ""
        return f"Adding units of kind {self.value('kind')}{other}. Scan every unit of the tray. Esc: that was all"

    @property
    def nothing(self) -> str:
        """Return why no unit is shown and what to do, "" if there is one."""
        if self.units or (self.listed is None and not self.lists):
            return ""
        if self.listed is None:
            return "Looking for the units …"
        if not self.listed.units:
            return "No units yet.\nScan a serial: Enter begins its unit. F6: scan a whole tray."
        if self.begins:
            return f"{self.value('serial')} is new here.\nEsc: back to the units."
        return "No unit of this list has these letters in its serial.\nCtrl+U: all of them again."

    @property
    def called(self) -> dict[str, str]:
        """Return the names of keys that are called otherwise at this moment."""
        if self.adds:
            return {"enter": "Add", "escape": "Tray done"}
        return {"enter": "Begin"} if self.begins or self.at_once else {}

    @property
    def idle_keys(self) -> set[str]:
        """Return the keys that only say why they do nothing at present."""
        does = {
            "tab": self.adds or self.begins or len(self.queues) > 1,
            "f8": self.meant is not None and not self.adds,
            "ctrl+s": any(queue.to_sign for queue in self.queues),
            "f6": not self.adds,  # it still ends the tray, for those who have learned it so
            "ctrl+o": self.cursor != "operator",
            "ctrl+z": self.here is not None,
        }
        return {key for key, active in does.items() if not active}


Turn = turn.Turn[StartDialogue]


def say(d: StartDialogue, words: str, role: str = "quiet", *effects: object) -> Turn:
    """Return the dialogue with words at the foot, where the questions of Escape and Ctrl+Z are not seen any more."""
    return Turn(replace(d, ends=False, doubted=""), effects, FootWords(words, role))


def refuse(d: StartDialogue, name: str, why: str) -> Turn:
    """Stay in a field, or go to it, and say why; the next text that is typed or scanned replaces its text."""
    return say(replace(d, cursor=name, refused=name), why, "bad", Common.SELECT, Common.BELL)


def without_serial(d: StartDialogue) -> StartDialogue:
    """Return the dialogue with an empty line, ready for the next scan, and every unit of the queue shown."""
    texts = {**d.texts, "serial": ""}
    return replace(d, texts=texts, cursor="serial", typed="", row=0, known=None, looks=False, begins=False)
