"""The real program in a real terminal (tmux) of 80 x 24 and of 140 x 40, by keys alone: a whole APA on the simulated
bench and a whole strut in training, each from its serial to the verified certificate."""

import os
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from accept.base.exit_codes import Exit
from accept.store import open_store
from specs.bench import load_bench
from tests.accept.tui.terminal_programs.terminal import ACCEPT, FILES, Technician, Terminal, bench_for_seed
from tests.soak import SOAK

pytestmark = pytest.mark.terminal
SIZES = pytest.mark.parametrize(
    "size", [(80, 24), pytest.param((140, 40), marks=pytest.mark.soak)], ids=("80x24", "140x40")
)


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[list[Terminal]]:
    terminals: list[Terminal] = []
    yield terminals
    for terminal in terminals:
        terminal.close()


@pytest.fixture(params=["peers", pytest.param("simulated", marks=pytest.mark.soak)])
def measuring_bench(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[tuple[Path, Path]]:
    """Instruments that answer as their documents print, by the documentation's bench file; or the program's own."""
    with bench_for_seed(tmp_path, 4, peers=request.param == "peers") as made:
        yield made


def capacitances(unit: Path) -> list[float]:
    """[uF] of sensor and actuator stacks, as a unit's file has them."""
    stated = tomllib.loads(unit.read_text())["capacitance"]
    return [float(v["value"] if isinstance(v, dict) else v) for v in (stated["sensor_uF"], stated["actuator_uF"])]


@SIZES
@pytest.mark.slow
def test_an_apa_from_its_serial_to_a_certificate_that_verifies(
    measuring_bench: tuple[Path, Path], tmp_path: Path, opened: list[Terminal], size: tuple[int, int]
) -> None:
    """By simulated instruments it is signed, and said to be simulated."""
    home, (records, bench) = tmp_path / "home", measuring_bench
    run = [*ACCEPT, "run", "--spec", "apa", "--bench", str(bench), "--records", str(records), "--operator", "Ann"]
    opened.append(terminal := Terminal(tmp_path / "tmux", run, home, size))
    ann = Technician(terminal)
    terminal.wait_for("Scan a serial")
    terminal.line("APA-77")
    terminal.wait_for("Enter begins APA-77")
    terminal.press("Enter")
    ann.step("Flatness")
    ann.reads(8)
    ann.back()
    ann.step("Capacitance")
    ann.reads(2)
    ann.back()
    for title, files in FILES.items():
        ann.step(title)
        ann.types(*files)
        if title == "Axial stiffness":
            ann.types("6.4 kg")
        terminal.wait_for(rf"{title[:8]}.* [✓✗~?] [a-z ]+ · \d of \d")
        ann.back()
    ann.step("Frequency responses")
    ann.types("frf_sweep.mat", "frf_noise_hf.mat")
    ann.back()
    ann.signs(why="not all instruments are calibrated")
    terminal.wait_for("◐ signed" if load_bench(bench).simulated else "✓ verified")
    terminal.press("C-q")
    assert terminal.ended() == Exit.INCOMPLETE  # neither bench has calibration certificates for all checks
    (measured,) = home.glob("units/APA-77/*/unit.toml")
    assert capacitances(measured) == pytest.approx(capacitances(records / "unit.toml"), rel=1e-3)  # four digits shown
    certificates = list(home.rglob("APA-77*.pdf"))
    assert len(certificates) == 1
    env = os.environ | {"ACCEPT_HOME": str(home)}
    said = subprocess.run([*ACCEPT, "verify", certificates[0]], env=env, capture_output=True, text=True)
    assert said.returncode == (4 if load_bench(bench).simulated else 0), said.stdout + said.stderr


@SIZES
@pytest.mark.slow
def test_a_strut_in_training_up_to_what_was_hidden(
    tmp_path: Path, opened: list[Terminal], size: tuple[int, int]
) -> None:
    spec = "strut" if SOAK else "strut-basic"  # what the model says of a strut is shown without a terminal, too
    run = [*ACCEPT, "run", "--training", "--spec", spec, "--seed", "6", "--operator", "Ann"]
    opened.append(terminal := Terminal(tmp_path / "tmux", run, tmp_path / "home", size))
    ann = Technician(terminal)
    terminal.wait_for("TRAIN-.* is a new unit")
    terminal.press("Enter")  # the serial as proposed; there is one kind
    terminal.wait_for("Serial number of the APA")
    for serial in ("APA-1", "JB-1", "JT-1", "ENC-1"):
        terminal.line(serial)
    ann.step("Frequency responses")
    ann.types("frf_noise.mat", "frf_noise_hf.mat")
    terminal.wait_for("Frequency responses +✗ fail")
    ann.back()
    if SOAK:
        terminal.wait_for("Enter: open the step")  # the list has the keys
        terminal.wait_for("Not compared yet")
        terminal.press("Down")
        terminal.wait_for("Hysteresis.* · not done")
    ann.step("Hysteresis")
    ann.types("hysteresis.mat")
    terminal.wait_for("Hysteresis.* ✓ pass")
    ann.back()
    if SOAK:
        ann.step("Misalignment")
        terminal.wait_for(r"Misalignment.* \? no result")
        ann.back()
    ann.signs(training=True, why="wrong payload, not put right")
    terminal.wait_for("Training: what is wrong with this unit")
    number = terminal.wait_for(r"(\d)  8 kg on the bench")[1]
    terminal.press(number)
    terminal.wait_for("Right! 1 of 1 guessed right")
    terminal.press("Escape")
    terminal.wait_for("✓ verified")
    terminal.press("C-q")
    assert terminal.ended() == Exit.REJECTED


@pytest.mark.slow
def test_a_burst_of_keys_from_the_first_screen_through_two_steps_loses_none(
    tmp_path: Path, opened: list[Terminal], monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the bench is still opening: a tray of one unit, its serial, and what two of its steps ask for."""
    heights = [0.0, -4.0, -13.0, -7.0, -2.0, 1.0, -9.0, -21.0]
    home = tmp_path / "home"
    opened.append(terminal := Terminal(tmp_path / "tmux", [*ACCEPT, "run", "--operator", "Ann"], home))
    terminal.wait_for("Kind")
    typed = " ".join(f"{height:g}" for height in heights)
    keys = ["F2", "F6", *"APA-01", "Enter", "F6", *"APA-01", "Enter", "Enter", "Enter"]
    keys += [*("Space" if letter == " " else letter for letter in typed), "Enter", "Enter"]
    terminal.press(*keys, *"4.99", "Enter", *"9.78", "Enter", "C-q")
    assert terminal.ended() in set(Exit)
    monkeypatch.setenv("ACCEPT_HOME", str(home))
    with open_store() as store:
        taken = [(e.data["step"], e.data["value"]) for e in store.events("APA-01", "value_taken")]
    assert taken == [*(("flatness", height) for height in heights), ("capacitance", 4.99), ("capacitance", 9.78)]
