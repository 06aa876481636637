"""A screen whose slow or blocking work runs in threads, in order, with a visible clock; errors become one line."""

import asyncio
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from inspect import isawaitable
from typing import Any, ClassVar, Protocol, TypeVar, cast

from textual.binding import ActiveBinding, Binding, BindingType
from textual.events import Click
from textual.reactive import Reactive
from textual.screen import Screen
from textual.timer import Timer
from textual.widget import Widget
from textual.widgets import Input, Label
from textual.worker import Worker, WorkerState

from accept.pictures.words import pretty
from accept.tui.background.partial_draw import PartialDraw
from accept.workflow.dialogue.turn import Common, Toast, Turn

Then = Callable[[Any], Any]  # what it returns is awaited if it can be
T = TypeVar("T")
_LOOK_S = 0.2  # between two looks whether the screen is still there
TOLD_S = 4.0  # that words about what was done stay at least
_READ_PER_S = 20  # characters of them
_NAMED = re.compile(r"(\S+): ")  # a key in the line at the foot
_CLOCK_AFTER_S = 1.0  # what is done sooner needs no clock


# Held while a thread imports what takes long: modules of a library that import each other fail when two threads begin
# at different ends.
ONE_IMPORT = threading.Lock()


def after(first: Callable[[], None], go_on: Then | None) -> Then:
    """Return a function that does the first and goes on."""

    def both(what: Any) -> Any:
        first()
        return None if go_on is None else go_on(what)

    return both


def _moves(**rows: int) -> list[BindingType]:
    """Return keys that move in a table so many rows, before Enter, however fast they come."""
    return [Binding(key, f"move({count})", show=False, priority=True) for key, count in rows.items()]


MOVES = _moves(up=-1, down=1, pageup=-10, pagedown=10)
ENDS = _moves(home=-1_000_000, end=1_000_000)  # a table's own go to the first and last column


class KnowsPassphrases(Protocol):
    """What a screen asks the application."""

    def is_secret(self, text: str) -> bool:
        """Return whether text is a passphrase of this bench; in a thread."""


