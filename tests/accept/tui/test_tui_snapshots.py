"""What the screens look like, at 80 x 24, 100 x 30 and on a large terminal; pictures in `__snapshots__`.

Two journeys through all screens, an APA's and a strut's. A picture that is meant to be another: look at it in `build/`,
then run once with ACCEPT_SNAPSHOTS=renew.
"""

import os
import re
import time
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from textual.pilot import Pilot
from textual.widgets import DataTable, Input

from accept.judging import load_spec
from accept.store.payloads import StepJudged
from accept.tui.background.busy_screen import Working
from accept.tui.screens import start
from accept.tui.screens import step as step_screen
from accept.tui.widgets.bench import units_table
from accept.workflow.bench import Workbench
from accept.workflow.dialogue.begin import Begun
from accept.workflow.effects import serve_begin
from accept.workflow.instruments import port
from accept.workflow.session import Session, panel_cache
from accept.workflow.steps.overview import Drift, Week
from checks.picture import Image, Line, Mark, Panel
from checks.verdict import Finding, Verdict
from tests.accept.tui.tui_help import (
    HEIGHTS,
    NARROW,
    WIDE,
    focused_again,
    loader,
    press,
    running,
    shown,
    title,
    type_line,
)
from tests.checks.gap.shared.explained import FOUND, PANELS
from tests.hw.instruments.fake_instrument import Fake, Only
from tests.shared.record_files import write_csv

