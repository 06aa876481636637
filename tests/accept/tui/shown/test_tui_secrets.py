"""A passphrase that is typed in the wrong place is not shown by what expects no text, taken by nothing, and stored
nowhere."""

from collections.abc import Awaitable, Callable

import pytest
from textual.pilot import Pilot
from textual.widgets import Input

from accept.base.home import home
from accept.certificate.trust import keys
from accept.tui.app import BenchApp
from accept.tui.screens.start import Given
from accept.tui.screens.step import StepScreen
from accept.tui.widgets.step_list import StepList
from accept.workflow.entry.shift import NOT_TAKEN
from tests.accept.tui.tui_help import begin, fill_values, loader, press, running, settled, type_line, words

PASSPHRASE = "correct-horse"
SLIP = "correct-hrose"  # opens nothing, and says nearly all
Place = Callable[[Pilot[None]], Awaitable[None]]


@pytest.fixture(autouse=True)
def own_keys() -> None:
    keys.init(home(), PASSPHRASE, "Ann")


def seen(pilot: Pilot[None]) -> str:
    """Everything on the screen."""
    return "\n".join(strip.text for strip in pilot.app.screen._compositor.render_strips())


def stored() -> bytes:
    """Every file of the bench but the keys: events, folders of units, logs."""
    paths = [path for path in home().rglob("*") if "keys" not in path.relative_to(home()).parts]
    names = "\n".join(map(str, paths)).encode()
    return b"\n".join([names, *(path.read_bytes() for path in paths if path.is_file())])


async def list_of_steps(pilot: Pilot[None]) -> None:
    await begin(pilot)
    await press(pilot, "f2")


async def complete_unit(pilot: Pilot[None]) -> None:
    await begin(pilot)
    await fill_values(pilot)
    await press(pilot, "f2")


async def complete_step(pilot: Pilot[None]) -> None:
    await complete_unit(pilot)
    await press(pilot, "enter", "f2")
    assert isinstance(pilot.app.screen, StepScreen)
    assert pilot.app.focused is None


async def summary(pilot: Pilot[None]) -> None:
    await begin(pilot)
    await press(pilot, "f9")


@pytest.mark.parametrize("place", [list_of_steps, complete_unit, complete_step, summary])
async def test_letters_that_nothing_expects_are_counted_and_not_shown(place: Place) -> None:
    async with running() as pilot:
        await place(pilot)
        where = pilot.app.screen
        for typed in (SLIP, PASSPHRASE):
            await press(pilot, *typed)
            assert f"{len(typed)} letters" in words(pilot, "#status")
            assert typed[:4] not in seen(pilot)
            await press(pilot, "enter")
            assert pilot.app.screen is where
            assert typed[:4] not in seen(pilot)
            assert (NOT_TAKEN in words(pilot, "#status")) == (typed == PASSPHRASE)
    assert PASSPHRASE[:4].encode() not in stored()


async def number(pilot: Pilot[None]) -> None:
    await begin(pilot)
    pilot.app.screen.query_one(StepList).stand_at("capacitance")
    await press(pilot, "enter")


async def file(pilot: Pilot[None]) -> None:
    await begin(pilot)
    pilot.app.screen.query_one(StepList).stand_at("stroke")
    await press(pilot, "enter", "ctrl+f")


async def reason(pilot: Pilot[None]) -> None:
    await begin(pilot)
    await fill_values(pilot)
    await press(pilot, "enter", "f8")


async def note(pilot: Pilot[None]) -> None:
    await begin(pilot)
    await press(pilot, "f5")


async def signing_reason(pilot: Pilot[None]) -> None:
    await begin(pilot)
    await press(pilot, "f9", "f2")


async def serial(pilot: Pilot[None]) -> None:
    assert pilot.app.focused.id == "serial"


async def operator(pilot: Pilot[None]) -> None:
    await press(pilot, "ctrl+o")


async def new_attempt(pilot: Pilot[None]) -> None:
    await begin(pilot)
    await press(pilot, "escape")
    await type_serial(pilot, "APA-02")
    await press(pilot, "f8")


async def type_serial(pilot: Pilot[None], text: str) -> None:
    line = pilot.app.focused
    assert isinstance(line, Input)
    line.value = text
    await press(pilot)


async def list_of_units(pilot: Pilot[None]) -> None:
    await press(pilot, "tab")


async def tray(pilot: Pilot[None]) -> None:
    await press(pilot, "f6")


@pytest.mark.parametrize(
    "place",
    [number, file, reason, note, signing_reason, serial, operator, new_attempt, list_of_units, tray],
    ids=lambda place: place.__name__,
)
async def test_a_line_that_expects_other_text_gives_a_passphrase_back_empty(place: Place) -> None:
    async with running() as pilot:
        await place(pilot)
        where = pilot.app.screen
        await type_line(pilot, PASSPHRASE)
        assert pilot.app.screen is where
        assert PASSPHRASE not in seen(pilot)
        assert not any(PASSPHRASE in line.value for line in pilot.app.screen.query(Input))
        assert NOT_TAKEN[:30] in " ".join(seen(pilot).split())
    assert PASSPHRASE.encode() not in stored()


async def test_the_filter_of_the_record_picker_shows_no_letters_that_no_name_holds() -> None:
    """F2 signs in the summary and chooses a file in a step."""
    async with running() as pilot:
        await file(pilot)
        await press(pilot, "f2", *PASSPHRASE)
        assert type(pilot.app.screen).__name__ == "Pick"
        assert PASSPHRASE[:4] not in seen(pilot)
        await press(pilot, "enter")
        assert PASSPHRASE[:4] not in seen(pilot)


@pytest.mark.parametrize("typed", ["APA-02", "4.99 uF", "Ann"])
async def test_what_is_no_passphrase_is_taken_as_before(typed: str) -> None:
    async with running() as pilot:
        assert not await pilot.app.screen.is_secret(typed)


async def fall_over(app: BenchApp, secret: str) -> None:
    def sign(passphrase: str) -> None:
        raise ZeroDivisionError(f"fell over {len(passphrase)}")

    async with app.run_test(size=(80, 24)) as pilot:
        await settled(pilot)
        app.call_later(sign, secret)
        await pilot.pause()


async def test_a_program_that_falls_over_shows_no_value_of_a_variable(capsys: pytest.CaptureFixture[str]) -> None:
    """The traceback of the library holds the values of all variables, of which one may be a passphrase."""
    app = BenchApp(loader(), Given("Ann"))
    with pytest.raises(ZeroDivisionError):
        await fall_over(app, PASSPHRASE)
    app._print_error_renderables()
    shown = "".join(capsys.readouterr())
    assert "fell over 13" in shown
    assert PASSPHRASE not in shown
    assert PASSPHRASE.encode() not in stored()
