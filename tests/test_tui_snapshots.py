"""What the screens look like, at 80 x 24 and on a large terminal: the pictures are beside, in `__snapshots__`."""

import os
from pathlib import Path

import pytest

from accept.tui.app import BenchApp
from accept.tui.start import Given
from accept.workflow.bench import open_bench
from tests.tui_help import HEIGHTS, NARROW, WIDE, begin, press, settled, type_line

pytestmark = pytest.mark.skipif("NO_COLOR" in os.environ, reason="pictures are compared with their colours")
SIZES = pytest.mark.parametrize("size", [NARROW, WIDE], ids=["80x24", "140x40"])


@pytest.fixture
def app(tmp_path: Path) -> BenchApp:
    for name in ("stroke_one_stack.mat", "stroke_two_stacks.mat"):
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (1e9, 1e9))
    return BenchApp(lambda: open_bench("apa-basic", Path("/records")), Given("Ann"))


async def at_start(pilot) -> None:
    await settled(pilot)
    await type_line(pilot, "APA-02")


async def at_steps(pilot) -> None:
    await settled(pilot)
    await begin(pilot)


async def at_step(pilot) -> None:
    await at_steps(pilot)
    await press(pilot, "enter")


async def at_findings(pilot) -> None:
    await at_step(pilot)
    await type_line(pilot, HEIGHTS)


async def at_refusal(pilot) -> None:
    await at_steps(pilot)
    await press(pilot, "down", "enter")
    await type_line(pilot, "4.99 V")


async def at_failure(pilot) -> None:
    await at_steps(pilot)
    await press(pilot, "down", "down", "enter")
    await type_line(pilot, "181.7")


async def at_help(pilot) -> None:
    await at_step(pilot)
    await press(pilot, "f1")


async def at_question(pilot) -> None:
    await at_failure(pilot)
    await press(pilot, "f8")


async def at_summary(pilot) -> None:
    await at_failure(pilot)
    await press(pilot, "escape", "s")


async def at_signing(pilot) -> None:
    await at_summary(pilot)
    await press(pilot, "f2")


SCREENS = (
    at_start,
    at_steps,
    at_step,
    at_findings,
    at_refusal,
    at_failure,
    at_help,
    at_question,
    at_summary,
    at_signing,
)


@SIZES
@pytest.mark.parametrize("there", SCREENS, ids=[f.__name__.removeprefix("at_") for f in SCREENS])
def test_screen(there, size, app, snap_compare):
    assert snap_compare(app, terminal_size=size, run_before=there)
