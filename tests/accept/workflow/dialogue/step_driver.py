"""The dialogue at a step without a screen: keys in; state, words and stored entries out."""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from accept.base.home import home
from accept.judging import load_spec
from accept.store import open_store
from accept.store.payloads import EntryUndone
from accept.tui.background.problems import words_of
from accept.workflow.bench import Workbench
from accept.workflow.dialogue import step as dialogue
from accept.workflow.dialogue import step_effects as do
from accept.workflow.dialogue.step_effects import Do
from accept.workflow.dialogue.step_state import StepDialogue, Turn
from accept.workflow.dialogue.turn import Common, Toast
from accept.workflow.effects.serve_step import StepService, changed_words, saved_words
from accept.workflow.instruments.port import Instruments
from accept.workflow.open_bench import BenchServices
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.steps.unit_list import Queue
from accept.workflow.worker.judging import judge_step
from specs.errors import AcceptError


@dataclass
class Driver:
    """Executes effects as the screen does, one after the other. waits: what threads would do, until `arrive`; asked:
    effects that open another screen."""

    session: Session
    bench: Workbench
    name: str
    queue: Queue | None = None
    secrets: tuple[str, ...] = ()
    holds: bool = False  # entries wait on their way to the store
    d: StepDialogue = field(init=False)
    said: str = ""
    told: Toast = field(default_factory=lambda: Toast(""))
    role: str = ""
    asked: list[Any] = field(default_factory=list)
    waits: deque[Any] = field(default_factory=deque)
    returns: deque[Any] = field(default_factory=deque)

    def __post_init__(self) -> None:
        self.step = self.session.step(self.name)
        self.service = StepService(self.bench, self.session, self.step)
        self.follow(dialogue.opening(self.step, self.service.facts(self.queue)))

    def press(self, *keys: str) -> None:
        for key in keys:
            self.answer(dialogue.press, key)

    def types(self, text: str) -> None:
        """Replace the text in the line with the cursor, as what is selected is replaced, and press Enter."""
        self.edits(text)
        self.press("enter")

    def edits(self, text: str) -> None:
        assert self.d.cursor is not None, "no line has the cursor"
        texts = [line.text for line in self.d.lines]
        texts[self.d.cursor] = text
        self.follow(dialogue.edited(self.d, tuple(texts), self.d.cursor))

    def stands_at(self, name: str, index: int | None = None) -> None:
        """Move the cursor as a mouse does."""
        self.d = self.d.typed(tuple(line.text for line in self.d.lines), self.d.at((name, index)))
        self.answer(dialogue.moved)

    def comes_back(self) -> None:
        """Let the time pass in which what was typed ahead arrives."""
        while self.returns:
            self.answer(dialogue.returned, self.returns.popleft())

    def looks(self) -> None:
        for look in dialogue.looks(self.present()):
            self.execute(look)

    def arrives(self) -> None:
        """Let everything that waits reach the store."""
        self.holds = False
        while self.waits:
            self.execute(self.waits.popleft())

    def present(self) -> StepDialogue:
        return replace(self.d, facts=self.service.facts(self.queue))

    def answer(self, event: Any, *data: Any) -> None:
        self.follow(event(self.present(), *data))

    def follow(self, turn: Turn) -> None:
        self.d = turn.state
        if turn.words is not None:
            self.said, self.role = turn.words.text, turn.words.role
        for effect in turn.effects:
            if isinstance(effect, do.StoreEntry) and (self.holds or self.waits):  # in order
                self.waits.append(effect)
            else:
                self.execute(effect)

    def execute(self, effect: Any) -> None:
        match effect:
            case do.LookForRecords(forms, _):
                found = [(form, self.service.proposals(form)) for form in forms]
                self.answer(dialogue.looked, effect, found, time.time())
            case do.Recognize():
                kind = self.service.recognize(effect, lambda text: text in self.secrets)
                self.answer(dialogue.recognized, effect, kind)
            case do.StoreEntry():
                self.store(effect)
            case do.Settle(then, _):
                self.answer(dialogue.settled, then)
            case do.ReturnLater(place):
                self.returns.append(place)
            case Do.JUDGE:
                judge_step(self.session, self.name)
                self.answer(dialogue.judged)
            case Do.UNDO:
                try:
                    event = self.session.undo.entry(self.name)
                except AcceptError as e:
                    self.said, self.role = str(e), "bad"
                else:
                    assert event.what == EntryUndone.KIND
                    self.answer(dialogue.changed, changed_words(event, self.session.undo.words_of(event)))
            case Common():
                pass
            case Toast():
                self.told = effect
            case Do() | do.Leave() | do.GoToUnit() | do.NextUnit() | do.PickFile():
                self.asked.append(effect)
            case _:
                raise AssertionError(effect)

    def store(self, entry: do.StoreEntry) -> None:
        try:
            event = self.service.store(entry)
        except AcceptError as e:
            is_there = entry.is_file and self.service.path(entry.text).is_file()
            self.answer(dialogue.not_stored, entry, words_of(e), is_there)
        else:
            self.answer(dialogue.stored, entry, saved_words(event), event.data.get("origin", ""))

    def entries(self) -> list[tuple[str, int | None, float]]:
        """Return (input, index, value) of everything that was ever stored at this unit, in order."""
        events = self.session.store.events(self.session.serial, "value_taken")
        return [(e.data["input"], e.data["index"], e.data["value"]) for e in events]

    def values(self) -> list[float]:
        return [value for _, _, value in self.entries()]

    def links(self) -> dict[str, str]:
        events = self.session.store.events(self.session.serial, "record_linked")
        return {e.data["input"]: e.data["file"] for e in events}

    def reason(self, name: str, index: int | None = None) -> str:
        return self.d.reason(self.d.at((name, index)))[0]

    def proposed(self, name: str) -> str | None:
        file = self.d.proposed(self.d.at((name, None)))
        return None if file is None else file.name


@contextmanager
def at_step(
    step: str,
    spec: str = "apa-basic",
    records: Path | None = None,
    instruments: Instruments | None = None,
    serial: str = "APA-02",
    **given: Any,
) -> Iterator[Driver]:
    """Open a step of a new unit."""
    with open_store() as store:
        loaded = load_spec(spec)
        bench = Workbench(
            store,
            home(),
            {loaded.kind: loaded},
            BenchServices(),
            instruments or Instruments(),
            records or home() / "no records",
        )
        session = open_session(store, home(), loaded, "Ann", serial)
        try:
            session.begin({})
            yield Driver(session, bench, step, **given)
        finally:
            session.close()
