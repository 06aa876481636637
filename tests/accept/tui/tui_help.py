"""Driving the screens in tests: keys, and waiting until nothing runs any more; never a sleep."""

import asyncio
import atexit
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from textual._compositor import Compositor
from textual._context import active_app
from textual.app import App
from textual.content import Content
from textual.css.model import RuleSet
from textual.css.stylesheet import Stylesheet
from textual.events import Key
from textual.keys import _character_to_key, key_to_character
from textual.pilot import Pilot
from textual.widget import Widget
from textual.widgets import Input, Label, Static
from textual.worker import WorkerCancelled, WorkerFailed

from accept.certificate.trust import keys
from accept.tui.app import BenchApp
from accept.tui.screens.start import Given
from accept.workflow.bench import Workbench
from accept.workflow.open_bench import BenchServices, open_bench
from accept.workflow.worker.judging import judge_step
from checks.declare import Measured

SHOWN_WITHIN_S = 30.0  # on a crowded machine
SETTLED_WITHIN_S = 240.0  # far beyond any work that a step begins, on a busy machine too
NARROW, WIDE = (80, 24), (140, 40)
HEIGHTS = "0 -2.5 -3 0 -1.5 1 -2 -4"  # APA 2 of [STB] 2.1.2


APART = BenchServices()  # one for all tests of a process: to start it takes longer than what it has to do
atexit.register(APART.close)
_read_rules, _rules = Stylesheet._parse_rules, dict[tuple[Any, ...], list[RuleSet]]()


def _rules_read_once(sheet: Stylesheet, *given: Any, **named: Any) -> list[RuleSet]:
    """The library reads the same styles anew for each program, a tenth of the time of a test of the screens."""
    key = (*sheet._variables.items(), *given, *named.items())
    if key not in _rules:
        _rules[key] = _read_rules(sheet, *given, **named)
    return _rules[key]


Stylesheet._parse_rules = _rules_read_once  # type: ignore[method-assign]


_draw, _display = Compositor.render_update, BenchApp._display


def _drawn_at_rest(compositor: Compositor, full: bool = False, **given: Any) -> Any:
    """Without a terminal nobody sees a frame: a quarter of the time of these tests went into those on the way. What
    stands there at rest is drawn (`settled`), and every frame where a test takes the place of the display."""
    own = active_app.get().__class__._display is not _display
    return _draw(compositor, full, **given) if full or own else None


Compositor.render_update = _drawn_at_rest  # type: ignore[method-assign]


def loader(spec: str = "apa-basic", records: Path | None = None, folder: Path | None = None) -> Callable[[], Workbench]:
    return lambda: replace(open_bench(spec, records, folder=folder), services=APART)


@asynccontextmanager
async def running(
    load: Callable[[], Workbench] | None = None,
    size: tuple[int, int] = NARROW,
    given: Given | None = None,
    toasts: bool = False,
) -> AsyncIterator[Pilot[None]]:
    app = BenchApp(load or loader(), given or Given("Ann"))
    async with app.run_test(size=size, notifications=toasts) as pilot:
        await settled(pilot)
        yield pilot
        await settled(pilot)
        app.close_unit()


async def settled(pilot: Pilot[None]) -> None:
    """Until no screen has work running or waiting, all messages are handled, and the screen in front is laid out and
    drawn; or until the program has fallen over, after which nothing settles any more."""
    app, deadline = pilot.app, time.monotonic() + SETTLED_WITHIN_S
    while app.return_code in (None, 0):
        assert time.monotonic() < deadline, "the screens never came to rest"
        await until(lambda: not _keys_wait(app), deadline)
        with suppress(WorkerFailed, WorkerCancelled):  # what was refused is told on the screen
            await app.workers.wait_for_complete([w for w in app.workers if not w.is_finished])
        await at_rest(pilot, deadline)
        at_work = [w for w in app.workers if not w.is_finished]  # begun by what was handled meanwhile
        if not (at_work or _keys_wait(app)) and all(getattr(screen, "idle", True) for screen in app.screen_stack):
            if app.is_running and not app._exit:
                _draw(app.screen._compositor, screen_stack=app._background_screens)
            return


def _keys_wait(app: BenchApp) -> bool:
    """Return whether a key was sent that is not taken yet: an action may hold back those behind it."""
    return app.is_running and not app._exit and bool(app.pressed._unfinished_tasks)


async def at_rest(pilot: Pilot[None], deadline: float | None = None) -> None:
    """Until all messages are handled, and the screen in front is laid out and drawn, whatever runs in threads."""
    await asyncio.sleep(0)  # what was sent a moment ago arrives
    await until(lambda: _rests(pilot.app), deadline)


