"""The first screen: who is at the bench, which unit, of what kind, made of what."""

import asyncio
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError, Future, wait
from dataclasses import dataclass
from threading import Thread
from typing import TYPE_CHECKING, ClassVar

from textual.actions import SkipAction
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.events import Key
from textual.message import Message
from textual.widgets import Input, Label
from textual.worker import get_current_worker

from accept.tui.background.busy_screen import Working, load_module
from accept.tui.screens.ask import Question, QuestionLine, required, which_unit
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.entry.shift import NOT_TAKEN
from specs.plugins import products

if TYPE_CHECKING:
    from accept.units.unit_folder import UnitFolder
    from accept.workflow.bench import Workbench
    from accept.workflow.session import Session
    from accept.workflow.steps.unit_list import KnownUnit, Queue

_GO_ON = "Enter: next field; on the last field it starts"
_PARTS = "Enter: start; the parts may stay empty. ↓: next part"
_LOOK_S = 0.1  # between two looks whether the program ends


def labels() -> dict[str, str]:
    """Return the fields and their labels: those of every unit, then the parts of the installed products."""
    own = {
        "operator": "Operator",
        "serial": "Serial number (type or scan)",
        "kind": f"Kind ({', '.join(products())})",
    }
    return own | parts()


def parts() -> dict[str, str]:
    """Return part -> label, of all installed products."""
    return {name: label for product in products().values() for name, label in product.parts.items()}


