"""The bar is drawn on a terminal and nowhere else: stdout in a pipe stays data, stderr in a file stays lines."""

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import sys
from accept.base.console import say, tell
from accept.base.progress import busy, steps

with busy("learning"):
    for k in steps(range(3), "units judged"):
        say(f"[{k}] judged")
        tell(f"row {k}")
for outcome in steps(iter("ab"), "units on a cluster", 2):
    break  # an iteration that ends early ends its bar
say("after")
"""


def on_terminal(program: str, stdout: int | None, **environment: str) -> tuple[str, str]:
    """What a terminal shows of stderr, and what a pipe gets of stdout; None: that is the terminal too."""
    ours, theirs = pty.openpty()
    known = os.environ | {"TERM": "xterm-256color", "COLUMNS": "80"} | environment
    done = subprocess.Popen(
        [sys.executable, "-c", program], stderr=theirs, stdout=theirs if stdout is None else stdout, env=known
    )
    os.close(theirs)
    seen = b""
    try:
        while part := os.read(ours, 65536):
            seen += part
    except OSError:  # Linux says so when the other end is closed
        pass
    assert done.wait() == 0
    if done.stdout is None:
        return seen.decode(), ""
    with done.stdout:
        return seen.decode(), done.stdout.read().decode()


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals")
def test_bars_stand_on_the_terminal_and_what_is_said_above_them() -> None:
    shown, piped = on_terminal(PROGRAM, subprocess.PIPE)
    assert "units judged" in shown
    assert "/3" in shown
    assert "learning" in shown
    assert "\x1b[?25h" in shown  # the cursor is back
    assert piped == "row 0\nrow 1\nrow 2\n"
    assert [w for w in ("[0] judged", "[1] judged", "[2] judged", "after") if w not in shown] == []
    both, _ = on_terminal(PROGRAM, None)
    assert "row 2" in both
    assert "units judged" in both


def test_no_bar_in_pipes_on_dumb_terminals_and_in_workers() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    assert done.stderr == "[0] judged\n[1] judged\n[2] judged\nafter\n"
    assert done.stdout == "row 0\nrow 1\nrow 2\n"
    if sys.platform != "win32":
        shown, _ = on_terminal(PROGRAM, subprocess.PIPE, TERM="dumb")
        assert "units judged" not in shown
        worker = (
            "import multiprocessing as m\n"
            f"p = m.get_context('fork').Process(target=exec, args=({PROGRAM!r},))\n"
            "p.start(); p.join()"
        )
        shown, _ = on_terminal(worker, subprocess.PIPE)
        assert "[2] judged" in shown
        assert "units judged" not in shown


def test_every_long_command_has_a_bar() -> None:
    """Of the source: where each of them waits."""
    root = Path(__file__).parents[3] / "accept"
    places = (
        "batch/judge_batch", "commands/physics/gap", "commands/physics/misalign", "commands/physics/model_fit",
        "commands/fleet/model_learn", "models/lookup_cache", "fleet/judged_again", "commands/fleet/site",
        "commands/units/compare", "commands/units/report", "commands/units/demo", "commands/trust/verify",
        "commands/bench/simulate",
    )  # fmt: skip
    without = [p for p in places if "accept.base.progress import" not in (root / f"{p}.py").read_text(encoding="utf-8")]
    assert without == []
