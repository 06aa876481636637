"""The first screen, with the units of the bench: renders its dialogue, passes on keys and executes effects."""

import asyncio
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future, wait
from dataclasses import asdict, dataclass
from datetime import datetime
from functools import partial
from threading import Event, Thread
from typing import TYPE_CHECKING, Any, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.events import Key
from textual.message import Message
from textual.widgets import Input, Label, Static
from textual.worker import get_current_worker

from accept.tui.background.busy_screen import Working
from accept.tui.screens.ask import Question, QuestionLine, required, which_unit
from accept.tui.widgets.bench.cards import WIDTH, bench_line, counts_line, queue_row, week_text
from accept.tui.widgets.bench.chips import Chips
from accept.tui.widgets.bench.units_table import PointedTable, UnitCard, UnitsTable
from accept.tui.widgets.card import Card, entitle, put
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.dialogue import start as dialogue
from accept.workflow.dialogue import units
from accept.workflow.dialogue.begin import Begun, LookForPassphrase, LookUp
from accept.workflow.dialogue.start import Do, Turn
from accept.workflow.dialogue.start_state import OWN, StartDialogue, labels

if TYPE_CHECKING:
    from accept.workflow.bench import Workbench
    from accept.workflow.effects.serve_begin import BeginService
    from accept.workflow.session import Session
    from accept.workflow.steps.overview import Overview
    from accept.workflow.steps.unit_list import Queue

_LOOK_S = 0.1  # between two looks whether the program ends
_PAINTED_S = 2.0  # that the bench waits for the first screen at most
_CLOCK_S = 30.0


@dataclass(frozen=True)
class Given:
    """Proposals for the start screen, from the command line or the unit before. left: the unit that was open."""

    operator: str = ""
    serial: str = ""
    kind: str = ""
    left: str = ""


@dataclass(frozen=True, eq=False)
class Begin:
    """A unit that is open. problems: what could not be taken from the folder that it came with; queue: what is done at
    it and then at others, None without."""

    bench: "Workbench"
    session: "Session"
    problems: list[str]
    queue: "Queue | None" = None


OpenUnit = Callable[["Workbench", Begun], "tuple[Workbench, Session, list[str]]"]


def now() -> datetime:
    """Return the time of the bench's clock."""
    return datetime.now().astimezone()


