"""Ctrl-C: exit 130, no traceback, what is finished is kept, and the same command goes on."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.base.exit_codes import Exit
from accept.cli.main import app
from accept.simulate.published_units import write_units
from tests.accept.tui.terminal_programs.terminal import TIMEOUT_S
from tests.conftest import DATA

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are of Unix")


def heard() -> None:
    """In the child: a test run in the background ignores Ctrl-C, and what it starts would inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.slow
def test_a_batch_that_is_stopped_keeps_what_is_finished_and_goes_on(tmp_path: Path) -> None:
    units, out = tmp_path / "units", tmp_path / "out"
    for unit in write_units(units)[4:]:
        shutil.rmtree(unit)
    command = [sys.executable, "-m", "accept", "batch", str(units), "--out", str(out), "--workers", "2"]
    run = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
        preexec_fn=heard,
    )
    # A unit is finished when it is said to be: its certificate lies there a moment before the store knows of it.
    finished = next(m for line in run.stderr if (m := re.match(r"\[1/4\] (\S+): ", line))).group(1)
    os.killpg(run.pid, signal.SIGINT)  # as a terminal does: to everything that runs in it
    said = run.communicate(timeout=TIMEOUT_S)[1]
    if run.returncode == Exit.REJECTED:
        pytest.skip("it had finished before the signal came")
    assert run.returncode == Exit.STOPPED, said
    assert "Traceback" not in said
    assert "run the command again to continue" in said
    kept = (certificate := out / "certificates" / f"{finished}.pdf").read_bytes()
    again = CliRunner().invoke(app, [*command[3:-1], "1"])
    assert again.exit_code == Exit.REJECTED, again.stderr  # one of the published units has a dead stack
    assert len(json.loads((out / "results.json").read_text())["units"]) == 4
    assert certificate.read_bytes() == kept


def stopped(first: str, *command: str) -> str:
    """What the program says on stderr when it is stopped as soon as a line of it begins with `first`."""
    run = subprocess.Popen(
        [sys.executable, "-m", "accept", *command],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
        preexec_fn=heard,
    )
    next(line for line in run.stderr if line.startswith(first))
    os.killpg(run.pid, signal.SIGINT)
    said = run.communicate(timeout=TIMEOUT_S)[1]
    assert run.returncode == Exit.STOPPED, said
    assert "Traceback" not in said
    return said


IN_RESET = """
import sys
from sqlalchemy import event
from sqlalchemy.pool import Pool
from accept.cli.main import main

def interrupt(*_):
    raise KeyboardInterrupt

event.listen(Pool, "reset", interrupt)
sys.argv = ["accept", "list"]
main()
"""


def test_a_signal_while_a_connection_is_given_back_shows_no_traceback() -> None:
    """SQLAlchemy logs what comes between, and a program without logging would print that on stderr."""
    run = subprocess.run([sys.executable, "-c", IN_RESET], capture_output=True, text=True, timeout=TIMEOUT_S)
    assert run.returncode == Exit.STOPPED, run.stderr
    assert run.stderr.splitlines() == [
        "accept: stopped; what is finished is kept; run the command again to continue"
    ], run.stderr


@pytest.mark.slow
@pytest.mark.needs_data
def test_a_gap_analysis_that_is_stopped_leaves_nothing(tmp_path: Path) -> None:
    said = stopped("S-05: calibrating", "gap", str(DATA / "units" / "S-05"), "--out", str(tmp_path / "out"))
    assert said.splitlines()[-1].startswith("accept: stopped; ")
    assert not [path for path in (tmp_path / "out").rglob("*") if path.is_file()]


@pytest.mark.slow
def test_a_table_that_is_stopped_has_only_whole_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path))
    said = stopped("strut:", "lookup", "build", "--model", "strut", "--nx", "25", "--ny", "25", "--workers", "1")
    assert said.splitlines()[-1].startswith("accept: stopped; ")
    kept = [path for path in tmp_path.rglob("*") if path.is_file() and path.suffix != ".log"]
    for row in kept:
        assert row.suffix == ".npz"  # no file that is half written, no table that lacks rows
        with np.load(row) as whole:
            assert all(np.isfinite(whole[name]).all() for name in whole.files if whole[name].dtype.kind in "fc")
