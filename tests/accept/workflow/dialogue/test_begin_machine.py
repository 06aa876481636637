"""Any keys in any order, looks that come late: only a serial that is valid, typed and confirmed begins a unit, and no
passphrase is kept or shown."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from accept.workflow.dialogue import start, units
from accept.workflow.dialogue.begin import Begun
from tests.accept.workflow.dialogue.begin_driver import SECRET, Bench, Driver, StartDriver, UnitsDriver, known, waiting
from tests.soak import SOAK

SERIALS = ("APA-01", "APA-02", "apa-1", "ST-01", "bad serial", "")
TEXTS = (*SERIALS, "Ann", "apa", "strut", "str", SECRET)
DOUBTS = ("apa-1",)


def bench() -> Bench:
    apa, strut = waiting(known("APA-01")), known("ST-01", "strut", notes=1)
    return Bench({"APA-01": apa, "ST-01": strut}, {"apa": "", "strut": "ST"}, DOUBTS)


class Machine(RuleBasedStateMachine):
    """A technician, and threads that answer when they like."""

    at: Driver

    def __init__(self) -> None:
        super().__init__()
        self.confirmed: set[str] = set()

    @rule(waits=st.booleans())
    def threads_wait(self, waits: bool) -> None:
        self.at.arrive()
        self.at.waits = waits

    @precondition(lambda self: any(isinstance(each, Begun) for each in self.at.asked))
    @rule(answer=st.sampled_from([None, *SERIALS]))
    def answers(self, answer: str | None) -> None:
        asked = next(each for each in self.at.asked if isinstance(each, Begun))
        self.at.asked.remove(asked)
        if answer == asked.serial:
            self.confirmed.add(answer)
        self.at.answer({StartDriver: start, UnitsDriver: units}[type(self.at)].confirmed, asked, answer)

    @invariant()
    def only_what_is_valid_is_begun(self) -> None:
        for begun in self.at.bench.begun:
            assert begun.operator.strip()
            assert self.at.bench.kinds.problem(begun.serial, begun.kind) is None
            assert begun.serial not in DOUBTS or begun.serial in self.confirmed
            assert SECRET not in (begun.serial, begun.operator)

    @invariant()
    def no_passphrase_is_kept(self) -> None:
        assert SECRET not in repr((self.at.d, list(self.at.threads), self.at.said))


class StartMachine(Machine):
    def __init__(self) -> None:
        super().__init__()
        self.at: StartDriver = StartDriver(bench())

    @property
    def in_front(self) -> bool:
        """Whether keys reach the first screen: no list of units, no question stands before it."""
        return not any(
            isinstance(each, Begun | start.AskReason) or each is start.Do.SHOW_UNITS for each in self.at.asked
        )

    @precondition(lambda self: self.in_front and self.at.d.cursor is not None)
    @rule(text=st.sampled_from(TEXTS), enters=st.booleans())
    def types(self, text: str, enters: bool) -> None:
        self.at.types(text)
        if enters:
            self.press("enter")

    @precondition(lambda self: self.in_front)
    @rule(key=st.sampled_from(["enter", "f2", "f8", "escape"]))
    def press(self, key: str) -> None:
        self.at.press(key)

    @precondition(lambda self: self.in_front)
    @rule(name=st.sampled_from([None, "operator", "serial", "kind", "apa"]))
    def stands_at(self, name: str | None) -> None:
        if name is None or name in self.at.d.shown:
            self.at.stands_at(name)

    @precondition(lambda self: start.Do.SHOW_UNITS in self.at.asked)
    @rule(serial=st.sampled_from([None, "APA-01", "ST-01"]))
    def chooses(self, serial: str | None) -> None:
        self.at.asked.remove(start.Do.SHOW_UNITS)
        if serial is not None:
            self.at.answer(start.chosen, self.at.bench.known[serial], None)

    @precondition(lambda self: any(isinstance(each, start.AskReason) for each in self.at.asked))
    @rule(reason=st.sampled_from([None, "dropped"]))
    def gives_a_reason(self, reason: str | None) -> None:
        self.at.asked.remove(next(each for each in self.at.asked if isinstance(each, start.AskReason)))
        self.at.answer(start.reasoned, reason)

    @invariant()
    def the_cursor_is_in_a_field_that_is_shown(self) -> None:
        d = self.at.d
        assert d.cursor is None or d.cursor in d.shown
        assert not d.ends or "Esc again" in self.at.said
        if not self.at.waits:
            assert not d.waits
            assert d.known is self.at.bench.known.get(d.value("serial")) or d.serial_problem or d.known is None


class UnitsMachine(Machine):
    def __init__(self) -> None:
        super().__init__()
        self.at: UnitsDriver = UnitsDriver(bench())

    @rule(text=st.sampled_from((*SERIALS, SECRET)), row=st.integers(0, 3), enters=st.booleans())
    def types(self, text: str, row: int, enters: bool) -> None:
        self.at.types(text, row)
        if enters:
            self.at.press("enter")

    @rule(key=st.sampled_from(["enter", "tab", "shift+tab", "f6", "ctrl+z", "escape"]))
    def press(self, key: str) -> None:
        self.at.press(key)

    @invariant()
    def what_was_measured_stays(self) -> None:
        d = self.at.d
        assert "ST-01" in self.at.bench.known
        assert d.queue is not None or not d.queues
        assert d.kind in d.bench.kinds
        assert not d.doubted or f"take {d.doubted} off" in self.at.said


TestStartMachine, TestUnitsMachine = StartMachine.TestCase, UnitsMachine.TestCase
TestStartMachine.settings = TestUnitsMachine.settings = settings(
    max_examples=300 if SOAK else 60, stateful_step_count=40 if SOAK else 25, deadline=None
)