def parts_of(kind: str) -> tuple[str, ...]:
    """Return the parts of a product, none of one that is not installed."""
    return tuple(products()[kind].parts) if kind in products() else ()


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
        Binding("enter", "next", show=False, priority=True),
        Binding("f2", "known", "Units, tray", priority=True),
        Binding("f8", "new_attempt", "New attempt", priority=True),
        Binding("up", "app.focus_previous", show=False),
        Binding("down", "app.focus_next", show=False),
        Binding("escape", "leave", "End"),
    ]

    def __init__(
        self, load: "Callable[[], Workbench]", bench: "Workbench | None", given: Given, problem: str = ""
    ) -> None:
        """Make the screen. problem: why the unit that was wanted is not open."""
        super().__init__()
        self._load, self._bench, self._given, self._problem = load, bench, given, problem
        self._queue: tuple[str, Queue] | None = None  # from the list of units, with the serial that was chosen there
        self._known: KnownUnit | None = None
        self._looked_up = asyncio.Event()  # the bench is open, and it is known whether the serial is
        self._ending = False  # Escape was pressed once
        self._refused_line: Input | None = None  # whose refusal stands at the foot
        self._confirmed: set[str] = set()  # serials that were asked about and typed once more

    def compose(self) -> ComposeResult:
        yield Label("accept · new unit", classes="title")
        with VerticalScroll(id="begin", can_focus=False):  # the arrows go from field to field
            for name, label in labels().items():
                with Horizontal(classes=f"line {'part' if name in parts() else ''}", id=f"line-{name}"):
                    yield Label(label, classes="label")
                    value = getattr(self._given, name, "")
                    hint = "may stay empty" if name in parts() and "(" not in label else ""
                    yield TextEntry(value, placeholder=hint, id=name)
            yield Label("", id="about", markup=False)
        yield Label("Starting …", id="status")
        yield KeyRow()

    def on_mount(self) -> None:
        if not self.alive:
            return
        self._stand_at_first()
        self._show_parts()
        if self._bench is not None:
            self._ready(self._bench, self._bench.next_serial())
        elif self._given.operator:
            self.send(self._open_bench, self._opened_bench, failed=lambda _: self._looked_up.set())
        else:  # the bench knows who worked here last: a serial that is scanned meanwhile is not the operator's name
            self.hold(self._open_bench, self._opened_bench, "opening the bench", lambda _: self._looked_up.set())

    def _stand_at_first(self) -> None:
        """Put the cursor into the first field that lacks something; a serial that is proposed is still to be said."""
        self.set_focus(self.query_one(f"#{'serial' if self._value('operator') else 'operator'}", Input))

    def _open_bench(self) -> "tuple[Workbench, str, str]":
        """Return the bench, who worked there last, and the serial that goes on from there. It is opened in a thread
        that does not keep the program from ending: nothing can be stored before it is there. Raises what opening it
        does."""
        opened: Future[tuple[Workbench, str, str]] = Future()

        def open_it() -> None:
            try:
                bench = self._load()
                operator = self._given.operator or bench.last_operator()
                opened.set_result((bench, operator, bench.unfinished(operator) if operator else ""))
            except BaseException as error:  # noqa: BLE001 - raised below, in the thread that waits
                opened.set_exception(error)

        Thread(target=open_it, daemon=True).start()
        while not get_current_worker().is_cancelled:
            if wait([opened], _LOOK_S).done:
                return opened.result()
        raise CancelledError

    def _opened_bench(self, opened: "tuple[Workbench, str, str]") -> None:
        bench, operator, unfinished = opened
        self.post_message(self.BenchOpened(bench))
        if bench.taken is not None:
            self._propose(bench.taken)
        line = self.query_one("#operator", Input)
        if not line.value and operator:
            line.value = operator
            if line.has_focus:
                self._stand_at_first()
        self._ready(bench, unfinished or bench.proposed)

    def _ready(self, bench: "Workbench", proposed: str) -> None:
        """Go on with an open bench. proposed: the serial to begin with, which what is typed or scanned replaces."""
        self._bench = bench
        kinds = list(bench.specs)
        kind = self.query_one("#kind", Input)
        if kind.value not in kinds:
            kind.value = kinds[0]
        serial = self.query_one("#serial", Input)
        serial.value = serial.value or proposed
        if serial.has_focus and serial.value == proposed:
            serial.select_all()
        self.say(self._problem or _GO_ON, "bad" if self._problem else "quiet")
        self._look()

    def _propose(self, taken: "UnitFolder") -> None:
        """Return what the header of the unit's folder states."""
        self.query_one("#kind", Input).value, self.query_one("#serial", Input).value = taken.kind, taken.serial
        for name, part in taken.header.parts.items():
            for line in self.query(f"#{name}").results(Input):
                line.value = part

    def on_key(self, event: Key) -> None:
        """Type into the first field that lacks something where a click took the cursor away."""
        if self.focused is None and event.character is not None and event.is_printable:
            event.stop()
            self._stand_at_first()
            if isinstance(line := self.focused, Input):  # behind its own message, which selects what stands there
                line.call_later(lambda: line.replace(event.character or "", *line.selection))

    def on_input_changed(self, event: Input.Changed) -> None:
        self._ending = False
        if self._refused_line is event.input and self.is_mounted:  # why it was refused is of what stood there before
            self._refused_line = None
            self.say(_GO_ON)
        if event.input.id == "kind":
            self._show_parts()
        if event.input.id in ("serial", "kind"):
            self._look()

    def _show_parts(self) -> None:
        wanted = parts_of(self._value("kind"))
        for name in parts():
            self.query_one(f"#line-{name}").display = name in wanted

    def _value(self, name: str) -> str:
        return self.query_one(f"#{name}", Input).value.strip()

    def _look(self) -> None:
        """Say beside the fields whether the serial fits, and whether it is known."""
        bench, serial = self._bench, self._value("serial")
        self._known = None
        about = self.query_one("#about", Label)
        if bench is None:
            return
        self._looked_up.set()
        if not serial:
            about.update("")
        elif problem := self._refused(serial):
            about.update(f"✗ serial '{serial}': {problem}")
        else:
            about.update("")
            operator = self._value("operator")
            self._looked_up.clear()
            self.aside(
                lambda: (serial, bench.known_one(serial), _key_words(bench, operator)),
                self._found,
                "look",
                lambda _: self._looked_up.set(),
            )

    def _refused(self, serial: str) -> str:
        """Return why a serial is not valid for a unit of any kind, "" if it is for one: then that kind is proposed."""
        bench, kind = self._bench, self._value("kind")
        if bench is None or not serial:
            return ""
        problems = {each: bench.problem(serial, each) for each in bench.specs}
        fitting = [each for each, problem in problems.items() if problem is None]
        if kind not in fitting and len(fitting) == 1:
            self.query_one("#kind", Input).value = fitting[0]
        return str(problems.get(kind) or next(iter(problems.values()))) if not fitting else ""

    def _found(self, seen: "tuple[str, KnownUnit | None, str]") -> None:
        serial, known, whose_key = seen
        if serial != self._value("serial"):
            return
        self._known = known
        if known and known.kind != self._value("kind"):
            self.query_one("#kind", Input).value = known.kind  # as it was begun, whatever the unit before was
        self._looked_up.set()
        kind, specs = self._value("kind"), {} if self._bench is None else self._bench.specs
        words = f"new unit {serial}" if kind in specs else ""  # Enter says what is wrong with a kind
        if known:
            words = f"{serial} is known: {known.words}. Enter: continue; F8: new attempt.\n{known.handed_over}"
        words = "\n".join(filter(None, (words, whose_key)))
        self.query_one("#about", Label).update(words)

    async def action_next(self) -> None:
        """Go to the next line; if the serial is known, open its unit. The answer of the store is awaited first."""
        shown = [field for field in self.query(Input) if field.parent is not None and field.parent.display]
        if self.focused not in shown:
            raise SkipAction
        at = shown.index(self.focused)
        here, ends = shown[at], at + 1 == len(shown)
        ends |= here.id in parts() and not here.value.strip()  # those behind it stay empty too
        if ends or here.id == "serial":
            await self._looked_up.wait()
        begins = ends or (here.id == "serial" and self._known)
        if await self._refuse_passphrase(shown if begins else [here]):
            return
        if here.id == "operator" and not here.value.strip():
            self._refuse(here, "Enter your name")
        elif here.id == "serial" and (problem := self._refused(self._value("serial"))):
            self._refuse(here, f"serial '{self._value('serial')}': {problem}")
        elif begins:
            self._begin(None)
        else:
            self.set_focus(shown[at + 1])
            self.say(_PARTS if shown[at + 1].id in parts() else _GO_ON)

    async def _refuse_passphrase(self, lines: Iterable[Input]) -> bool:
        """Take a passphrase away that was typed into one of the lines. Returns whether there was one."""
        for line in lines:
            if not (line.id == "serial" and self._known) and await self.is_secret(line.value):
                with line.prevent(Input.Changed):  # which would take away why
                    line.value = ""
                self._look()
                self._refuse(line, NOT_TAKEN)
                return True
        return False

    def _refuse(self, line: Input, why: str) -> None:
        """Stay in a line, or go to it, and say why; what is typed or scanned next replaces what stands there."""
        self.set_focus(line)
        line.select_all()
        self._refused_line = line
        self.app.bell()
        self.say(why, "bad")

    async def action_new_attempt(self) -> None:
        await self._looked_up.wait()
        if self._known is None:
            self.say("F8 needs a known unit", "bad")
            return
        if await self._refuse_passphrase(self.query(Input)):
            return
        words = f"{self._known.serial}, {self._known.words}. Earlier attempts are kept."
        lines = [QuestionLine("Reason for the new attempt")]
        question = Question("A new attempt", words, lines, required("Type the reason"))
        self.app.push_screen(question, lambda answer: self._begin(answer[0]) if answer else None)

    def _begin(self, reason: str | None) -> None:
        """Begin or go on with a unit, or say what is missing. Keys that follow belong to its steps, and wait until
        it is open. reason: of a new attempt; None goes on with the present one if it exists."""
        bench, operator, serial, kind = self._bench, self._value("operator"), self._value("serial"), self._value("kind")
        if bench is None:
            self.say("The bench could not be opened. Esc, Esc: end the program", "bad")
            return
        kinds = f"the kind: {' or '.join(bench.specs)}{f', not {kind!r}' if kind else ''}"
        wanted = {
            "operator": "" if operator else "your name",
            "serial": "" if serial else "the serial number",
            "kind": "" if kind in bench.specs else kinds,
        }
        missing = [name for name, words in wanted.items() if words]
        if missing:
            self._refuse(
                self.query_one(f"#{missing[0]}", Input), f"Enter {' and '.join(filter(None, wanted.values()))}"
            )
            return
        if problem := bench.problem(serial, kind):
            self._refuse(self.query_one("#serial", Input), f"serial '{serial}': {problem}")
            return
        named = {name: self._value(name) for name in parts_of(kind) if self._value(name)}
        said = (serial, kind, operator, named, reason, serial in self._confirmed)
        if serial not in self._confirmed and (doubt := bench.doubt(serial)) is not None:
            self.app.push_screen(which_unit(doubt), lambda answer: self._confirm(serial, reason, answer))
            return
        self.say(f"Opening {serial} …")
        self.hold(lambda: open_at_bench(bench, said), self._opened, f"opening {serial}")

    def _confirm(self, serial: str, reason: str | None, answer: list[str] | None) -> None:
        """Go on if the serial that was asked about was typed once more."""
        if answer is None or answer[0].strip() != serial:
            self.say(f"{serial} was not confirmed: enter the serial number of the unit on the bench", "bad")
            return
        self._confirmed.add(serial)
        self._begin(reason)

    def _opened(self, opened: "tuple[Workbench, Session, list[str]]") -> None:
        serial = opened[1].serial
        queue = self._queue[1] if self._queue is not None and self._queue[0] == serial else None
        self.leave(Begin(*opened, queue))

    async def action_known(self) -> None:
        """Show the units that were begun here and what they wait for, to go on with one."""
        await self._looked_up.wait()
        module = await asyncio.to_thread(load_module, "accept.tui.screens.units")
        if await self._refuse_passphrase([self.query_one("#operator", Input)]):  # units are added in this name
            return
        if self._bench is not None and self.is_current:
            units = module.Units(self._bench, self._value("operator"), self._value("kind"))
            await self.app.push_screen(units, self._chosen)

    def _chosen(self, chosen: "tuple[KnownUnit, Queue | None] | None") -> None:
        """Open the unit that was chosen from the list."""
        if chosen is not None:
            unit, queue = chosen
            self._queue = None if queue is None else (unit.serial, queue)
            self.query_one("#kind", Input).value = unit.kind
            self.query_one("#serial", Input).value = unit.serial
            self._begin(None)

    def action_leave(self) -> None:
        """Leave the program, and that only when asked twice."""
        if self._ending:
            self.leave(None)
        else:
            self._ending = True
            self.say("Esc again: end the program", "doubt")

    def help_text(self) -> str:
        return (
            "Type your name, then scan or type the serial number. At its start the program proposes the unit that you "
            "worked on last, unless it is signed. A known unit continues where you left it; every confirmed entry is "
            "kept, also after a power cut. F8 starts a new attempt; earlier attempts are kept. F2 lists the units and "
            "what they wait for: a step, the rig, a signature; F6 there adds a whole tray."
        )


def _key_words(bench: "Workbench", operator: str) -> str:
    """Return why the operator cannot sign here, "" if nothing is known against it."""
    if not operator:
        return ""
    certify = load_module("accept.workflow.certify")  # in a thread: signing takes a while to import
    return str(certify.key_problem(bench.home, "technician", operator))


def open_at_bench(
    bench: "Workbench", said: tuple[str, str, str, dict[str, str], str | None, bool]
) -> "tuple[Workbench, Session, list[str]]":
    """Open the unit with what the screens need of the physics; imported here, in a thread."""
    load_module("accept.tui.screens.steps")
    begun = load_module("accept.workflow.bench").Begun(*said)
    at_unit = bench.at_unit(begun)
    session, problems = at_unit.open_unit(begun)
    return at_unit, session, problems
