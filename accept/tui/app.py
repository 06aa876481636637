"""The application: which screen follows which. It is on the screen before the physics is imported."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar

from textual.binding import Binding, BindingType
from textual.events import Event, Key, MouseDown
from textual.filter import LineFilter, Monochrome

from accept.tui import theme
from accept.tui.background.busy_screen import ONE_IMPORT, Working
from accept.tui.background.key_queue import InOrder
from accept.tui.palette import BenchCommands
from accept.tui.screens.ask import Help
from accept.tui.screens.start import Begin, Given, StartScreen
from accept.workflow.dialogue.begin import Begun
from accept.workflow.entry.shift import SigningShift
from specs.errors import AcceptError

if TYPE_CHECKING:
    from accept.tui.background.scanning import Scanning
    from accept.workflow.bench import Workbench
    from accept.workflow.session import Session
    from accept.workflow.steps.unit_list import KnownUnit, Queue


_KEYCAPS = {"escape": "Esc", "pageup": "PgUp", "pagedown": "PgDn", "up": "↑", "down": "↓", "left": "←", "right": "→"}
_TEXTUALS = ("app.focus_next", "app.focus_previous", "screen.copy_text")  # what textual binds on every screen


@dataclass
class RunOutcome:
    """The verdicts of this run, for the exit code."""

    verdicts: dict[str, str] = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)  # the same as people read them


class BenchApp(InOrder):
    """load: opens the bench, in a thread, while the first screen is shown already."""

    TITLE = "accept"
    CSS_PATH = "style.tcss"
    COMMANDS = {BenchCommands}  # noqa: RUF012 - declared so by textual
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide"), (170, "-huge")]  # noqa: RUF012 - declared so by textual
    VERTICAL_BREAKPOINTS = [(0, "-short"), (24, "-tall"), (32, "-high"), (45, "-roomy")]  # noqa: RUF012 - as above
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+q", "quit", "Quit", priority=True, show=False),
        Binding("f12", "light_or_dark", "Light or dark", priority=True, show=False),
    ]

    def __init__(self, load: "Callable[[], Workbench]", given: Given | None = None) -> None:
        super().__init__()
        self.load, self.given, self.done = load, given or Given(), RunOutcome()
        self.session: Session | None = None
        self.bench: Workbench | None = None
        self.queue: Queue | None = None  # what is done at one unit after the other
        self.shift = SigningShift()
        self._of_16 = self.console.color_system == "standard"
        self.ansi_theme_dark = theme.ANSI_DARK_16 if self._of_16 else theme.ANSI_DARK
        self.ansi_theme_light = theme.ANSI_LIGHT_16 if self._of_16 else theme.ANSI_LIGHT
        for one in theme.THEMES:
            self.register_theme(theme.of_16(one) if self._of_16 else one)
        self.theme = theme.asked_for()

    def refresh_css(self, animate: bool = True) -> None:
        """Read the stylesheet with other colours. Before the first screen nothing was read with the ones before: each
        of the settings above would read it once more."""
        if self.screen_stack:
            super().refresh_css(animate)
        else:
            self.stylesheet.set_variables(self.get_css_variables())

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return the filters of the base class; that of NO_COLOR takes cells without a style too."""
        return [theme.WITHOUT_COLOUR if isinstance(f, Monochrome) else f for f in super().get_line_filters()]

    def waits_for_nothing(self, event: Event) -> bool:
        return isinstance(event, Key) and event.key == "ctrl+q" and self.bench is None and not self.keys_wait

    async def action_quit(self) -> None:
        """End the program once all is saved; at once while the bench opens, before which nothing can be stored."""
        if self.bench is None:
            self.exit()
            return
        for screen in self.screen_stack:
            if isinstance(screen, Working):
                await screen.saved()
        self.exit()

    def action_light_or_dark(self) -> None:
        """Change to the other theme, for a bright bench or a dark one."""
        self.theme = theme.LIGHT if self.theme == theme.DARK else theme.DARK

    def on_mount(self) -> None:
        self.set_class(self.no_color or self._of_16, "-few-colours")
        self.show_start()

    def _handle_exception(self, error: Exception) -> None:
        from accept.base.fault_log import log_fault

        log_fault("a screen of accept run", error)  # textual shows it when the screens are gone
        super()._handle_exception(error)

    def _fatal_error(self) -> None:
        """End the program with the traceback of what went wrong. The library's shows the values of all variables too,
        of which one may be a passphrase."""
        from rich.segment import Segments
        from rich.traceback import Traceback

        self.bell()
        rendered = self.console.render(Traceback(width=None), self.console.options)
        self._exit_renderables.append(Segments(rendered))
        self._close_messages_no_wait()

    async def on_event(self, event: Event) -> None:
        if isinstance(event, Key | MouseDown):
            self.shift.touch()
        await super().on_event(event)

    def show_start(self, problem: str = "") -> None:
        """Show the start screen, with what is proposed for the next unit. problem: why that is not open."""
        self.push_screen(StartScreen(self.load, open_at_bench, self.bench, self.given, problem), self._begun)

    def on_start_screen_bench_opened(self, event: StartScreen.BenchOpened) -> None:
        self.bench = event.bench

    async def _begun(self, begin: Begin | None, words: str = "") -> None:
        """Leave the start screen with an open unit, at the step that was chosen."""
        if begin is None:
            self.exit()
            return
        from accept.tui.screens.steps import (
            Steps,  # the checks are imported by now, in the thread that opened the bench
        )

        self.session, self.queue = begin.session, begin.queue
        self.given = Given(begin.session.operator, "", begin.session.spec.kind)
        self.shift.hand_over(begin.session.operator)
        steps = Steps(begin.bench, begin.session, "; ".join(begin.problems))
        await self.push_screen(steps, self._left)
        if begin.queue is not None:
            await steps.begin_queue(begin.queue.step_at(begin.session.judgements.waiting), words)

    async def _left(self, finished: bool | str | None) -> None:
        """Go back to the start screen, or to the next unit of the queue: a unit is left, finished or not."""
        queue = self.queue
        if finished and queue is not None and not await self.next_unit(queue):
            return
        self.queue = None
        if self.session is not None:
            self.given = replace(self.given, left=self.session.serial)
        self.close_unit()
        self.show_start()

    async def next_unit(self, queue: "Queue", words: str = "", goes_on: "Queue | None" = None) -> str:
        """Open the unit that waits behind this one for the same thing. words: about the unit that is left; goes_on:
        what is done at one unit after the other from there, by default the same. Return why no other is open, "" if one
        is. Keys that follow wait until it is there."""
        session, bench = self.session, self.bench
        if session is None or bench is None:
            return "No unit is open"

        def look() -> "tuple[Queue, KnownUnit | None]":
            known = bench.known()
            waiting = queue.renewed(known, bench.specs)
            return waiting, waiting.after(session.serial, [unit.serial for unit in reversed(known)])

        try:
            waiting, unit = await asyncio.to_thread(look)
        except AcceptError as e:
            return str(e)
        if unit is None:
            return queue.nothing_waits
        left = sum(one.serial not in (session.serial, unit.serial) for one in waiting.units)
        more = f"{left} more wait{'s' * (left == 1)}" if left else "the last one"
        await self.go_to(unit.serial, unit.kind, queue, f"{words}Now {unit.serial}, {more}")
        if self.queue is not None:
            self.queue = goes_on or self.queue
        return ""

    async def go_to(self, serial: str, kind: str, queue: "Queue | None", words: str = "") -> None:
        """Leave this unit and open another one that was begun already."""
        bench, operator = self.bench, self.given.operator
        if bench is None:
            return
        self._leave_unit()
        try:
            opened = await asyncio.to_thread(open_at_bench, bench, Begun(serial, kind, operator))
        except (AcceptError, OSError) as e:
            self.given = Given(operator, serial, kind)
            self.show_start(str(e))
            return
        await self._begun(Begin(*opened, queue), words)

    def step_screen(self, bench: "Workbench", session: "Session", name: str) -> "Scanning":
        """Return the screen of a step of a unit."""
        from accept.tui.screens.step import StepScreen  # imported by now, in the thread that opened the unit

        return StepScreen(bench, session, name)

    def load_summary(self) -> "Callable[[Workbench, Session], Scanning]":
        """Return the summary of a unit, whose imports take long; called in a thread."""
        with ONE_IMPORT:
            from accept.tui.screens.summary import Summary
        return Summary

    async def go_to_step(self, name: str) -> None:
        """Open a step of this unit from another of its screens."""
        from accept.tui.screens.steps import Steps  # what it imports is there by now

        while self.screen_stack and not isinstance(self.screen, Steps):
            if not isinstance(self.screen, Working):
                return
            await self.screen.saved()
            self.screen.leave(False)
            await asyncio.sleep(0)
        if isinstance(self.screen, Steps):
            await self.screen.open_step(name)

    async def scanned(self, serial: str, queue: "Queue | None") -> str:
        """Go to the unit whose serial was scanned, at the step in hand; a new one is begun on the first screen. Return
        why not, "" if it is done."""
        session, bench = self.session, self.bench
        if session is None or bench is None:
            return "No unit is open"
        if serial == session.serial:
            return f"{serial} is the unit that is open"
        from accept.tui.background.scanning import SHORTEST  # what it imports is there by now

        problems = {kind: bench.problem(serial, kind) for kind in bench.specs}
        known = None if all(problems.values()) else await asyncio.to_thread(bench.known_one, serial)
        if known is not None and known.kind in bench.specs:
            await self.go_to(serial, known.kind, queue if queue is not None and queue.kind == known.kind else None)
            return ""
        if problems[session.spec.kind] or len(serial) < SHORTEST:
            return "No unit of that serial was begun here"
        self._leave_unit()
        self.queue, self.given = None, Given(session.operator, serial, session.spec.kind, left=session.serial)
        self.show_start()
        return ""

    async def is_serial(self, text: str) -> bool:
        return self.bench is not None and await asyncio.to_thread(self.bench.is_serial, text)

    def may_be_secret(self, text: str) -> bool:
        from accept.workflow.entry.passphrase_guard import may_be_passphrase  # what it imports is there by now

        return may_be_passphrase(text)

    def is_secret(self, text: str) -> bool:
        """Return whether text, which is about to be taken for something else, is a passphrase of this bench. Called in
        a thread: a tenth of a second for each key."""
        if self.bench is None:
            return False
        from accept.base.home import home
        from accept.workflow.entry.passphrase_guard import is_passphrase  # what it imports is there by now

        return any(is_passphrase(place, text) for place in {self.bench.home, home()})  # a training has its own keys

    def _leave_unit(self) -> None:
        while len(self.screen_stack) > 1:
            self.pop_screen()
        self.close_unit()

    def close_unit(self) -> None:
        """Close the unit, and keep its verdict for the exit code."""
        if self.session is not None:
            from accept.base.documents.results import unit_word  # what it imports is there by now

            attempt = self.session.run.attempt
            if attempt is not None:
                serial, verdict = self.session.serial, attempt.verdict or "incomplete"
                self.done.verdicts[serial] = verdict
                self.done.words[serial] = unit_word(verdict, self.session.judgements.nonconformances)
            self.session.close()
            self.session = None

    def get_key_display(self, binding: Binding) -> str:
        """Return a key's name as it is printed on the key and in the instructions: F1, Esc, Enter."""
        key = binding.key
        if key.startswith("ctrl+"):
            return f"^{key.removeprefix('ctrl+').upper()}"
        if binding.key_display or len(key) == 1:
            return super().get_key_display(binding)
        return _KEYCAPS.get(key, key.capitalize())

    def action_help(self) -> None:
        screen = self.screen
        if not isinstance(screen, Help):
            keys = "\n".join(
                f"  {self.get_key_display(b.binding):<12}{b.binding.description}"
                for b in screen.active_bindings.values()
                if b.binding.description and b.binding.action not in _TEXTUALS and (b.binding.show or b.node is screen)
            )
            told = getattr(screen, "help_text", None)
            words = told() if callable(told) else "Enter goes on, Esc goes back."
            always = f"  {'F12':<12}Light or dark\n  {'^Q':<12}Quit; the next start proposes this unit"
            self.push_screen(Help("Help", f"{words}\n\nKeys\n{keys}\n{always}"))


def open_at_bench(bench: "Workbench", begun: Begun) -> "tuple[Workbench, Session, list[str]]":
    """Open the unit with the physics that its screens need, which is imported here, in a thread."""
    with ONE_IMPORT:
        import accept.tui.screens.step
        import accept.tui.screens.steps  # noqa: F401
    at_unit = bench.at_unit(begun)
    session, problems = at_unit.open_unit(begun)
    return at_unit, session, problems
