"""The application: which screen follows which. It is on the screen before the physics is imported."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from textual.app import App
from textual.binding import Binding, BindingType
from textual.filter import LineFilter, Monochrome

from accept.tui import theme
from accept.tui.screens.help import Help
from accept.tui.screens.start import Begin, Given, StartScreen

if TYPE_CHECKING:
    from accept.workflow.bench import Workbench
    from accept.workflow.session import Session


_KEYCAPS = {"escape": "Esc", "pageup": "PgUp", "pagedown": "PgDn", "up": "↑", "down": "↓", "left": "←", "right": "→"}
_TEXTUALS = ("app.focus_next", "app.focus_previous", "screen.copy_text")  # what textual binds on every screen


@dataclass
class RunOutcome:
    """What this run has come to, for the exit code."""

    verdicts: dict[str, str] = field(default_factory=dict)


class BenchApp(App[None]):
    """load: opens the bench, in a thread, while the first screen is shown already."""

    TITLE = "accept"
    CSS_PATH = "style.tcss"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (110, "-wide")]  # noqa: RUF012 - declared so by textual
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+q", "quit", "Quit", priority=True, show=False),
        Binding("f12", "light_or_dark", "Light or dark", priority=True, show=False),
    ]

    def __init__(self, load: "Callable[[], Workbench]", given: Given | None = None) -> None:
        super().__init__()
        self.load, self.given, self.done = load, given or Given(), RunOutcome()
        self.session: Session | None = None
        self.bench: Workbench | None = None
        self.ansi_theme_dark, self.ansi_theme_light = theme.ANSI_DARK, theme.ANSI_LIGHT
        for one in theme.THEMES:
            self.register_theme(one)
        self.theme = theme.asked_for()

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return the filters of the base class; that of NO_COLOR takes cells without a style too."""
        return [theme.WITHOUT_COLOUR if isinstance(f, Monochrome) else f for f in super().get_line_filters()]

    def action_light_or_dark(self) -> None:
        """Change to the other theme, for a bright bench or a dark one."""
        self.theme = theme.LIGHT if self.theme == theme.DARK else theme.DARK

    def on_mount(self) -> None:
        self.show_start()

    def _handle_exception(self, error: Exception) -> None:
        from accept.base.fault_log import log_fault

        log_fault("a screen of accept run", error)  # textual shows it when the screens are gone
        super()._handle_exception(error)

    def show_start(self) -> None:
        """Show the start screen, with what is proposed for the next unit."""
        self.push_screen(StartScreen(self.load, self.bench, self.given), self._begun)

    def on_start_screen_bench_opened(self, event: StartScreen.BenchOpened) -> None:
        self.bench = event.bench

    def _begun(self, begin: Begin | None) -> None:
        """Leave the start screen with an open unit."""
        if begin is None:
            self.exit()
            return
        from accept.tui.screens.steps import (
            Steps,  # the checks are imported by now, in the thread that opened the bench
        )

        self.session = begin.session
        self.given = Given(begin.session.operator, "", begin.session.spec.kind)
        self.push_screen(Steps(begin.bench, begin.session, "; ".join(begin.problems)), self._left)

    def _left(self, _: bool | None) -> None:
        """Go back to the start screen: a unit is left, finished or not."""
        self.close_unit()
        self.show_start()

    def close_unit(self) -> None:
        """Let go of the unit, and note how far it came."""
        if self.session is not None:
            attempt = self.session.run.attempt
            if attempt is not None:
                self.done.verdicts[self.session.serial] = attempt.verdict or "incomplete"
            self.session.close()
            self.session = None

    def get_key_display(self, binding: Binding) -> str:
        """Return a key's name as it is printed on the key and in the instructions: F1, Esc, Enter."""
        key = binding.key
        if binding.key_display or len(key) == 1 or key.startswith("ctrl+"):
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
            always = f"  {'F12':<12}Light or dark\n  {'^q':<12}Quit; the next start continues here"
            self.push_screen(Help("Help", f"{words}\n\nKeys\n{keys}\n{always}"))