class StartScreen(Working[Begin | None]):
    """Dismisses with an open unit, None to end."""

    class BenchOpened(Message):
        """The application keeps the bench for the next unit, and closes it at the end."""

        def __init__(self, bench: "Workbench") -> None:
            super().__init__()
            self.bench = bench

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "press('enter')", "Open", priority=True),
        Binding("tab", "press('tab')", "Queue", priority=True),
        Binding("f6", "press('f6')", "Tray", priority=True),
        Binding("f8", "press('f8')", "Again", priority=True),
        Binding("ctrl+s", "press('ctrl+s')", "Sign", priority=True),
        Binding("ctrl+o", "press('ctrl+o')", "Name", priority=True),
        Binding("ctrl+z", "press('ctrl+z')", "Undo", priority=True),
        Binding("escape", "press('escape')", "Back", priority=True),
        *(Binding(key, f"press('{key}')", show=False, priority=True) for key in ("shift+tab", "up", "down")),
        *(Binding(key, f"press('{key}')", show=False, priority=True) for key in ("pageup", "pagedown")),
    ]

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (110, "-wide")]  # noqa: RUF012 - declared so by textual
    press = staticmethod(dialogue.press)
    main_key = "enter"

    def __init__(
        self,
        load: "Callable[[], Workbench]",
        open_unit: OpenUnit,
        bench: "Workbench | None",
        given: Given,
        problem: str = "",
    ) -> None:
        """Make the screen. open_unit: is called in a thread; problem: why the unit that was wanted is not open."""
        super().__init__()
        self._load, self._open_unit, self._bench = load, open_unit, bench
        self._opening = dialogue.opening(asdict(given), problem, bench is not None)
        self.dialogue: StartDialogue = self._opening.state
        self._settled = asyncio.Event()  # the bench is open, and it is known whether the serial is
        self._listed = asyncio.Event()  # the units are there
        self._queues: object = ()  # those that are shown
        self._painted = Event()

    def compose(self) -> ComposeResult:
        yield Static("", id="bench-line", markup=False)
        yield Static("", id="counts", markup=False)
        with Horizontal(id="board"):
            with Vertical(id="left"):
                with Card(title="Waiting", id="waiting"):
                    yield PointedTable(id="queues", show_header=False)
                yield Static("", id="week", markup=False, classes="card")
            with Vertical(id="right"):
                with Card(title="Scan or type a serial", id="scan"):
                    yield from map(self._asked, OWN)
                    yield Label("", id="about", markup=False)
                with Card(title="Units", id="list"):
                    yield UnitsTable(id="known")
                    with Vertical(id="nothing", classes="empty"):
                        yield Label("", markup=False)
                yield UnitCard(id="unit-card")
        yield Label("Starting …", id="status")
        yield KeyRow()

    async def on_mount(self) -> None:
        if not self.alive:
            return
        self._rail.add_column("", key="queue", width=WIDTH)
        entitle(self.query_one("#week"), "This week")
        self.set_interval(_CLOCK_S, partial(self._show_units, anew=True))
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

    @property
    def _rail(self) -> PointedTable:
        return self.query_one("#queues", PointedTable)

    def _asked(self, name: str) -> Horizontal:
        """Return the line of a field."""
        text, hint = self.dialogue.texts[name], "" if name in OWN else "may stay empty"
        line = Chips(text, id=name) if name == "kind" else TextEntry(text, placeholder=hint, id=name)
        label = Label(labels()[name] if hint else OWN[name], classes="label")
        return Horizontal(label, line, classes="line part" if hint else "line", id=f"line-{name}")

    @property
    def _fields(self) -> Sequence[str]:
        """Return the fields that have a line: most units have no parts, and the first screen does not wait for them."""
        return [name for name in self.dialogue.texts if name in OWN or self.query(".part")]

    def _line(self, name: str) -> Input | Chips:
        found = self.query_one(f"#{name}")
        assert isinstance(found, Input | Chips)  # noqa: S101 - each field is one of them
        return found

    def at_present(self) -> Turn:
        texts = {**self.dialogue.texts, **{name: self._line(name).value for name in self._fields}}
        typed_into = self.focused.id if isinstance(self.focused, Input | Chips) else None
        return dialogue.edited(self.dialogue, texts, typed_into)

    async def draw(self) -> None:
        d = self.dialogue
        if not (OWN.keys() >= set(d.shown) or self.query(".part")):
            parts = [self._asked(name) for name in d.texts if name not in OWN]
            await self.query_one("#scan").mount(*parts, before="#about")
        for name in self._fields:
            line, text = self._line(name), d.texts[name]
            self.query_one(f"#line-{name}").display = name in d.shown or (name == "kind" and d.adds)
            if isinstance(line, Chips):
                line.show(d.fitting if d.begins else () if d.bench is None else d.bench.kinds, text)
            elif line.value != text:
                line.value = text
        put(self.query_one("#about", Label), d.about)
        if d.cursor is not None and self.focused is not self._line(d.cursor):
            self.set_focus(self._line(d.cursor))
        self._show_units()
        if d.listed is not None:
            self._show_queues(d.listed)
        (self._settled.clear if d.waits else self._settled.set)()
        (self._listed.clear if d.waits_for_list else self._listed.set)()

    def _show_queues(self, overview: "Overview") -> None:
        d = self.dialogue
        if overview.queues is not self._queues:
            self._queues = overview.queues
            self._rail.clear()
            most = max(len(queue.units) for queue in overview.queues)
            for queue in overview.queues:
                self._rail.add_row(queue_row(queue, most))
            card, week = self.query_one("#week", Static), overview.week
            put(card, week_text(week))
            more = "" if week.whole else "+"  # units that are too old for the list
            entitle(card, "This week", f"{week.judged} of {week.begun}{more}" if week.begun else "")
        if d.queue is not None:
            self._rail.move_cursor(row=overview.queues.index(d.queue))
        put(self.query_one("#counts", Static), counts_line(overview, d.queue, self.size.width))

    def _show_units(self, *, anew: bool = False) -> None:
        """Show the bench, its units and the one that is meant, as the clock has it. anew: the age of every unit too."""
        d = self.dialogue
        served = None if self._bench is None else self.service
        name, answering = ("", {}) if served is None else (served.bench_name, served.answering)
        operator = "" if d.cursor == "operator" else d.value("operator")
        line = bench_line(name, operator, answering, now(), self.size.width)
        put(self.query_one("#bench-line", Static), line)
        table, nothing = self.query_one(UnitsTable), self.query_one("#nothing")
        nothing.display, table.display = bool(d.nothing), not d.nothing
        put(nothing.query_one(Label), d.nothing)
        if d.listed is not None:
            table.show(d.units, d.row, now(), anew=anew)
        if d.queue is not None:
            entitle(self.query_one("#list"), d.queue.title, str(len(d.units)))
        words = f"{d.value('serial')}: nothing is measured yet" if d.begins else "No unit is chosen"
        self.query_one(UnitCard).display = not d.nothing  # the list has its room
        self.query_one(UnitCard).show(d.here if d.adds else d.meant, words)

    def on_resize(self) -> None:
        if self.alive:
            self._show_units()

    async def execute(self, effect: object) -> None:
        match effect:
            case Do.LEAVE:
                self.leave(None)
            case dialogue.OpenBench(operator, holds):
                failed = partial(self.answer, dialogue.nothing_came)
                send = partial(self.hold, doing="opening the bench") if holds else self.send
                self.call_after_refresh(self._painted.set)
                send(partial(self._open_bench, operator), self._bench_is_open, failed=failed)
            case dialogue.WaitForBench(key, for_list):
                await (self._listed if for_list else self._settled).wait()
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
            case units.Do.LOOK:
                shown, failed = partial(self.answer, units.listed), partial(self.answer, dialogue.no_list)
                if self.dialogue.lists:  # a scan does not wait for the units
                    self.aside(self.service.overview, shown, "list", failed)
                else:  # no clock: what was said stays at the foot
                    self.hold(self.service.overview, shown, "", failed)
            case dialogue.AskReason(words):
                lines = [QuestionLine("Reason for the new attempt")]
                question = Question("A new attempt", words, lines, required("Type the reason"))
                self.app.push_screen(question, lambda given: self.answer(dialogue.reasoned, given and given[0]))
            case dialogue.Open(begun):
                service, opened = self.service, partial(self._unit_is_open, effect)
                ask_or_open = lambda: service.doubt(begun) or self._open_unit(service.bench, begun)  # noqa: E731
                self.hold(ask_or_open, opened, f"opening {begun.serial}")
            case units.Add(begun):
                self.hold(partial(self.service.add, begun), partial(self._is_added, begun), f"adding {begun.serial}")
            case units.TakeOff(unit, operator):
                self.hold(
                    partial(self.service.bench.take_off, unit.serial, unit.kind, operator),
                    lambda _: self.answer(units.taken_off, effect),
                    f"taking {unit.serial} off",
                )

    def _open_bench(self, operator: str) -> "tuple[Workbench, dialogue.Proposed]":
        """Return the bench and what it proposes. It is opened in a thread that does not keep the program from ending:
        nothing can be stored before it is there. It follows the first screen: what it imports would take the time of
        that. Raises what opening it does."""
        self._painted.wait(_PAINTED_S)
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
            self._ask_which(opened, partial(dialogue.confirmed, begun=asked.begun))
        else:
            self.leave(Begin(*opened, asked.queue))

    async def _is_added(self, begun: Begun, answer: bool | str) -> None:
        if isinstance(answer, str):
            self._ask_which(answer, partial(units.add_confirmed, begun=begun))
        else:
            await self.answer(units.added, begun.serial, answer)

    def _ask_which(self, doubt: str, confirmed: Callable[..., Turn]) -> None:
        def answered(given: list[str] | None) -> Any:
            return self.answer(lambda d: confirmed(d, answer=given and given[0]))

        self.app.push_screen(which_unit(doubt), answered)

    async def on_pointed_table_pointed(self, event: PointedTable.Pointed) -> None:
        """Mark a unit, or open it by two clicks; show a queue."""
        if event.table is self._rail:
            await self.answer(units.show_queue, event.row)
        else:
            await self.answer(dialogue.point, event.row, event.twice)

    async def on_key(self, event: Key) -> None:
        """Type into the first field that lacks something where a click took the cursor away, or where a kind is
        chosen: what is scanned there is another serial."""
        if not isinstance(self.focused, Input) and event.character is not None and event.is_printable:
            event.stop()
            await self.answer(dialogue.stand_at_lacking)
            if isinstance(line := self.focused, Input):  # behind its own message, which selects what stands there
                line.call_later(lambda: line.replace(event.character or "", *line.selection))

    async def on_input_changed(self) -> None:
        await self.answer(Turn)

    on_chips_changed = on_input_changed

    def help_text(self) -> str:
        return (
            "Scan or type a serial: the line says what Enter would do. A known unit continues where you left it; every "
            "confirmed entry is kept, also after a power cut. A new one begins. ↑↓ choose a unit of the list. On the "
            "left is what the units wait for: Tab changes the list; from that of a step, of the rig or of signatures, "
            "Enter at the end of a unit goes on to the next one. F6: scan the units of a tray. F8: a new attempt; "
            "earlier ones are kept. ^S: the units to sign, one after the other. ^O: another person is at the bench. "
            "^Z twice takes a unit off the list at which nothing was done.\n\n"
            "Marks: ✓ pass, ✗ fail, ~ conditional, ? no result, ! held, ○ taken, ◉ stands here, · not done. Red: a "
            "nonconformance, quality assurance decides. Instruments: ● answers, ○ not asked yet. Time per unit is from "
            "its first entry to its verdict. A drift is a trend that chance makes once in a thousand times."
        )
