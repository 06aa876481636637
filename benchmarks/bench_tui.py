"""How quick the workflow is: until its first screen in a real terminal, what a key and a live value cost on each kind
of screen, and a key's answer while an FRF is judged.

Run by hand: `python benchmarks/bench_tui.py`, with `costs` for what keys cost alone; prints numbers, with the load of
the machine. Processor seconds depend on it less than those of a clock.
"""

import asyncio
import gc
import os
import pty
import select
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

import numpy as np
from textual._compositor import CompositorUpdate
from textual.events import Key
from textual.pilot import Pilot
from textual.screen import Screen
from textual.widgets import Input

sys.path.insert(0, str(Path(__file__).parent.parent))
from accept.tui.app import BenchApp
from accept.tui.widgets.live_value import Followed, Gauge
from accept.tui.widgets.plot import PanelView
from accept.tui.widgets.step_list import StepList
from accept.workflow.dialogue.start_state import OWN
from accept.workflow.instruments.port import Look
from accept.workflow.training import open_training
from checks.declare import Measured
from specs.spec import Limit
from tests.accept.tui.tui_help import loader, press, running, type_line
from tests.accept.units.units import DATA
from tests.hw.instruments.fake_instrument import Fake

SIZE = (120, 36)
FIRST_WORDS = OWN["serial"].encode()
PATIENCE_S = 30.0


def first_paint_s() -> tuple[float, float]:
    """Return the time from the start of the process to the words of the first screen, and the processor's."""
    began = time.monotonic()
    pid, handle = pty.fork()
    if pid == 0:
        os.environ |= {"ACCEPT_HOME": tempfile.mkdtemp(), "TERM": "xterm-256color", "COLUMNS": "80", "LINES": "24"}
        os.execv(sys.executable, [sys.executable, "-m", "accept", "run"])
    shown, took = b"", 0.0
    try:
        while FIRST_WORDS not in shown:
            if not select.select([handle], [], [], PATIENCE_S)[0]:
                raise SystemExit(f"nothing came for {PATIENCE_S:g} s before the first screen; last: {shown[-300:]!r}")
            shown += os.read(handle, 65536)
        took = time.monotonic() - began
    finally:
        os.kill(pid, signal.SIGKILL)
        used = os.wait4(pid, 0)[2]
    return took, used.ru_utime + used.ru_stime


class _Silent(Fake):
    """An instrument that never answers: what is shown comes from elsewhere."""

    def __init__(self) -> None:
        super().__init__([0.0], hold=True)


class Sent:
    """What goes to the terminal, and the processor's time of the thread that draws at the last of it."""

    def __init__(self) -> None:
        self.bytes, self.at = 0, 0.0

    def display(self, app: BenchApp, _: Screen[Any], update: Any) -> None:
        """Take the place of `App._display`, which sends nothing in a test."""
        if isinstance(update, CompositorUpdate):
            self.bytes += len(update.render_segments(app.console).encode())
            self.at = time.thread_time()

    async def of_keys(self, pilot: Pilot[None], *keys: str) -> tuple[float, int]:
        """Return the processor's time [s] until the answer of a key stands there, and its bytes: the median of keys."""
        took = []
        for key in keys:
            self.bytes, began = 0, time.thread_time()
            self.at = began
            await press(pilot, key)
            took.append((self.at - began, self.bytes))
        return median(seconds for seconds, _ in took), round(median(count for _, count in took))


async def costs() -> None:
    """Print what a key costs on the first screen, at a live value, at a record beside its plot, and on the summary."""
    sent = Sent()
    os.environ["COLORTERM"] = "truecolor"
    gc.freeze()  # as `accept run` does when it is loaded
    with patch.object(BenchApp, "_display", lambda app, screen, update: sent.display(app, screen, update)):
        async with running(size=SIZE) as pilot:
            await press(pilot, "f6")
            for n in range(14):
                await type_line(pilot, f"APA-{n:02}")
            await press(pilot, "f6")
            await say(sent, pilot, "first screen, 14 units", "down", "up")
        async with running(lambda: open_training("apa", 1), SIZE) as pilot:
            while type(pilot.app.screen).__name__ == "StartScreen":
                await press(pilot, "enter")
            await say(sent, pilot, "steps", "down", "up")
            pilot.app.screen.query_one(StepList).stand_at("capacitance")
            await press(pilot, "enter", "f3", "up")
            await say(sent, pilot, "live value", "up", "down")
            await live(pilot)
            await press(pilot, "escape")
            pilot.app.screen.query_one(StepList).stand_at("stroke")
            await press(pilot, "enter")
            while not pilot.app.screen.dialogue.complete:
                await press(pilot, "enter")
            await press(pilot, "up")
            await say(sent, pilot, f"records, {len(pilot.app.screen.query(PanelView))} plots", "up", "down")
            await press(pilot, "f9")
            await say(sent, pilot, "summary", "down", "up")


