"""`accept simulate bench`."""

import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from accept.commands.talk import clear_errors, say
from accept.exit import Exit
from accept.world import world_of
from hw.simulated import SimulatedBench

BYTE_S = 0.0002  # about 38400 baud


@clear_errors
def run(unit: Path, out: Path | None, seed: int, seconds: float | None) -> Exit:
    """Run simulated instruments that measure a unit, until stopped or for `seconds`; prints the ports."""
    world = world_of(unit)
    with (
        _stopped_by_signal() as stop,
        tempfile.TemporaryDirectory(prefix="accept-bench-") as temporary,
        SimulatedBench(world, out or Path(temporary), seed=seed, byte_s=BYTE_S) as bench,
    ):
        for name, server in bench.servers.items():
            print(f"{name}  {server.path}")
        print(f"bench  {bench.bench_file}", flush=True)
        say(f"simulated bench of {world.serial}: accept hw test --bench {bench.bench_file}; stop with Ctrl-C")
        stop.wait(seconds)
    return Exit.ACCEPTED


@contextmanager
def _stopped_by_signal() -> Iterator[threading.Event]:
    """Set by Ctrl-C or a request to end, so that no link to a dead port stays; the handlers before come back after.
    Only a program's main thread may ask for signals."""
    stop = threading.Event()

    def handler(number: int, frame: FrameType | None) -> None:
        stop.set()

    mine = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)} if mine else {}
    try:
        yield stop
    finally:
        for number, old in before.items():
            signal.signal(number, old)
