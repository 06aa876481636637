"""`accept simulate bench`."""

import signal
import tempfile
import threading
from pathlib import Path
from types import FrameType

from accept.commands.talk import clear_errors, say
from accept.exit import Exit
from accept.world import world_of
from hw.simulated import SimulatedBench

BYTE_S = 0.0005  # about 19200 baud


@clear_errors
def run(unit: Path, out: Path | None, seed: int, seconds: float | None) -> Exit:
    """Run simulated instruments that measure a unit, until stopped or for `seconds`; prints the ports."""
    world = world_of(unit)
    stop = threading.Event()
    _stop_on_signal(stop)
    with (
        tempfile.TemporaryDirectory(prefix="accept-bench-") as temporary,
        SimulatedBench(world, out or Path(temporary), seed=seed, byte_s=BYTE_S) as bench,
    ):
        for name, server in bench.servers.items():
            print(f"{name}  {server.path}")
        print(f"bench  {bench.bench_file}", flush=True)
        say(f"simulated bench of {world.serial}: accept hw test --bench {bench.bench_file}; stop with Ctrl-C")
        stop.wait(seconds)
    return Exit.ACCEPTED


def _stop_on_signal(stop: threading.Event) -> None:
    """End in good order, so that no link to a dead port stays; only a program's main thread may ask for signals."""

    def handler(number: int, frame: FrameType | None) -> None:
        stop.set()

    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, handler)
