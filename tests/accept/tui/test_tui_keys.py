"""Random keys: they never crash it, never sign, never change what is stored."""

import asyncio
import random

import pytest
from textual.events import Key
from textual.keys import _character_to_key
from textual.pilot import Pilot

from accept.base.home import home
from accept.certificate.trust import keys as signing_keys
from accept.store import open_store
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.text_entry import TextEntry
from tests.accept.tui.tui_help import begin, loader, press, running, settled
from tests.soak import SOAK

COUNT = 20_000 if SOAK else 200
MOST = 5  # times as many, if a field was not reached
BATCH = 20
TURNS = 50  # of the event loop for a key to bubble up from the line to the screen, which is five widgets away
NAMED = (
    *("enter",) * 6,
    *("tab", "shift+tab", "up", "down", "left", "right", "home", "end", "pageup", "pagedown") * 2,
    *("escape", "backspace", "delete", "ctrl+z", "ctrl+u", "ctrl+w", "ctrl+c", "ctrl+v"),
)
FUNCTIONS = tuple(f"f{n}" for n in range(1, 13))
TYPED = "0123456789.,-±eu FVnm[]/\\'\"$é漢yns"
SENSIBLE = ("4.99", "10", "200", "1,7", "365 um", "0 1 2 3 4 5 6 7", "R-1", "y")  # so that some of it is taken


def drawn(rng: random.Random) -> list[Key]:
    """One key, or a line that means something and Enter."""
    chance = rng.random()
    if chance < 0.35:
        return [Key(rng.choice(FUNCTIONS if chance < 0.03 else NAMED), None)]
    letters = rng.choice(TYPED) if chance < 0.7 else rng.choice(SENSIBLE)
    typed = [Key(_character_to_key(letter), letter) for letter in letters]
    return typed if chance < 0.7 else [Key("end", None), Key("ctrl+u", None), *typed, Key("enter", "\r")]


async def send(pilot: Pilot[None], rng: random.Random, count: int) -> int:
    """Keys as a terminal sends them, letters faster than the program answers; returns how many."""
    sent = 0
    while sent < count:
        for key in drawn(rng):
            pilot.app.post_message(key)
            sent += 1
            if not key.is_printable:  # a binding bubbles up and would come after letters that follow at once
                for _ in range(TURNS):
                    await asyncio.sleep(0)
    await settled(pilot)
    return sent


async def back_at_a_step(pilot: Pilot[None], serial: str) -> None:
    """From wherever the keys have led to a step of this unit, so that they do not end in one corner."""
    for _ in range(12):
        screen = pilot.app.screen
        match type(screen).__name__:
            case "StepScreen":
                return
            case "StartScreen":
                for name, value in (("operator", "Ann"), ("serial", serial)):
                    screen.query_one(f"#{name}", TextEntry).value = value
                screen.query_one("#serial", TextEntry).focus()
                await press(pilot, "enter", "enter")
            case "Steps":
                await press(pilot, "enter")
            case _:
                await press(pilot, "escape")


@pytest.mark.slow
async def test_random_keys(tmp_path):
    signing_keys.init(home(), "correct horse", "Ann", "Quinn", "battery staple")
    rng, sent, kept, kinds = random.Random(8), 0, None, set()
    reached = {"value_taken", "step_judged"}  # the keys did reach the fields

    def is_enough() -> bool:
        """Return whether all keys were sent; on a slow machine fewer of them reach a field, so that more are sent."""
        return sent >= COUNT and (reached <= kinds or sent >= MOST * COUNT)

    while not is_enough():
        async with running(loader("apa-basic", tmp_path)) as pilot:
            while not is_enough() and pilot.app.is_running and not pilot.app._exit:
                await back_at_a_step(pilot, f"R-{sent // 500}")
                sent += await send(pilot, rng, 5 * BATCH)
                with open_store() as store:
                    assert store.check(kept) is None  # every event is as it was when last looked at
                    kept = store.head()
                    kinds = {event.what for event in store.events()}
    assert reached <= kinds
    assert "certificate_signed" not in kinds
    assert not list(home().glob("certificates/*"))


async def test_the_row_of_keys_is_composed_anew_where_a_key_changes_and_only_there():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        row = pilot.app.screen.query_one(KeyRow)
        drawn = row.placed
        await press(pilot, "down", "up")
        assert row.placed is drawn
        await press(pilot, "ctrl+f")  # records instead of values: F2 has a file to pick
        assert row.placed is not drawn
        active = [each for each in pilot.app.screen.active_bindings.values() if each.binding.show]
        shown = {(key.key, key.enabled) for key in row.keys}
        assert shown - {("ctrl+p", True)} == {(each.binding.key, each.enabled) for each in active}
        assert ("f2", True) in shown
