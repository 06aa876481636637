"""The first screen and the list of units without a screen: keys in; state, words and effects out, at a bench in
memory."""

from collections import deque
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from accept.workflow.dialogue import start, units
from accept.workflow.dialogue.begin import Begun, BenchKinds, LookForPassphrase, LookUp
from accept.workflow.dialogue.turn import Common
from accept.workflow.steps.unit_list import ALL, KnownUnit, Queue

SECRET = "correct-horse"
KINDS = ("apa", "strut")


def known(serial: str, kind: str = "apa", **more: Any) -> KnownUnit:
    return KnownUnit(serial, kind, more.pop("attempt", 1), None, 0, 0, **more)


@dataclass
class Bench:
    """A bench in memory. pattern: first letters of a serial, by kind; doubts: serials that are asked about."""

    known: dict[str, KnownUnit] = field(default_factory=dict)
    pattern: Mapping[str, str] = field(default_factory=lambda: dict.fromkeys(KINDS, ""))
    doubts: Collection[str] = ()
    begun: list[Begun] = field(default_factory=list)

    @property
    def kinds(self) -> BenchKinds:
        def problem(serial: str, kind: str) -> str | None:
            wrong = " " in serial or not serial.startswith(self.pattern[kind])
            return f"expected {self.pattern[kind]}..., no spaces" if wrong else None

        return BenchKinds(tuple(self.pattern), problem)

    def begin(self, begun: Begun) -> None:
        self.begun.append(begun)
        self.known.setdefault(begun.serial, known(begun.serial, begun.kind))

    def queues(self) -> list[Queue]:
        """All units, the last one on top, and those that wait for a step, the first one on top."""
        waiting = [unit for unit in self.known.values() if "stroke" in unit.waiting]
        queues = [Queue(ALL, "", "All units", tuple(reversed(self.known.values())))]
        return [*queues, *([Queue("stroke", "apa", "Stroke", tuple(waiting))] if waiting else [])]


class Driver:
    """Executes effects as the screens do. threads: what one would do, one after the other, while `waits`; asked:
    effects that open something else, and units whose serial is asked about."""

    def __init__(self, bench: Bench, turn: Any) -> None:
        self.bench, self.said, self.role = bench, "", ""
        self.threads: deque[Any] = deque()
        self.asked: list[Any] = []
        self.waits, self.selected, self.opened = False, False, False
        self.follow(turn)

    def press(self, *keys: str) -> None:
        for key in keys:
            self.answer(self.press_event, key)

    def answer(self, event: Any, *data: Any) -> None:
        self.follow(event(self.d, *data))

    def follow(self, turn: Any) -> None:
        self.d = turn.state
        if turn.words is not None:
            self.said, self.role = turn.words.text, turn.words.role
        for effect in turn.effects:
            if self.waits and not isinstance(effect, Common | start.Do | start.AskReason):  # those need no thread
                self.threads.append(effect)
            else:
                self.execute(effect)

    def arrive(self) -> None:
        """Let everything happen that waits."""
        self.waits = False
        while self.threads:
            self.execute(self.threads.popleft())

    def execute(self, effect: Any) -> None:
        match effect:
            case Common.SELECT:
                self.selected = True
            case LookForPassphrase(texts):
                secret = next((name for name, text in texts if text.strip() == SECRET), None)
                self.answer(self.recognized, effect, secret)
            case Common.BELL:
                pass
            case _:
                self.execute_other(effect)

    def in_doubt(self, begun: Begun) -> bool:
        return not begun.confirmed and begun.serial in self.bench.doubts


class StartDriver(Driver):
    press_event, recognized = staticmethod(start.press), staticmethod(start.recognized)
    d: start.StartDialogue

    def __init__(self, bench: Bench | None = None, proposed: start.Proposed | None = None, **given: str) -> None:
        self.proposed = proposed or start.Proposed()
        super().__init__(bench or Bench(), start.opening(given))

    def types(self, text: str) -> None:
        """Type into the field with the cursor, as what is selected is replaced."""
        assert self.d.cursor is not None
        self.follow(start.edited(self.d, {**self.d.texts, self.d.cursor: text}, self.d.cursor))

    def stands_at(self, name: str | None) -> None:
        self.follow(start.edited(self.d, self.d.texts, name))

    def enters(self, *texts: str) -> None:
        for text in texts:
            self.types(text)
            self.press("enter")

    def values(self) -> dict[str, str]:
        return {name: text for name, text in self.d.texts.items() if text}

    def execute_other(self, effect: Any) -> None:
        match effect:
            case start.OpenBench():
                self.opened = True
                self.answer(start.opened, self.bench.kinds, self.proposed)
            case LookUp(serial):
                self.answer(start.looked, effect, self.bench.known.get(serial), "")
            case start.WaitForBench() if self.d.waits:
                assert self.threads, "nothing ends this"
                self.threads.append(effect)
            case start.WaitForBench(key):
                self.answer(start.press, key)
            case start.Open(begun) if self.in_doubt(begun):
                self.asked.append(begun)
            case start.Open(begun):
                self.bench.begin(begun)
                self.asked.append(effect)
            case start.Do.LEAVE | start.Do.SHOW_UNITS | start.AskReason():
                self.asked.append(effect)
            case _:
                raise AssertionError(effect)


class UnitsDriver(Driver):
    press_event, recognized = staticmethod(units.press), staticmethod(units.recognized)
    d: units.UnitsDialogue

    def __init__(self, bench: Bench, operator: str = "Ann", kind: str = "apa") -> None:
        super().__init__(bench, units.opening(bench.kinds, operator, kind))

    def types(self, text: str, row: int = 0) -> None:
        self.follow(units.edited(self.d, text, row))

    def scans(self, *serials: str) -> None:
        for serial in serials:
            self.types(serial)
            self.press("enter")

    @property
    def listed(self) -> list[str]:
        return [unit.serial for unit in self.d.shown]

    def execute_other(self, effect: Any) -> None:
        match effect:
            case units.Do.LOOK:
                self.answer(units.listed, list(reversed(self.bench.known.values())), self.bench.queues())
            case LookUp(serial):
                self.answer(units.found, effect, self.bench.known.get(serial))
            case units.Add(begun) if begun.serial in self.bench.known:
                self.answer(units.added, begun.serial, False)
            case units.Add(begun) if self.in_doubt(begun):
                self.asked.append(begun)
            case units.Add(begun):
                self.bench.begin(begun)
                self.answer(units.added, begun.serial, True)
            case units.TakeOff(unit):
                del self.bench.known[unit.serial]
                self.answer(units.taken_off, effect)
            case units.CloseList():
                self.asked.append(effect)
            case _:
                raise AssertionError(effect)


def waiting(unit: KnownUnit) -> KnownUnit:
    """Return the unit as it waits for its stroke."""
    return replace(unit, waiting=("stroke",), steps=4)
