"""From the hammer to the certificate in a real terminal, without touching a file: at the simulated bench, and with an
audio interface whose driver is a loop."""

import re
import sqlite3
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from accept.base.exit_codes import Exit
from tests.accept.tui.terminal_programs.terminal import ACCEPT, Technician, Terminal

pytestmark = [pytest.mark.terminal, pytest.mark.slow]
DRIVERS = Path(__file__).parents[3] / "hw" / "recorders" / "drivers"
# Torsion of the loop is at 803 Hz, that of the finite elements at 1909 Hz.
SPEC = """
name = "hammer"
kind = "apa"
title = "APA, spurious modes alone"
[checks.spurious_modes.limits]
x_bending_Hz = { lower = 250.0, upper = 300.0, unit = "Hz", rule = "guarded", source = "house rule" }
y_bending_Hz = { lower = 370.0, upper = 440.0, unit = "Hz", rule = "guarded", source = "house rule" }
z_torsion_Hz = { lower = 700.0, upper = 2000.0, unit = "Hz", rule = "guarded", source = "house rule" }
"""
AUDIO = """
name = "bench"
[recorders.audio]
driver = "sounddevice"
measures = ["spurious_modes"]
model = "Interface 2i2"
serial = "7"
rate_Hz = 48000.0
settings = { device = "Interface" }
calibration = { certificate = "C-1", due = 2099-12-31 }
[recorders.audio.channels]
Track1 = { physical = "1", unit = "N", gain = 250.0 }
Track2 = { physical = "2", unit = "rad", gain = 80000.0, integrations = 2 }
"""
SIMULATED = """
name = "bench"
stage = "{stage}"
[recorders.recorder]
driver = "simulated"
measures = ["spurious_modes"]
model = "simulated recorder"
serial = "SIM-DAQ"
settings = {{ kind = "apa", seed = 3, stage = "{stage}", bouncing = [2], pace = 0.05 }}
calibration = {{ certificate = "C-1", due = 2099-12-31 }}
[recorders.recorder.channels]
Track1 = {{ physical = "Track1", unit = "N" }}
Track2 = {{ physical = "Track2", unit = "rad" }}
"""


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[list[Terminal]]:
    terminals: list[Terminal] = []
    yield terminals
    for terminal in terminals:
        terminal.close()


def hits_of_the_last_place(home: Path) -> tuple[int, int]:
    """Good hits, and all: told while the hammer is in the hand, and kept with the record."""
    (path,) = home.glob("*.sqlite")
    with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as store:
        kept = "".join(str(row) for row in store.execute("SELECT * FROM events"))
    good, hits = re.findall(r"(\d+) of (\d+) hits good", kept)[-1]
    return int(good), int(hits)


@pytest.mark.parametrize("bench", ["simulated", "audio"])
def test_from_the_hammer_to_the_certificate(tmp_path: Path, opened: list[Terminal], bench: str) -> None:
    home, spec, file = tmp_path / "home", tmp_path / "hammer.toml", tmp_path / "bench.toml"
    spec.write_text(SPEC)
    file.write_text(AUDIO if bench == "audio" else SIMULATED.format(stage=tmp_path / "stage.json"))
    loop = ["env", f"PYTHONPATH={DRIVERS}", "LOOP_SPEED=6"]
    run = [*loop, *ACCEPT, "run", "--spec", str(spec), "--bench", str(file), "--operator", "Ann"]
    opened.append(terminal := Terminal(tmp_path / "tmux", run, home))
    ann = Technician(terminal)
    terminal.wait_for("Scan a serial")
    terminal.line("APA-61")
    terminal.wait_for("Enter begins APA-61")
    terminal.press("Enter")
    ann.step("Spurious modes")
    terminal.press("F3")
    if bench == "audio":  # a person puts the hammer into place: once for each record
        for place in ("x-bending", "y-bending", "hit at the left", "hit at the top"):
            terminal.wait_for(rf"{place}: take the hammer")
            terminal.press("Enter")
    terminal.wait_for("takes back the last entry")
    good, hits = hits_of_the_last_place(home)
    assert good >= 10
    assert hits > good  # the third one bounced, and the end of the record may cut one
    terminal.wait_for(r"✓.*Bending in x|Bending in x.*✓|pass")
    ann.back()
    ann.signs()
    terminal.wait_for("✓ verified" if bench == "audio" else "◐ signed, not fully verified")
    terminal.press("C-q")
    assert terminal.ended() == Exit.ACCEPTED
    (certificate,) = home.rglob("*.pdf")
    env = {"ACCEPT_HOME": str(home), "PATH": "/usr/bin:/bin"}
    (unit,) = home.glob("units/APA-61/*/unit.toml")
    verify = [*ACCEPT, "verify", str(certificate), "--records", str(unit.parent)]
    verified = subprocess.run(verify, env=env, capture_output=True, text=True)
    assert verified.returncode == (0 if bench == "audio" else 4), verified.stdout + verified.stderr
    assert ("SIMULATED" in verified.stdout) == (bench == "simulated")
