"""Any keys in any order, looks and lists that come late: only a serial that is valid, typed and confirmed begins a
unit, in the name of somebody, and no passphrase is kept or shown."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from accept.workflow.dialogue import start
from tests.accept.workflow.dialogue.begin_driver import SECRET, Bench, Doubt, Driver, known, waiting
from tests.soak import SOAK

SERIALS = ("APA-01", "APA-02", "apa-1", "ST-01", "PRO", "bad serial", "")
TEXTS = (*SERIALS, "Ann", "apa", "strut", "str", SECRET)
DOUBTS = ("apa-1",)
NAMES = ("operator", "serial", "kind", "apa")
KEYS = ("enter", "tab", "shift+tab", "up", "down", "pageup", "pagedown", "f6", "f8")
KEYS = (*KEYS, "ctrl+o", "ctrl+s", "ctrl+z", "escape")


def bench() -> Bench:
    """With units that wait for a step and for a signature, one at which something was noted, and one whose serial may
    be a name."""
    units = waiting(known("APA-01")), known("ST-01", "strut", notes=1), known("PRO", steps=4, last="9 um")
    return Bench({unit.serial: unit for unit in units}, {"apa": "", "strut": "ST"}, DOUBTS, {"strut": "ST"})


class BeginMachine(RuleBasedStateMachine):
    """A technician, and threads that answer when they like."""

    def __init__(self) -> None:
        super().__init__()
        self.at = Driver(bench(), left="PRO")
        self.confirmed: set[str] = set()

    @property
    def in_front(self) -> bool:
        """Whether keys reach the first screen: no question stands before it."""
        return not any(isinstance(each, Doubt | start.AskReason) for each in self.at.asked)

    @rule(waits=st.booleans())
    def threads_wait(self, waits: bool) -> None:
        self.at.arrive()
        self.at.waits = waits

    @precondition(lambda self: any(isinstance(each, Doubt) for each in self.at.asked))
    @rule(answer=st.sampled_from([None, *SERIALS]))
    def answers(self, answer: str | None) -> None:
        asked = next(each for each in self.at.asked if isinstance(each, Doubt))
        self.at.asked.remove(asked)
        if answer == asked.begun.serial:
            self.confirmed.add(answer)
        self.at.answer(asked.event, asked.begun, answer)

    @precondition(lambda self: self.in_front and self.at.d.cursor is not None)
    @rule(text=st.sampled_from(TEXTS), enters=st.booleans())
    def types(self, text: str, enters: bool) -> None:
        self.at.types(text)
        if enters:
            self.at.press("enter")

    @precondition(lambda self: self.in_front)
    @rule(key=st.sampled_from(KEYS))
    def press(self, key: str) -> None:
        self.at.press(key)

    @precondition(lambda self: self.in_front)
    @rule(name=st.sampled_from([None, *NAMES]))
    def stands_at(self, name: str | None) -> None:
        if name is None or name in self.at.d.shown:
            self.at.stands_at(name)

    @precondition(lambda self: self.in_front)
    @rule(row=st.integers(0, 4), opens=st.booleans())
    def clicks(self, row: int, opens: bool) -> None:
        if row < len(self.at.d.units):
            self.at.answer(start.point, row, opens)

    @precondition(lambda self: any(isinstance(each, start.AskReason) for each in self.at.asked))
    @rule(reason=st.sampled_from([None, "dropped"]))
    def gives_a_reason(self, reason: str | None) -> None:
        self.at.asked.remove(next(each for each in self.at.asked if isinstance(each, start.AskReason)))
        self.at.answer(start.reasoned, reason)

    @invariant()
    def only_what_is_valid_is_begun(self) -> None:
        for begun in self.at.bench.begun:
            assert begun.operator.strip()
            assert begun.operator not in SERIALS[:5]  # the others may be a name, or are none
            assert self.at.bench.kinds.problem(begun.serial, begun.kind) is None
            assert begun.serial not in DOUBTS or begun.serial in self.confirmed
            assert SECRET not in (begun.serial, begun.operator)

    @invariant()
    def no_passphrase_is_kept(self) -> None:
        assert SECRET not in repr((self.at.d, list(self.at.threads), self.at.said))

    @invariant()
    def the_cursor_is_in_a_field_that_is_shown(self) -> None:
        d = self.at.d
        assert d.cursor is None or d.cursor in d.shown
        assert not d.ends or "Esc again" in self.at.said
        assert not d.doubted or f"take {d.doubted} off" in self.at.said
        assert d.row == 0 or d.here is not None
        if not self.at.waits:
            assert not d.waits
            assert d.known is self.at.bench.known.get(d.value("serial")) or d.serial_problem or d.known is None

    @invariant()
    def what_enter_would_do_is_said(self) -> None:
        """Of a unit that is known, of one that is new, of a serial that cannot be."""
        d, serial = self.at.d, self.at.d.value("serial")
        if d.waits or d.waits_for_list or d.adds or not serial:
            return
        if d.known is not None:
            assert d.about.startswith(f"Enter opens {serial}")
        else:
            assert d.about.startswith("✗") if d.serial_problem else serial in d.about

    @invariant()
    def what_was_measured_stays(self) -> None:
        d = self.at.d
        assert {"ST-01", "PRO"} <= set(self.at.bench.known)
        assert d.queue is not None or d.listed is None
        assert not d.adds or d.value("kind") in self.at.bench.kinds.kinds


TestBeginMachine = BeginMachine.TestCase
TestBeginMachine.settings = settings(
    max_examples=600 if SOAK else 120, stateful_step_count=40 if SOAK else 25, deadline=None
)
