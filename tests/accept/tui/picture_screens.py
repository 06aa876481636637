"""The pictures of the guided workflow in the documentation: `make pictures` drives the program itself and writes them.

Run by hand: `python tests/accept/tui/picture_screens.py docs/img`, with the names of scenes for some of them. What is
shown is simulated, measured and computed on the way.
"""

import asyncio
import os
import re
import sys
import tempfile
from pathlib import Path

from textual.pilot import Pilot
from textual.widgets import DataTable, Static

sys.path.insert(0, str(Path(__file__).parents[3]))
from accept.base.atomic_files import write_atomic
from accept.models.model_file import open_model
from accept.simulate import UnitRequest, simulate
from accept.tui.screens.ask import Question
from accept.tui.screens.start import Given
from accept.workflow.open_bench import open_bench
from accept.workflow.training import open_training
from tests.accept.tui.shown.cell_picture import save
from tests.accept.tui.tui_help import fill_basic, press, running, type_line, words

SIZE = (120, 36)


def keep(pilot: Pilot[None], path: Path) -> None:
    save(pilot.app, path)
    print(path)


async def to_steps(pilot: Pilot[None], serial: str = "") -> None:
    if serial:
        await type_line(pilot, serial)
    for _ in range(6):
        if type(pilot.app.screen).__name__ == "StartScreen":
            await press(pilot, "enter")


async def open_row(pilot: Pilot[None], key: str) -> None:
    table = pilot.app.screen.query_one(DataTable)
    table.move_cursor(row=table.get_row_index(key))
    await press(pilot, "enter")


async def read(pilot: Pilot[None]) -> None:
    """Until the instrument is read, without a fault, which it has beside other work."""
    while not re.search(r"F3 Take  -?\d[^✗]*$", words(pilot, "#gauge")):
        await asyncio.sleep(0.05)


async def measuring(out: Path) -> None:
    """An instrument's live value, one value taken."""
    bench = open_training("apa", 1)
    async with running(lambda: bench, SIZE, Given("Ann")) as pilot:
        await to_steps(pilot)
        await open_row(pilot, "flatness")
        await read(pilot)
        keep(pilot, out / "workflow-step.png")
        await press(pilot, "f12")
        keep(pilot, out / "workflow-step-light.png")
        await press(pilot, "f12")
        await press(pilot, "escape")
        await open_row(pilot, "capacitance")
        await press(pilot, "f3", "up")
        await read(pilot)
        keep(pilot, out / "workflow-live.png")
    bench.close()


async def tray(out: Path) -> None:
    """Units of a tray, one of them held, and the result of another in large letters."""
    bench = open_bench("apa-basic")
    async with running(lambda: bench, SIZE, Given("Ann")) as pilot:
        await to_steps(pilot, "APA-11")
        await fill_basic(pilot)
        await press(pilot, "f9")
        keep(pilot, out / "workflow-result.png")
        await press(pilot, "escape", "escape", "f6")
        for serial in ("APA-12", "APA-13", "APA-14"):
            await type_line(pilot, serial)
        await press(pilot, "f6")
        await type_line(pilot, "APA-12")
        await open_row(pilot, "capacitance")
        for line in ("4.97", "9.81"):
            await type_line(pilot, line)
        await press(pilot, "f5")
        await type_line(pilot, "flexure cracked, seen under the lens")
        await press(pilot, "y")  # it replaces what is selected
        await press(pilot, "enter", "enter", "enter")
        await press(pilot, "escape", "escape")
        keep(pilot, out / "workflow-units.png")
    bench.close()


def strut(folder: Path) -> Path:
    model = open_model("strut").with_values({"misalignment.dy_um": 150.0})
    for name, content in simulate(UnitRequest("ST-07", "strut", model, seed=7)).files.items():
        write_atomic(folder / "ST-07" / name, content)
    return folder / "ST-07"


async def explaining(out: Path, folder: Path) -> None:
    """Responses, the misalignment that they tell, and what the model lacks."""
    bench = open_bench("strut", folder=strut(folder))
    async with running(lambda: bench, SIZE, Given("Ann")) as pilot:
        await to_steps(pilot)
        await open_row(pilot, "frf")
        await press(pilot, "f7")
        keep(pilot, out / "workflow-responses.png")
        await press(pilot, "escape", "escape")
        await open_row(pilot, "misalignment")
        keep(pilot, out / "workflow-misalignment.png")
        await press(pilot, "escape")
        await open_row(pilot, "gap")
        print(words(pilot, "#answer"))
        await press(pilot, "f7")
        keep(pilot, out / "workflow-gap.png")
        await press(pilot, "escape", "escape")
        keep(pilot, out / "workflow-steps.png")
    bench.close()


BENCH = """
name = "bench"
stage = "{0}"
[recorders.recorder]
driver = "simulated"
measures = ["spurious_modes"]
model = "simulated recorder"
serial = "SIM-DAQ"
settings = {{ kind = "apa", seed = 3, stage = "{0}", bouncing = [2], pace = 0.3 }}
[recorders.recorder.channels]
Track1 = {{ physical = "Track1", unit = "N" }}
Track2 = {{ physical = "Track2", unit = "rad" }}
"""


async def hitting(out: Path, folder: Path) -> None:
    """A hammer test while it is recorded."""
    folder.mkdir()
    (folder / "bench.toml").write_text(BENCH.format(folder / "stage.json"))
    bench = open_bench("apa", bench_file=folder / "bench.toml")
    async with running(lambda: bench, SIZE, Given("Ann")) as pilot:
        await to_steps(pilot, "APA-11")
        await open_row(pilot, "spurious_modes")
        await pilot.press("f3")
        while not any("6 good" in str(marks.render()) for marks in pilot.app.screen.query("#marks").results(Static)):
            if isinstance(pilot.app.screen, Question):
                await pilot.press("enter")
            await asyncio.sleep(0.05)
        keep(pilot, out / "workflow-hits.png")
        await pilot.press("escape")
    bench.close()


def main() -> None:
    out, wanted = Path(sys.argv[1]), sys.argv[2:]
    for scene in (measuring, tray, explaining, hitting):
        if wanted and scene.__name__ not in wanted:
            continue
        with tempfile.TemporaryDirectory() as home:
            os.environ |= {"ACCEPT_HOME": home, "COLORTERM": "truecolor"}
            more = (Path(home) / "records",) if scene in (explaining, hitting) else ()
            asyncio.run(scene(out, *more))


if __name__ == "__main__":
    main()
