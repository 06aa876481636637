"""The first screen without a screen: keys in; state, words and effects out, at a bench in memory."""

from collections import deque
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from accept.workflow.dialogue import start, units
from accept.workflow.dialogue.begin import Begun, BenchKinds, LookForPassphrase, LookUp
from accept.workflow.dialogue.turn import Common
from accept.workflow.steps.overview import Overview, Week
from accept.workflow.steps.unit_list import ALL, SIGN, KnownUnit, Queue

SECRET = "correct-horse"
KINDS = ("apa", "strut")


def known(serial: str, kind: str = "apa", **more: Any) -> KnownUnit:
    return KnownUnit(serial, kind, more.pop("attempt", 1), None, 0, 0, **more)


@dataclass
class Bench:
    """A bench in memory. pattern: first letters of a serial, by kind; describes: first letters of a serial from which
    its kind follows; doubts: serials that are asked about; fails: the units cannot be listed."""

    known: dict[str, KnownUnit] = field(default_factory=dict)
    pattern: Mapping[str, str] = field(default_factory=lambda: dict.fromkeys(KINDS, ""))
    doubts: Collection[str] = ()
    describes: Mapping[str, str] = field(default_factory=dict)
    fails: bool = False
    begun: list[Begun] = field(default_factory=list)

    @property
    def kinds(self) -> BenchKinds:
        def problem(serial: str, kind: str) -> str | None:
            wrong = " " in serial or not serial.startswith(self.pattern[kind])
            return f"expected {self.pattern[kind]}..., no spaces" if wrong else None

        def described(serial: str) -> str | None:
            return next((kind for kind, letters in self.describes.items() if serial.startswith(letters)), None)

        return BenchKinds(tuple(self.pattern), problem, described)

    def begin(self, begun: Begun) -> None:
        self.begun.append(begun)
        self.known.setdefault(begun.serial, known(begun.serial, begun.kind))

    @property
    def overview(self) -> Overview:
        """All units, the last one on top; those to sign and those that wait for a step, the first one on top."""
        units = tuple(self.known.values())
        waiting = tuple(unit for unit in units if "stroke" in unit.waiting)
        queues = [
            Queue(ALL, "", "All units", units[::-1]),
            Queue(SIGN, "", "To sign", tuple(unit for unit in units if unit.to_sign)),
            Queue("stroke", "apa", "Stroke", waiting),
        ]
        return Overview(units[::-1], [queue for queue in queues if queue.units or queue.name == ALL], Week())


@dataclass(frozen=True)
class Doubt:
    """A serial that is asked for once more; its answer goes to `event`."""

    begun: Begun
    event: Any


class Driver:
    """Executes effects as the screen does. threads: what one would do, one after the other, while `waits`; asked:
    effects that open something else, and units whose serial is asked about."""

    d: start.StartDialogue

    def __init__(self, bench: Bench | None = None, proposed: start.Proposed | None = None, **given: str) -> None:
        self.bench, self.proposed = bench or Bench(), proposed or start.Proposed()
        self.said, self.role = "", ""
        self.threads: deque[Any] = deque()
        self.asked: list[Any] = []
        self.waits, self.selected, self.opened = False, False, False
        self.follow(start.opening(given))

    def press(self, *keys: str) -> None:
        for key in keys:
            self.answer(start.press, key)

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

    @property
    def listed(self) -> list[str]:
        return [unit.serial for unit in self.d.units]

    @property
    def opens(self) -> list[str]:
        """Serials of the units that were opened."""
        return [each.begun.serial for each in self.asked if isinstance(each, start.Open)]

    def in_doubt(self, begun: Begun) -> bool:
        return not begun.confirmed and begun.serial in self.bench.doubts

    def execute(self, effect: Any) -> None:
        match effect:
            case Common.SELECT:
                self.selected = True
            case Common.BELL:
                pass
            case LookForPassphrase(texts):
                secret = next((name for name, text in texts if text.strip() == SECRET), None)
                self.answer(start.recognized, effect, secret)
            case start.OpenBench():
                self.opened = True
                self.answer(start.opened, self.bench.kinds, self.proposed)
            case LookUp(serial):
                self.answer(start.looked, effect, self.bench.known.get(serial), "")
            case units.Do.LOOK if self.bench.fails:
                self.answer(start.no_list, "locked")
            case units.Do.LOOK:
                self.answer(units.listed, self.bench.overview)
            case start.WaitForBench() if self.d.waits_for_list if effect.for_list else self.d.waits:
                assert self.threads, "nothing ends this"
                self.threads.append(effect)
            case start.WaitForBench(key):
                self.answer(start.press, key)
            case start.Open(begun) if self.in_doubt(begun):
                self.asked.append(Doubt(begun, start.confirmed))
            case start.Open(begun):
                self.bench.begin(begun)
                self.asked.append(effect)
            case units.Add(begun) if begun.serial in self.bench.known:
                self.answer(units.added, begun.serial, False)
            case units.Add(begun) if self.in_doubt(begun):
                self.asked.append(Doubt(begun, units.add_confirmed))
            case units.Add(begun):
                self.bench.begin(begun)
                self.answer(units.added, begun.serial, True)
            case units.TakeOff(unit):
                del self.bench.known[unit.serial]
                self.answer(units.taken_off, effect)
            case start.Do.LEAVE | start.AskReason():
                self.asked.append(effect)
            case _:
                raise AssertionError(effect)


def waiting(unit: KnownUnit) -> KnownUnit:
    """Return the unit as it waits for its stroke."""
    return replace(unit, waiting=("stroke",), steps=4)
