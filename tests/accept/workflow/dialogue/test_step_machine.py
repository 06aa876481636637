"""Any keys in any order, fast store and slow: only what was confirmed is stored, and only what is stored is said."""

import itertools
import re
from contextlib import ExitStack, suppress

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from accept.workflow.entry.parse_entry import EntryError, parse_number
from tests.accept.workflow.dialogue.step_driver import Driver, at_step
from tests.hw.instruments.fake_instrument import Fake, Only
from tests.soak import SOAK

SERIALS = (f"APA-{n}" for n in itertools.count(1000))
SECRET = "correct-horse"
SLIP = "49.9"  # of the point
TEXTS = ("4.99", "9,85", "4990 nF", SLIP, "-3", "4.99 V", "abc", "1 2 3", "", SECRET)
KEYS = ("f2", "f3", "f4", "ctrl+f", "f8", "f9", "f10", "up", "down", "ctrl+d", "ctrl+z")


class StepMachine(RuleBasedStateMachine):
    """A technician at the step of capacitances, whose meter reads both stacks."""

    def __init__(self) -> None:
        super().__init__()
        self.stack = ExitStack()
        meter = Only("capacitance", Fake([4.99e-6]))
        opened = at_step("capacitance", instruments=meter, serial=next(SERIALS), secrets=(SECRET,))
        self.at: Driver = self.stack.enter_context(opened)
        self.given: list[float] = []  # that was typed with Enter, or kept by F9

    def teardown(self) -> None:
        self.at.arrives()
        self.check_what_is_stored()
        self.stack.close()

    @rule(key=st.sampled_from(KEYS))
    def press(self, key: str) -> None:
        line = self.at.d.here
        asked = [line.doubted for line in self.at.d.lines if line.doubted is not None]
        self.note(asked if key == "f9" else [line.text] if key == "f4" and line is not None else [], sure=key == "f9")
        self.at.press(key)

    @precondition(lambda self: self.at.d.cursor is not None)
    @rule(text=st.sampled_from(TEXTS), enters=st.booleans())
    def type(self, text: str, enters: bool) -> None:
        self.at.edits(text)
        if enters:
            self.enter()

    @rule()
    def enter(self) -> None:
        self.note([line.text for line in self.at.d.lines])
        self.at.press("enter")

    @rule()
    def time_passes(self) -> None:
        self.at.comes_back()
        self.at.looks()

    @precondition(lambda self: self.at.waits)
    @rule()
    def one_arrives(self) -> None:
        self.at.execute(self.at.waits.popleft())

    @rule(slow=st.booleans())
    def store(self, slow: bool) -> None:
        self.at.arrives()
        self.at.holds = slow

    def note(self, texts: list[str | None], sure: bool = False) -> None:
        texts = [text for text in texts if sure or text != SLIP]
        for text in texts:
            with suppress(EntryError):
                self.given.append(parse_number(text or "", "uF").value)

    @invariant()
    def check_the_state(self) -> None:
        d = self.at.d
        assert SECRET not in repr(d)
        assert SECRET not in self.at.said
        assert d.cursor is None or 0 <= d.cursor < len(d.lines)
        assert sum(line.pending for line in d.lines) == len([e for e in self.at.waits if d.at(e.place) is not None])
        assert d.reads == any(entry.is_reading for entry in self.at.waits)
        assert d.what_now
        for n, line in enumerate(d.lines):
            assert not (line.doubted is not None and line.refusal), "asked about and refused at once"
            assert d.reason(n)[1] in ("", "doubted", "refused", "proposed")

    @invariant()
    def check_what_is_stored(self) -> None:
        """Nothing is stored that was neither read nor typed with Enter; a slip of the point only after F9."""
        store, serial = self.at.session.store, self.at.session.serial
        for event in store.events(serial, "value_taken"):
            read = event.data["source"] != "typed"
            assert read or any(abs(event.data["value"] - value) < 1e-9 for value in self.given)
        if said := re.search(r"as entry (\d+)", self.at.told.title):
            assert int(said[1]) in {event.seq for event in store.events(serial)}


TestStepMachine = StepMachine.TestCase
TestStepMachine.settings = settings(
    max_examples=200 if SOAK else 8,
    stateful_step_count=40 if SOAK else 25,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