class Working(Screen[T]):
    """Holds a `Label` with the id `status`: what is going on, what was stored, what went wrong."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("f1", "app.help", "Help")]
    press: Callable[..., Turn[Any]]  # answers a key, in its dialogue
    # The library's own draws the whole screen anew with every move of the cursor: 30 kB on a slow line.
    focused: Reactive[Widget | None] = Reactive(None, repaint=False)

    def __init__(self) -> None:
        super().__init__()
        self._compositor = PartialDraw()
        self._queued: deque[tuple[Callable[[], Any], Then, str, Then | None]] = deque()
        self._afterwards: dict[Worker[Any], tuple[Then, Then | None]] = {}
        self._in_order: Worker[Any] | None = None
        self._doing: tuple[str, float] | None = None
        self._ended = asyncio.Event()  # of what was sent
        self._clock: Timer | None = None
        self.dialogue: Any = None  # its state
        self._keys_of: Any = None  # that the row of keys was made for
        self.told = Toast("")  # last
        self.progress = ""  # progress of a slow step, set from its thread
        self.stop: Callable[[], None] | None = None  # ends a computation that is under way
        self.ready = asyncio.Event()  # not set: it opens another screen or unit, and the keys that follow belong there
        self.ready.set()

    def on_compose(self) -> None:
        """Set the classes of the terminal's size before there are parts: the library sets them when all are styled."""
        app = self.app
        across, down = self.HORIZONTAL_BREAKPOINTS or app.HORIZONTAL_BREAKPOINTS, app.VERTICAL_BREAKPOINTS
        for length, steps in zip(app.size, (across, down), strict=True):
            self.add_class(*[name for least, name in steps or () if length >= least][-1:], update=False)

    def _update_focus_styles(self, focused: Widget | None = None, blurred: Widget | None = None) -> None:
        """Update the styles that depend on the focus, of the parts that gain or lose it. The library updates all parts
        of a card in which the focus stays."""
        paths = [each.ancestors_with_self for each in (focused, blurred) if each is not None]
        shared = set(paths[0]).intersection(*paths[1:]) if len(paths) > 1 else set()
        tops = [top for path in paths for top in [each for each in path if each not in shared][-1:]]
        nodes = {node for top in tops for node in top.walk_children(with_self=True)}
        self.app.stylesheet.update_nodes([each for each in nodes if each._has_focus_within], animate=True)  # noqa: SLF001

    def send(self, action: Callable[[], Any], then: Then, doing: str = "", failed: Then | None = None) -> None:
        """Run `action` in a thread after those sent before, then `then` with its result here."""
        self._clock = self._clock or self.set_interval(0.5, self._tick)
        self._queued.append((action, then, doing, failed))
        self._next()

    def hold(self, action: Callable[[], Any], then: Then, doing: str, failed: Then | None = None) -> None:
        """Run `action` as `send` does; the keys that follow wait for its end: they belong to what it opens."""
        self.ready.clear()
        self.send(action, after(self.ready.set, then), doing, after(self.ready.set, failed))

    def aside(self, action: Callable[[], Any], then: Then, group: str, failed: Then | None = None) -> None:
        """Run `action` in a thread beside the others; a newer one of the same group takes its place."""
        for worker in [w for w in self._afterwards if w.group == group]:
            self._afterwards.pop(worker)
        worker = self.run_worker(action, group=group, thread=True, exit_on_error=False)
        self._afterwards[worker] = (then, failed)

    async def answer(self, event: Callable[..., Turn[Any]], *data: Any) -> None:
        """Let this screen's dialogue answer an event, with what is typed and stored now, and do what follows."""
        if self.alive:
            await self.follow(self.at_present().then(event, *data))

    def later(self, event: Callable[..., Turn[Any]], *data: Any) -> None:
        self.call_next(self.answer, event, *data)

    async def follow(self, turn: Turn[Any]) -> None:
        """Show what follows from an event, and execute its effects."""
        if turn.words is not None:
            self.say(turn.words.text, turn.words.role)
        self.dialogue = turn.state
        await self.draw()
        if self.dialogue != self._keys_of:
            self._keys_of = self.dialogue
            self.refresh_bindings()
        for effect in turn.effects:
            if effect is Common.BELL:
                self.app.bell()
            elif isinstance(effect, Toast):
                self.tell(effect)
            elif effect is Common.SELECT:
                if isinstance(self.focused, Input):
                    self.focused.select_all()
            else:
                await self.execute(effect)

    def at_present(self) -> Turn[Any]:
        """Return the dialogue with what is typed and stored at this moment."""
        raise NotImplementedError

    async def draw(self) -> None:
        """Show the dialogue as it is now."""

    async def execute(self, effect: Any) -> None:
        """Do what a dialogue asks for."""

    async def action_press(self, key: str) -> None:
        await self.answer(self.press, key)

    @property
    def active_bindings(self) -> dict[str, ActiveBinding]:
        """Return the bindings as the dialogue calls them, those that do nothing at present out of the row of keys."""
        names = self.dialogue or self
        idle, called = getattr(names, "idle_keys", ()), getattr(names, "called", {})
        bindings = super().active_bindings
        for key, active in bindings.items():
            if active.node is self:
                own = active.binding
                own = replace(own, show=own.show and key not in idle, description=called.get(key, own.description))
                bindings[key] = active._replace(binding=own)
        return bindings

    @property
    def idle(self) -> bool:
        """Return whether nothing is running or waiting."""
        return not self._afterwards and not self._queued

    @property
    def alive(self) -> bool:
        """Return whether there is still something to show on: a key may leave a screen that is not yet drawn."""
        return self.is_attached and self in self.app.screen_stack and bool(self.children)

    @property
    def in_front(self) -> bool:
        """Return whether no question stands in front of this screen, which textual counts as a current one then too."""
        return self.is_attached and self.app.screen is self

    async def is_secret(self, text: str) -> bool:
        """Return whether text, which is about to be taken for something else, is a passphrase of this bench."""
        return await asyncio.to_thread(cast(KnowsPassphrases, self.app).is_secret, text)

    async def secret_among(self, texts: Sequence[tuple[str, str]]) -> str | None:
        """Return the field of the first text that is a passphrase of this bench, None without one."""
        for name, text in texts:
            if await self.is_secret(text):
                return name
        return None

    def say_first(self, words: str) -> None:
        """Say why this screen was opened."""
        self.say(words)

    def say(self, words: str, role: str = "quiet") -> None:
        """Show one line at the foot of the screen. role: quiet, saved, doubt, good, bad."""
        mark = {"good": "✓ ", "bad": "✗ ", "saved": "▪ ", "doubt": "? "}.get(role, "")
        for status in self.query("#status").results(Label):
            shown, before = f"{mark}{pretty(words)}".replace("[", r"\["), str(status.content)
            if (shown, {role}) != (before, set(status.classes)):
                status.set_classes(role)
                longest = max(len(shown), len(before))  # in a row of its own nothing is laid out anew
                status.update(shown, layout=not before or longest > status.content_size.width)

    def on_click(self, event: Click) -> None:
        """Press the key of the words in the line at the foot that were pointed at: from its name to the next one."""
        if event.widget is None or event.widget.id != "status" or event.y:
            return
        words, x = str(event.widget.render()), event.x - event.widget.gutter.left
        caps = {self.app.get_key_display(each.binding): key for key, each in self.active_bindings.items()}
        before = [each[1] for each in _NAMED.finditer(words) if each.start() <= x < len(words)]
        if before and before[-1] in caps:
            self.app.simulate_key(caps[before[-1]])

    def tell(self, toast: Toast) -> None:
        """Show what was done for some seconds, in place of what was told before."""
        self.told = toast
        self.app.clear_notifications()
        words, lasts_s = pretty(toast.text) or " ", max(TOLD_S, len(toast.text) / _READ_PER_S)
        self.notify(words, title=pretty(toast.title), timeout=lasts_s, markup=False)

    async def saved(self) -> None:
        """Wait until all that was sent has ended, before the screen is left: what waits in the queue would be lost.
        What takes long is not waited for; it is stopped by the one who leaves."""
        while self.is_attached and self.stop is None and (self._queued or self._in_order is not None):
            self._ended.clear()
            with suppress(TimeoutError):
                await asyncio.wait_for(self._ended.wait(), _LOOK_S)

    def stop_or(self, otherwise: Callable[[], None]) -> None:
        """Stop what is under way; without that, the other."""
        (self.stop or otherwise)()

    def action_move(self, rows: int) -> None:
        """Move in the table, to its first or last row at most."""
        table: Any = self.query("DataTable").last()
        table.move_cursor(row=max(0, min(table.cursor_row + rows, table.row_count - 1)))

    def on_unmount(self) -> None:
        """Stop waiting for the answer, so that the program can end."""
        self.stop_or(lambda: None)

    def leave(self, result: T | None = None) -> None:
        """Dismiss the screen, with whatever stands in front; a key that comes twice leaves once."""
        while self in self.app.screen_stack and self.app.screen is not self:
            self.app.pop_screen()
        if self.is_current:
            self.dismiss(result)

    def _next(self) -> None:
        if self._in_order is not None or not self._queued:
            return
        action, then, doing, failed = self._queued.popleft()
        self._in_order = self.run_worker(action, group="in order", thread=True, exit_on_error=False)
        self._afterwards[self._in_order] = (then, failed)
        self._doing, self.progress = ((doing, time.monotonic()) if doing else None), ""

    async def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        worker = event.worker
        if event.state not in (WorkerState.SUCCESS, WorkerState.ERROR, WorkerState.CANCELLED):
            return
        then, failed = self._afterwards.pop(worker, (None, None))
        if worker is self._in_order:
            self._in_order, self._doing = None, None
            self._ended.set()
        following: Any = None
        if event.state is WorkerState.ERROR and worker.error is not None:
            following = self._report(worker.error, failed)
        elif event.state is WorkerState.SUCCESS and then is not None and self.alive:
            following = then(worker.result)
        self._next()
        if isawaitable(following):
            await following

    def _report(self, error: BaseException, failed: Then | None) -> Any:
        from accept.tui.background.problems import (
            words_of,  # heavy to import, and only needed when something went wrong
        )

        words = words_of(error)
        self.app.bell()
        self.say(words, "bad")
        return failed(words) if failed is not None and self.alive else None

    def _tick(self) -> None:
        if self._doing and (passed := time.monotonic() - self._doing[1]) > _CLOCK_AFTER_S:
            more = f" ({self.progress})" if self.progress else ""
            self.say(f"{self._doing[0]}{more} … {passed:.0f} s")