async def say(sent: Sent, pilot: Pilot[None], where: str, *arrows: str) -> None:
    """Print what arrows and letters cost on the present screen."""
    name, before = type(pilot.app.screen).__name__, [(line, line.value) for line in pilot.app.screen.query(Input)]
    for what, keys in (("arrow", arrows * 6), ("letter", "123456" if name in ("StartScreen", "StepScreen") else "")):
        if keys:
            seconds, count = await sent.of_keys(pilot, *keys)
            print(f"{where:22} {what:7} {1e3 * seconds:5.1f} ms {count:6d} bytes")
    for line, value in before:
        line.value = value


async def live(pilot: Pilot[None], rate_Hz: float = 10.0, seconds: float = 3.0) -> None:
    """Print the share of a core that a live value takes: the instrument's own thread apart."""
    gauge, numbers = pilot.app.screen.query_one(Gauge), np.random.default_rng(1)
    about = Followed(
        "meter",
        "actuator stacks",
        "uF",
        Limit(lower=8.8, upper=11.0, unit="uF", rule="guarded", source="benchmark"),
        (9.8, 9.9),
    )
    gauge.follow(_Silent(), about, None)
    began = time.thread_time()
    for _ in range(round(rate_Hz * seconds)):
        gauge.show(Look(Measured(numbers.normal(9.85, 0.02), 0.02), ""))
        await asyncio.sleep(1.0 / rate_Hz)
    share = (time.thread_time() - began) / seconds
    print(f"live value at {rate_Hz:g} Hz {100 * share:.1f} % of a core")


async def key_answers_s(count: int = 30) -> list[float]:
    """Return the times from a key to its letter in the line, while the FRF of a strut is judged over and over."""
    async with running(loader("strut", DATA / "units" / "S-01")) as pilot:
        await type_line(pilot, "S-01")
        while type(pilot.app.screen).__name__ == "StartScreen":
            await press(pilot, "enter")  # kind, and what a strut is made of
        await press(pilot, "enter")
        for name in ("frf_noise.mat", "frf_noise_hf.mat"):
            await type_line(pilot, name)
        over, judge = threading.Event(), pilot.app.bench.services.computation(pilot.app.session).judge_step
        judging = threading.Thread(target=lambda: [judge("frf") for _ in iter(over.is_set, True)])
        judging.start()
        line, took = pilot.app.screen.query(Input).first(), []
        line.focus()
        for _ in range(count):
            before, began = line.value, time.monotonic()
            pilot.app.post_message(Key("7", "7"))
            while line.value == before:
                await asyncio.sleep(0.001)
            took.append(time.monotonic() - began)
        over.set()
        await asyncio.to_thread(judging.join)
        return sorted(took)


def addition_ns(count: int = 2_000_000) -> float:
    """Return the processor's time of one addition in Python [ns]: figures of a busy machine are compared by it."""
    began, total = time.thread_time(), 0
    for n in range(count):
        total += n
    return 1e9 * (time.thread_time() - began) / count


def main() -> None:
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, {addition_ns():.0f} ns an addition")
    with tempfile.TemporaryDirectory() as home:
        os.environ["ACCEPT_HOME"] = home
        asyncio.run(costs())
        if "costs" in sys.argv:
            return
        paints = [first_paint_s() for _ in range(3)]
        print("first screen [s], of the processor: " + ", ".join(f"{wall:.2f} ({cpu:.2f})" for wall, cpu in paints))
        if DATA.exists():
            took = asyncio.run(key_answers_s())
            print(f"key while judging [ms]: median {1e3 * took[len(took) // 2]:.0f}, worst {1e3 * took[-1]:.0f}")


if __name__ == "__main__":
    main()
