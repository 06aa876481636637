"""`accept simulate bench`."""

import json
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from types import FrameType
from typing import Annotated

import tomlkit
from typer import Option

from accept import units
from accept.base.console import say, tell
from accept.commands.answer import Answer, command, refusal
from accept.simulate.bench_truth import world_of
from accept.simulate.recorder import INPUTS, MODEL, SERIAL
from accept.simulate.unit import TRUTH_FILE
from accept.simulate.unit_request import SHORT_S
from hw.errors import SettingsError
from hw.simulated import BenchFault, SimulatedBench
from specs.bench import SIMULATED

BYTE_S = 0.0002  # about 38400 baud


@command
def run(
    unit: Annotated[Path, Option(help="Unit folder whose values the instruments measure.")],
    out: Annotated[Path | None, Option(help="Folder for ports and bench.toml; else a temporary one.")] = None,
    seed: Annotated[int, Option(min=0, help="Of the noise.")] = 0,
    seconds: Annotated[float | None, Option(min=0.0, help="End by itself after so long [s].")] = None,
    recorder: Annotated[
        bool, Option("--recorder", help="Also a recorder, which plays a simulated unit of the same kind.")
    ] = False,
    fault: Annotated[
        list[str] | None, Option(help="As gauge:menu_open, lcr:half_line:3 (replies later), gauge:swapped:probe.")
    ] = None,
) -> Answer:
    """Simulate instruments on pseudo-terminals. Prints the ports and a ready bench.toml, runs until stopped."""
    try:
        faults = [BenchFault.of(words) for words in fault or ()]
    except SettingsError as e:
        return refusal(f"--fault {e}")
    world = world_of(unit)
    with (
        _stopped_by_signal() as stop,
        tempfile.TemporaryDirectory(prefix="accept-bench-") as temporary,
        SimulatedBench(world, out or Path(temporary), seed=seed, byte_s=BYTE_S) as bench,
    ):
        if recorder:
            with bench.bench_file.open("a", encoding="utf-8") as file:
                file.write(recorder_entry(unit, bench.stage.path, seed))
        bench.strike(faults)
        for name, server in bench.servers.items():
            tell(f"{name}  {server.path}")
        tell(f"bench  {bench.bench_file}")
        say(f"simulated bench of {world.serial}: accept hw test --bench {bench.bench_file}; stop with Ctrl-C")
        stop.wait(seconds)
    return Answer()


def recorder_entry(unit: Path, stage: Path, seed: int, pace: float = 1.0) -> str:
    """Return the simulated recorder's part of a bench file. The unit that it plays is of the same kind, and of the seed
    that its truth names, if that is at hand."""
    kind, truth = units.read(unit).kind, unit / TRUTH_FILE
    if truth.exists():
        seed = int(json.loads(truth.read_text(encoding="utf-8"))["seed"])
    settings = {"kind": kind, "seed": seed, "stage": str(stage), "pace": pace, "bouncing": [2]}
    entry = {
        "driver": SIMULATED,
        "measures": ["frf", "hysteresis"] + (["stroke", "spurious_modes"] if kind == "apa" else []),
        "model": MODEL,
        "serial": SERIAL,
        "response_s": SHORT_S,
        "settings": settings,
        "calibration": {"certificate": "SIM-5", "due": date(2099, 12, 31)},
        "drive": {"physical": "out"},
        "channels": {name: {"physical": name, "unit": unit} for name, unit in INPUTS.items()},
    }
    return "\n" + tomlkit.dumps({"recorders": {"recorder": entry}})


@contextmanager
def _stopped_by_signal() -> Iterator[threading.Event]:
    """Yield an event that Ctrl-C or a request to end sets, so that no link to a dead port stays; then put the handlers
    back. Only a program's main thread may ask for signals."""
    stop = threading.Event()

    def handler(*_: int | FrameType | None) -> None:
        stop.set()

    mine = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)} if mine else {}
    try:
        yield stop
    finally:
        for number, old in before.items():
            signal.signal(number, old)
