"""The first screen: renders its dialogue, passes on keys and executes effects; what they mean is decided there."""

import asyncio
from collections.abc import Callable
from concurrent.futures import CancelledError, Future, wait
from dataclasses import asdict, dataclass
from functools import partial
from threading import Thread
from typing import TYPE_CHECKING, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.events import Key
from textual.message import Message
from textual.widgets import Input, Label
from textual.worker import get_current_worker

from accept.tui.background.busy_screen import ONE_IMPORT, Working
from accept.tui.screens.ask import Question, QuestionLine, required, which_unit
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.dialogue import start as dialogue
from accept.workflow.dialogue.begin import Begun, LookForPassphrase, LookUp
from accept.workflow.dialogue.start import OWN, Do, Turn, labels

if TYPE_CHECKING:
    from accept.tui.screens.units import Units
    from accept.workflow.bench import Workbench
    from accept.workflow.effects.serve_begin import BeginService
    from accept.workflow.session import Session
    from accept.workflow.steps.unit_list import KnownUnit, Queue

_LOOK_S = 0.1  # between two looks whether the program ends


@dataclass(frozen=True)
class Given:
    """What the command line or the unit before said: the start screen proposes it."""

    operator: str = ""
    serial: str = ""
    kind: str = ""


@dataclass(frozen=True, eq=False)
class Begin:
    """A unit that is open. problems: what could not be taken from the folder that it came with; queue: what is done at
    it and then at others, None without."""

    bench: "Workbench"
    session: "Session"
    problems: list[str]
    queue: "Queue | None" = None


