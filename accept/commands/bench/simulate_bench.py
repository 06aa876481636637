"""`accept simulate bench`."""

import json
import signal
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
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
from accept.simulate.unit_request import SHORT_S, UnitRequestError
from hw.simulated import FaultKind, LineFault, Server, SimulatedBench
from specs.bench import SIMULATED

BYTE_S = 0.0002  # about 38400 baud
NAMES = ("gauge", "lcr", "probe")
AT = 4  # bytes of a reply before it is cut


@dataclass(frozen=True)
class InjectedFault:
    """A fault of an instrument, or the instrument that it is exchanged with."""

    name: str
    kind: FaultKind
    after: int = 0
    other: str = ""

    @classmethod
    def of(cls, words: str) -> "InjectedFault":
        """Parse `gauge:menu_open`, `lcr:half_line:3` (after three replies), `gauge:swapped:probe`. Raises
        UnitRequestError."""
        name, _, rest = words.partition(":")
        kind, _, more = rest.partition(":")
        kinds = [k.value for k in FaultKind]
        if name not in NAMES or kind not in kinds:
            raise UnitRequestError(
                f"--fault {words}: expected INSTRUMENT:FAULT with one of {', '.join(NAMES)} and of {', '.join(kinds)}"
            )
        if kind == FaultKind.SWAPPED:
            if more not in NAMES or more == name:
                raise UnitRequestError(f"--fault {words}: expected what it is exchanged with, as in gauge:swapped:lcr")
            return cls(name, FaultKind.SWAPPED, other=more)
        if more and not more.isdecimal():
            raise UnitRequestError(f"--fault {words}: '{more}' is not a number of replies before the fault")
        return cls(name, FaultKind(kind), int(more or 0))

    def strike(self, servers: Mapping[str, Server]) -> None:
        if self.kind is FaultKind.SWAPPED:
            servers[self.name].swap_with(servers[self.other])
        else:
            servers[self.name].inject(LineFault(self.kind, after=self.after, at=AT))


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
        struck = [InjectedFault.of(words) for words in fault or ()]
    except UnitRequestError as e:
        return refusal(e)
    world = world_of(unit)
    with (
        _stopped_by_signal() as stop,
        tempfile.TemporaryDirectory(prefix="accept-bench-") as temporary,
        SimulatedBench(world, out or Path(temporary), seed=seed, byte_s=BYTE_S) as bench,
    ):
        if recorder:
            with bench.bench_file.open("a", encoding="utf-8") as file:
                file.write(recorder_entry(unit, bench.stage.path, seed))
        for each in struck:
            each.strike(bench.servers)
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
