"""SIGKILL of the real program in a real terminal, at random moments: what the screen acknowledged is in the store, and
the workflow stands where it stood."""

import asyncio
import os
import pty
import random
import re
import select
import signal
import sys
import time
from pathlib import Path

import pytest
from textual.widgets import DataTable

from accept.store import open_store
from accept.workflow.state.unit_state import fold_run
from tests.accept.tui.tui_help import HEIGHTS, press, running, type_line
from tests.soak import SOAK

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are of Unix")

# (what the screen must show before, what is typed then)
SCRIPT = (
    ("Scan a serial", "APA-02\r"),
    ("Enter begins APA-02", "\r"),
    ("Enter: open the step", "\r"),
    ("Enter: save the field", f"{HEIGHTS}\r"),
    ("✓ pass", "\x1b"),
    ("Enter: open the step", "\r"),
    ("LCR", "4,99\r"),
    ("as entry", "9.85 uF\r"),
    ("✓ pass", "\x1b"),
    ("Enter: open the step", "\r"),
    ("gauge", "200\r"),
    ("✗ fail", "\x1a"),
    ("Undone ", "365.5\r"),
    ("✓ pass", "\x1b"),
)
TO_THE_END = 20  # a seed that is killed at the last line, so that every run reads the whole script
TIMEOUT_S = 60.0  # for one answer of a program on a crowded machine
ACKNOWLEDGED = re.compile(r"as entry (\d+)")


class Terminal:
    """The program on a pseudo-terminal of 80 x 24."""

    def __init__(self, home: Path) -> None:
        self.text = ""
        self.pid, self._handle = pty.fork()
        if self.pid == 0:
            os.environ |= {"ACCEPT_HOME": str(home), "TERM": "xterm-256color", "COLUMNS": "80", "LINES": "24"}
            os.execv(sys.executable, [sys.executable, "-m", "accept", "run", "--spec", "apa-basic"])

    def wait_for(self, words: str, after: int) -> None:
        """Until these words are written to the screen behind position `after`."""
        deadline = time.monotonic() + TIMEOUT_S
        while words not in self.text[after:]:
            left = deadline - time.monotonic()
            assert left > 0, f"{words!r} did not appear in {self.text[-3000:]!r}"
            self.look(min(left, 1.0))

    def look(self, seconds: float) -> None:
        ready, _, _ = select.select([self._handle], [], [], seconds)
        if ready:
            try:
                self.text += os.read(self._handle, 65536).decode("utf-8", "replace")
            except OSError:  # the program has ended
                return

    def type(self, keys: str) -> None:
        os.write(self._handle, keys.encode())

    def kill(self) -> None:
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        for _ in range(20):
            self.look(0.0)
        os.close(self._handle)


def killed_somewhere(home: Path, rng: random.Random) -> set[int]:
    """Run the script up to a random moment; returns the events that the screen acknowledged."""
    terminal = Terminal(home)
    try:
        last, seen = rng.randrange(2, len(SCRIPT)), 0
        for words, keys in SCRIPT[: last + 1]:
            terminal.wait_for(words, seen)
            seen = len(terminal.text)
            terminal.type(keys)
        until = time.monotonic() + rng.uniform(0.0, 0.4)  # what the last line sets off takes about as long
        while (left := until - time.monotonic()) > 0:
            terminal.look(left)
    finally:
        terminal.kill()
    return {int(number) for number in ACKNOWLEDGED.findall(terminal.text)}


async def stands_at() -> str | None:
    """The step at which a restarted workflow stands."""
    async with running() as pilot:
        await type_line(pilot, "APA-02")
        await press(pilot, *(["enter"] if type(pilot.app.screen).__name__ == "StartScreen" else []))
        table = pilot.app.screen.query_one(DataTable)
        expected = pilot.app.session.judgements.next_step()
        here = pilot.app.session.steps[table.cursor_row].name
        assert expected is None or here == expected.name
        return here


@pytest.mark.parametrize("seed", range(200) if SOAK else [TO_THE_END])
@pytest.mark.slow
async def test_nothing_acknowledged_is_lost(seed: int, bench_home: Path):
    acknowledged = await asyncio.to_thread(killed_somewhere, bench_home, random.Random(seed))
    with open_store() as store:
        assert store.check() is None
        events = list(store.events("APA-02"))
    assert acknowledged <= {event.seq for event in events}
    before = fold_run("APA-02", events)
    await stands_at()
    with open_store() as store:
        after = fold_run("APA-02", store.events("APA-02"))
    if before.attempt is not None:
        taken = {name: state.entries for name, state in before.attempt.steps.items() if state.entries}
        assert {name: s.entries for name, s in after.attempt.steps.items() if s.entries} == taken