class StartScreen(Working[Begin | None]):
    """Dismisses with an open unit, None to end."""

    class BenchOpened(Message):
        """The application keeps the bench for the next unit, and closes it at the end."""

        def __init__(self, bench: "Workbench") -> None:
            super().__init__()
            self.bench = bench

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "press('enter')", show=False, priority=True),
        Binding("f2", "press('f2')", "Units, tray", priority=True),
        Binding("f8", "press('f8')", "New attempt", priority=True),
        Binding("up", "app.focus_previous", show=False),
        Binding("down", "app.focus_next", show=False),
        Binding("escape", "press('escape')", "End"),
    ]

    press = staticmethod(dialogue.press)

    def __init__(
        self, load: "Callable[[], Workbench]", bench: "Workbench | None", given: Given, problem: str = ""
    ) -> None:
        """Make the screen. problem: why the unit that was wanted is not open."""
        super().__init__()
        self._load, self._bench = load, bench
        self._opening = dialogue.opening(asdict(given), problem, bench is not None)
        self.dialogue: dialogue.StartDialogue = self._opening.state
        self._settled = asyncio.Event()  # the bench is open, and it is known whether the serial is

    def compose(self) -> ComposeResult:
        yield Label("accept · new unit", classes="title")
        with VerticalScroll(id="begin", can_focus=False):  # the arrows go from field to field
            for name, label in labels().items():
                with Horizontal(classes="line" if name in OWN else "line part", id=f"line-{name}"):
                    yield Label(label, classes="label")
                    hint = "" if name in OWN or "(" in label else "may stay empty"
                    yield TextEntry(self.dialogue.texts[name], placeholder=hint, id=name)
            yield Label("", id="about", markup=False)
        yield Label("Starting …", id="status")
        yield KeyRow()

    async def on_mount(self) -> None:
        if not self.alive:
            return
        await self.follow(self._opening)
        if self._bench is not None:
            proposed = dialogue.Proposed(serial=self._bench.next_serial())
            await self.answer(dialogue.opened, self.service.kinds, proposed)

    @property
    def service(self) -> "BeginService":
        """Return what serves the open bench."""
        from accept.workflow.effects.serve_begin import BeginService  # what it imports is there by now

        assert self._bench is not None  # noqa: S101 - nothing is asked of it before
        return BeginService(self._bench)

    def at_present(self) -> Turn:
        texts = {name: self._line(name).value for name in self.dialogue.texts}
        return dialogue.edited(self.dialogue, texts, self.focused.id if isinstance(self.focused, Input) else None)

    async def draw(self) -> None:
        d = self.dialogue
        for name, text in d.texts.items():
            self.query_one(f"#line-{name}").display = name in d.shown
            if self._line(name).value != text:
                self._line(name).value = text
        self.query_one("#about", Label).update(d.about)
        if d.cursor is not None and self.focused is not self._line(d.cursor):
            self.set_focus(self._line(d.cursor))
        (self._settled.clear if d.waits else self._settled.set)()

    def _line(self, name: str) -> Input:
        return self.query_one(f"#{name}", Input)

    async def execute(self, effect: object) -> None:
        match effect:
            case Do.LEAVE:
                self.leave(None)
            case dialogue.OpenBench(operator, holds):
                failed = partial(self.answer, dialogue.nothing_came)
                send = partial(self.hold, doing="opening the bench") if holds else self.send
                send(partial(self._open_bench, operator), self._bench_is_open, failed=failed)
            case dialogue.WaitForBench(key):
                await self._settled.wait()
                await self.answer(dialogue.press, key)
            case LookForPassphrase(texts):
                await self.answer(dialogue.recognized, effect, await self.secret_among(texts))
            case LookUp():
                self.aside(
                    partial(self.service.look_up, effect),
                    lambda seen: self.answer(dialogue.looked, effect, *seen),
                    "look",
                    partial(self.answer, dialogue.nothing_came),
                )
            case dialogue.AskReason(words):
                lines = [QuestionLine("Reason for the new attempt")]
                question = Question("A new attempt", words, lines, required("Type the reason"))
                self.app.push_screen(question, lambda given: self.answer(dialogue.reasoned, given and given[0]))
            case dialogue.Open(begun):
                service = self.service
                self.hold(
                    lambda: service.doubt(begun) or open_at_bench(service.bench, begun),
                    partial(self._unit_is_open, effect),
                    f"opening {begun.serial}",
                )
            case Do.SHOW_UNITS:
                await self._show_units()

    def _open_bench(self, operator: str) -> "tuple[Workbench, dialogue.Proposed]":
        """Return the bench and what it proposes. It is opened in a thread that does not keep the program from ending:
        nothing can be stored before it is there. Raises what opening it does."""
        opened: Future[tuple[Workbench, dialogue.Proposed]] = Future()

        def open_it() -> None:
            try:
                bench = self._load()
                from accept.workflow.effects.serve_begin import BeginService  # what it imports is there by now

                opened.set_result((bench, BeginService(bench).proposed(operator)))
            except BaseException as error:  # noqa: BLE001 - raised below, in the thread that waits
                opened.set_exception(error)

        Thread(target=open_it, daemon=True).start()
        while not get_current_worker().is_cancelled:
            if wait([opened], _LOOK_S).done:
                return opened.result()
        raise CancelledError

    async def _bench_is_open(self, opened: "tuple[Workbench, dialogue.Proposed]") -> None:
        self._bench, proposed = opened
        self.post_message(self.BenchOpened(self._bench))
        await self.answer(dialogue.opened, self.service.kinds, proposed)

    async def _unit_is_open(self, asked: dialogue.Open, opened: "str | tuple[Workbench, Session, list[str]]") -> None:
        if isinstance(opened, str):
            confirmed = partial(self.answer, dialogue.confirmed, asked.begun)
            self.app.push_screen(which_unit(opened), lambda given: confirmed(given and given[0]))
        else:
            self.leave(Begin(*opened, asked.queue))

    async def _show_units(self) -> None:
        units, value = await asyncio.to_thread(load_units), self.dialogue.value
        if self.is_current:
            await self.app.push_screen(units(self.service, value("operator"), value("kind")), self._units_left)

    async def _units_left(self, chosen: "tuple[KnownUnit, Queue | None] | None") -> None:
        if chosen is not None:
            await self.answer(dialogue.chosen, *chosen)

    async def on_key(self, event: Key) -> None:
        """Type into the first field that lacks something where a click took the cursor away."""
        if self.focused is None and event.character is not None and event.is_printable:
            event.stop()
            await self.answer(dialogue.stand_at_lacking)
            if isinstance(line := self.focused, Input):  # behind its own message, which selects what stands there
                line.call_later(lambda: line.replace(event.character or "", *line.selection))

    async def on_input_changed(self) -> None:
        await self.answer(Turn)

    def help_text(self) -> str:
        return (
            "Type your name, then scan or type the serial number. At its start the program proposes the unit that you "
            "worked on last, unless it is signed. A known unit continues where you left it; every confirmed entry is "
            "kept, also after a power cut. F8 starts a new attempt; earlier attempts are kept. F2 lists the units and "
            "what they wait for: a step, the rig, a signature; F6 there adds a whole tray."
        )


def load_units() -> "type[Units]":
    """Return the list of units, whose imports take long; called in a thread."""
    with ONE_IMPORT:
        from accept.tui.screens.units import Units
    return Units


def open_at_bench(bench: "Workbench", begun: Begun) -> "tuple[Workbench, Session, list[str]]":
    """Open the unit with what the screens need of the physics; imported here, in a thread."""
    with ONE_IMPORT:
        import accept.tui.screens.steps  # noqa: F401
    at_unit = bench.at_unit(begun)
    session, problems = at_unit.open_unit(begun)
    return at_unit, session, problems
