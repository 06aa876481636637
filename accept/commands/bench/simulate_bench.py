"""`accept simulate bench`."""

import signal
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from accept.base.console import clear_errors, say, tell
from accept.base.exit_codes import Exit
from accept.simulate.bench_truth import world_of
from accept.simulate.unit_request import UnitRequestError
from hw.simulated import FaultKind, LineFault, Server, SimulatedBench
from hw.simulated.server import swap

BYTE_S = 0.0002  # about 38400 baud
NAMES = ("gauge", "lcr", "probe")
AT = 4  # bytes of a reply before it is cut


@dataclass(frozen=True)
class Struck:
    """A fault of an instrument, or the instrument that it is exchanged with."""

    name: str
    kind: FaultKind
    after: int = 0
    other: str = ""

    @classmethod
    def of(cls, words: str) -> "Struck":
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
            swap(servers[self.name], servers[self.other])
        else:
            servers[self.name].inject(LineFault(self.kind, after=self.after, at=AT))


@clear_errors
def run(
    unit: Annotated[Path, typer.Option(help="Unit folder whose values the instruments measure.")],
    out: Annotated[Path | None, typer.Option(help="Folder for ports and bench.toml; else a temporary one.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the noise.")] = 0,
    seconds: Annotated[float | None, typer.Option(min=0.0, help="End by itself after so long [s].")] = None,
    fault: Annotated[
        list[str] | None, typer.Option(help="As gauge:menu_open, lcr:half_line:3 (replies later), gauge:swapped:probe.")
    ] = None,
) -> Exit:
    """Simulate instruments on pseudo-terminals. Prints the ports and a ready bench.toml, runs until stopped."""
    try:
        struck = [Struck.of(words) for words in fault or ()]
    except UnitRequestError as e:
        say(f"accept: {e}")
        return Exit.BAD_INPUT
    world = world_of(unit)
    with (
        _stopped_by_signal() as stop,
        tempfile.TemporaryDirectory(prefix="accept-bench-") as temporary,
        SimulatedBench(world, out or Path(temporary), seed=seed, byte_s=BYTE_S) as bench,
    ):
        for each in struck:
            each.strike(bench.servers)
        for name, server in bench.servers.items():
            tell(f"{name}  {server.path}")
        tell(f"bench  {bench.bench_file}")
        say(f"simulated bench of {world.serial}: accept hw test --bench {bench.bench_file}; stop with Ctrl-C")
        stop.wait(seconds)
    return Exit.ACCEPTED


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