pytestmark = pytest.mark.skipif("NO_COLOR" in os.environ, reason="pictures are compared with their colours")
SIZES = pytest.mark.parametrize("size", [NARROW, (100, 30), WIDE], ids=["80x24", "100x30", "140x40"])
ROWS = ("frf", "misalignment", "hysteresis", "gap")
WINDOW = {"#ff5f57", "#febc2e", "#28c840", "#c5c8c6"}  # buttons and default grey that an exported picture is given
RECORDS = Path("records")  # relative, so that the pictures do not show where the tests run
NOW = datetime(2026, 11, 26, 10, 52)
DRIFT = Drift("apa", "stroke_um", (364.0, 363.2, 363.5, 362.1, 361.7, 361.9, 360.8, 360.1, 359.6, 359.9), -1)
WEEK = Week(40, 27, 3, 1, 31, (9, 10, 8, 4, 0, 0, 0), (21.0, 34.0, 29.0, 18.0, 17.0, 12.0, 38.0, 18.0), DRIFT)
METER = Only("capacitance", Fake([4.95e-6]))


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(port, "EVERY_S", 600.0)  # one look at an instrument: a picture shows how many there were
    """A folder with a good record, one of noise, and one that is none."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(start, "now", lambda: NOW)
    monkeypatch.setattr(units_table, "since_words", lambda *_: "2 min")
    monkeypatch.setattr(units_table, "when_words", lambda _: "Wed 25 Nov 14:10")
    monkeypatch.setattr(serve_begin, "week_of", lambda *_: WEEK)
    monkeypatch.setattr(step_screen, "age_words", lambda _: "12 s ago")
    monkeypatch.setattr(Working, "tell", lambda *_: None)  # words with the time that go by themselves
    monkeypatch.setenv("COLORTERM", "truecolor")  # few colours are shown in another way
    monkeypatch.setenv("TZ", "UTC")  # the list of files says when they were written
    time.tzset()
    RECORDS.mkdir()
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 30.0, 0.002)
    on = ((t > 15) & (t < 22)).astype(float)
    write_csv(RECORDS / "mass_on_off.csv", {"t": t, "de": -37e-6 * on + 2e-8 * rng.standard_normal(t.size)})
    write_csv(RECORDS / "nobody_set_it.csv", {"t": t, "de": 2e-8 * rng.standard_normal(t.size)})
    write_csv(
        RECORDS / "frf.csv",
        {name: rng.standard_normal(1000) * 1e-6 for name in ("Va", "Vs", "de", "da")} | {"t": np.arange(1000) * 1e-3},
    )
    (RECORDS / "notes.txt").write_text("not a record")
    for n, path in enumerate(sorted(RECORDS.iterdir())):
        os.utime(path, (1e9 + n, 1e9 + n))


def apa() -> Workbench:
    return replace(loader("apa-basic", RECORDS)(), instruments=METER)


def strut() -> Workbench:
    """With a strut whose responses are taken, and judged already where a model takes part."""
    bench = loader("strut", RECORDS)()
    session, _ = bench.open_unit(Begun("ST-01", "strut", "Ann"))
    for name in ("low", "high"):
        session.records.link("frf", session.step("frf").check.inputs[name], RECORDS / "frf.csv")
    _judged(session)
    session.gap.explain(lambda folder, spec: (FOUND, PANELS))
    session.close()
    return bench


def _judged(session: Session) -> None:
    limits = load_spec("strut").checks["misalignment"].limits
    values = {"dx_um": (12.0, 6.5, "pass", None), "dy_um": (149.0, 14.0, "fail", "149 um is above the upper limit")}
    found = [
        Finding("misalignment", name, value, "um", U, limits[name].lower, limits[name].upper, "guarded",
                Verdict(verdict), 0.0, reason)
        for name, (value, U, verdict, reason) in values.items()
    ]  # fmt: skip
    upto = session.state("misalignment").upto
    panel_cache.save(session.folder, "misalignment", upto, {"map": _map()})
    session.append(StepJudged("misalignment", upto, tuple(found), (), ()))


def _map() -> Panel:
    """A bowl about the estimate."""
    x, y = np.linspace(-200, 200, 41), np.linspace(-600, 600, 41)
    z = np.log10(1 + ((x - 12) / 30) ** 2 + ((y[:, None] - 149) / 60) ** 2)
    turn = np.linspace(0, 2 * np.pi, 40)
    region = Line(12 + 16 * np.cos(turn), 149 + 35 * np.sin(turn), "95 % region", role="model")
    items = (Image(x, y, z, "misfit"), Mark(12.0, "x", role="model"), Mark(149.0, "y", role="model"), region)
    return Panel("where it lies", "dx [um]", "dy [um]", items)


SNAPSHOTS = Path(__file__).parent / "__snapshots__" / "screens"
SEEN = Path(__file__).parents[3] / "build" / "screens"


def look(pilot: Pilot[None], name: str) -> None:
    """Compare the screen with its picture, letter by letter and colour by colour."""
    width, height = pilot.app.size
    picture = re.sub(r"terminal-\d+", "terminal", pilot.app.export_screenshot(title="accept", simplify=True))
    path = SNAPSHOTS / f"{name}-{width}x{height}.svg"
    if os.environ.get("ACCEPT_SNAPSHOTS") == "renew":
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(picture, encoding="utf-8")
    if not path.exists() or path.read_text(encoding="utf-8") != picture:
        SEEN.mkdir(parents=True, exist_ok=True)
        (SEEN / path.name).write_text(picture, encoding="utf-8")
        pytest.fail(f"screen '{name}' is not as in {path}; it is in {SEEN / path.name}")


async def go_to(pilot: Pilot[None], step: str) -> None:
    table = pilot.app.screen.query_one(DataTable)
    table.move_cursor(row=table.get_row_index(step))
    await press(pilot, "enter")


@SIZES
@pytest.mark.slow
async def test_the_screens_of_an_apa(size: tuple[int, int]):
    async with running(apa, size) as pilot:
        await type_line(pilot, "APA-02")
        look(pilot, "start")
        await press(pilot, *(["enter"] if type(pilot.app.screen).__name__ == "StartScreen" else []))
        look(pilot, "steps")
        await press(pilot, "f5")
        look(pilot, "note")
        await press(pilot, "escape")
        await flatness(pilot)
        await values(pilot)
        await records(pilot)
        await press(pilot, "f9")
        look(pilot, "summary")
        await press(pilot, "f2")
        look(pilot, "signing")
        await press(pilot, "escape", "escape", "escape")
        look(pilot, "known_units")


async def flatness(pilot: Pilot[None]) -> None:
    await go_to(pilot, "flatness")
    look(pilot, "step")
    await press(pilot, "f1")
    look(pilot, "help")
    await press(pilot, "escape", "ctrl+f", "f2")
    look(pilot, "files")
    await press(pilot, "escape", "ctrl+f")
    await type_line(pilot, HEIGHTS)
    look(pilot, "findings")
    await press(pilot, "escape")


async def values(pilot: Pilot[None]) -> None:
    await go_to(pilot, "capacitance")
    await shown(pilot, "#gauge", "4.95 µF")
    look(pilot, "live_value")
    refused = pilot.app.focused
    await type_line(pilot, "4.99 V")
    await focused_again(pilot, refused)
    look(pilot, "refusal")
    await press(pilot, "escape")
    await go_to(pilot, "stroke")
    await type_line(pilot, "181.7")
    look(pilot, "failure")
    await press(pilot, "f8")
    look(pilot, "question")
    await press(pilot, "escape", "escape")


async def records(pilot: Pilot[None]) -> None:
    await go_to(pilot, "stiffness")  # opens with the records, which are there
    look(pilot, "proposal")
    for line in ("mass_on_off.csv", "mass_on_off.csv", "6.4"):
        await type_line(pilot, line)
    look(pilot, "record")
    await press(pilot, "f7")
    look(pilot, "picture")
    pilot.app.screen.set_focus(pilot.app.screen.query(Input).first())
    await type_line(pilot, "nobody_set_it.csv")
    look(pilot, "advice")
    await press(pilot, "escape")


@SIZES
async def test_the_screens_of_a_strut(size: tuple[int, int]):
    async with running(strut, size) as pilot:
        await type_line(pilot, "ST-01")
        for _ in range(6):  # serial, kind, and what a strut is made of
            if type(pilot.app.screen).__name__ == "StartScreen":
                await press(pilot, "enter")
        look(pilot, "strut")
        await go_to(pilot, "misalignment")
        look(pilot, "misalignment")
        await press(pilot, "f7")
        look(pilot, "likelihood_map")
        await press(pilot, "escape", "escape")
        await go_to(pilot, "gap")
        look(pilot, "explanation")
        await press(pilot, "f7")
        look(pilot, "before_and_after")


async def test_without_colour_every_state_has_its_mark(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("NO_COLOR", "1")
    async with running(strut) as pilot:
        await type_line(pilot, "ST-01")
        for _ in range(6):
            if type(pilot.app.screen).__name__ == "StartScreen":
                await press(pilot, "enter")
        marks = [str(pilot.app.screen.query_one(DataTable).get_cell(row, "mark")).strip() for row in ROWS]
        assert marks == ["?", "✗", "·", "○"]
        await go_to(pilot, "misalignment")
        assert "✗ fail" in title(pilot)
        colours = set(re.findall(r"(?:fill|color): ?(#[0-9a-f]{6})", pilot.app.export_screenshot()))
        inside = {c for c in colours if len({c[1:3], c[3:5], c[5:7]}) > 1}
        assert inside <= WINDOW  # grey but for the frame that the picture itself has
