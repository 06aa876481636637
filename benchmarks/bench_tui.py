"""How quick the workflow is: until its first screen in a real terminal, and a key's answer while an FRF is judged.

Run by hand: `python benchmarks/bench_tui.py`; prints numbers, with the load of the machine, which they depend on.
"""

import asyncio
import os
import pty
import select
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

from textual.events import Key
from textual.widgets import Input

sys.path.insert(0, str(Path(__file__).parent.parent))
from accept.workflow.dialogue.start import labels
from tests.accept.tui.tui_help import loader, press, running, type_line
from tests.accept.units.units import DATA

FIRST_WORDS = labels()["serial"].encode()
PATIENCE_S = 30.0


def first_paint_s() -> float:
    """From the start of the process to the words of the first screen."""
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
        os.waitpid(pid, 0)
    return took


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


def main() -> None:
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print("first paint [s]: " + ", ".join(f"{first_paint_s():.2f}" for _ in range(3)))
    if DATA.exists():
        with tempfile.TemporaryDirectory() as home:
            os.environ["ACCEPT_HOME"] = home
            took = asyncio.run(key_answers_s())
        print(f"key while judging [ms]: median {1e3 * took[len(took) // 2]:.0f}, worst {1e3 * took[-1]:.0f}")


if __name__ == "__main__":
    main()