def _rests(app: App[Any]) -> bool:
    """Return whether every widget waits for its next message and the screen in front has nothing to draw. What is to
    be drawn is drawn at once, and not in the sixtieth of a second that the program takes."""
    if app._exit or not app.is_running or app.return_code not in (None, 0):
        return True
    screen = app.screen
    due = (
        screen._layout_required,
        screen._scroll_required,
        screen._repaint_required,
        screen._recompose_required,
        screen._dirty_widgets,
        screen._callbacks,
    )
    if any(due):
        screen._on_timer_update()
        return False
    pumps = [app, *(widget for each in app.screen_stack for widget in each.walk_children(with_self=True))]
    came = [pump._message_queue.ready_event for pump in pumps]
    return app._animator._complete_event.is_set() and all(event._waiters and not event.is_set() for event in came)


async def until(holds: Callable[[], object], deadline: float | None = None) -> None:
    """Until this holds: what a timer or an instrument's own thread brings is no worker to wait for."""
    deadline = deadline or time.monotonic() + SETTLED_WITHIN_S
    while not holds():
        assert time.monotonic() < deadline, "it never came"
        await asyncio.sleep(0.001)


async def press(pilot: Pilot[None], *keys: str) -> None:
    """Keys by name, each answered before the next."""
    for key in keys:
        pilot.app.post_message(Key(_character_to_key(key) if len(key) == 1 else key, key_to_character(key)))
        await settled(pilot)


async def type_line(pilot: Pilot[None], text: str) -> None:
    """A line and Enter, as a scanner sends it."""
    field = pilot.app.screen.focused
    assert isinstance(field, Input)
    if text:  # Enter alone takes what stands there
        field.replace(text, *field.selection)  # as a key does: what is selected is replaced
    await press(pilot, "enter")


def words(pilot: Pilot[None], selector: str) -> str:
    """What a label or static shows on the present screen."""
    found = pilot.app.screen.query_one(selector)
    assert isinstance(found, Label | Static)
    return str(found.render())


def told(pilot: Pilot[None]) -> str:
    """What the present screen told last for some seconds."""
    toast = pilot.app.screen.told
    return f"{toast.title}: {toast.text}"


def title(pilot: Pilot[None], card: str = "#todo") -> str:
    """The title of a card, with what stands behind it."""
    return Content.from_markup(str(pilot.app.screen.query_one(card).border_title)).plain


async def shown(pilot: Pilot[None], selector: str, expected: str) -> None:
    """Until these words are there."""
    deadline = time.monotonic() + SHOWN_WITHIN_S
    while expected not in words(pilot, selector):
        assert time.monotonic() < deadline, f"{expected!r} is not in {words(pilot, selector)!r}"
        await asyncio.sleep(0.001)


async def focused_again(pilot: Pilot[None], line: Widget | None) -> None:
    """Until the cursor is back in a line, as it comes back to what was refused."""
    deadline = time.monotonic() + SHOWN_WITHIN_S
    while pilot.app.focused is not line:
        assert time.monotonic() < deadline, f"the cursor is in {pilot.app.focused}"
        await asyncio.sleep(0.001)
    await at_rest(pilot)


async def begin(pilot: Pilot[None], serial: str = "APA-02") -> None:
    """From the start screen to the list of steps."""
    await type_line(pilot, serial)
    await press(pilot, *(["enter"] if type(pilot.app.screen).__name__ == "StartScreen" else []))
    assert type(pilot.app.screen).__name__ == "Steps"


async def fill_basic(pilot: Pilot[None]) -> None:
    """All steps of a good APA under spec apa-basic, from the list of steps back to it."""
    for lines in ([HEIGHTS], ["4,99", "9.85 uF"], ["0.3655 mm"], ["1.75"]):
        await press(pilot, "enter")
        for line in lines:
            await type_line(pilot, line)
        await press(pilot, "escape")


async def fill_values(pilot: Pilot[None], more: float = 0.0) -> None:
    """The same values without the keys, for tests of what comes after them. more: so much on each of another unit's,
    for values that are all equal are taken for a copy."""
    session = pilot.app.session
    values = (
        *(("flatness", "z_um", n, float(z)) for n, z in enumerate(HEIGHTS.split())),
        ("capacitance", "sensor_uF", None, 4.99),
        ("capacitance", "actuator_uF", None, 9.85),
        ("stroke", "stroke_um", None, 365.5),
        ("stiffness", "k_N_per_um", None, 1.75),
    )
    for step, name, index, value in values:
        session.entries.take(step, session.step(step).check.inputs[name], Measured(value + more), index=index)
    for step in dict.fromkeys(step for step, *_ in values):
        judge_step(session, step)
    await settled(pilot)


async def sign_first(pilot: Pilot[None], why: str = "") -> None:
    """On the summary: make the keys, read where the authority's passphrase is, and sign. why: asked for a unit that is
    not accepted."""
    await press(pilot, "f2")
    for line in (*([why] if why else []), "correct horse", "correct horse"):
        await type_line(pilot, line)
    assert keys.AUTHORITY_PASSPHRASE in pilot.app.screen.query(Static)[0].render().plain
    await press(pilot, "escape")
