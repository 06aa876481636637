"""The real program in a real terminal of 80 x 24 (tmux), by keys alone: a whole APA on the simulated bench and a whole
strut in training, each from its serial to the verified certificate."""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from accept.exit import Exit

pytestmark = pytest.mark.skipif(shutil.which("tmux") is None, reason="needs tmux (Debian: apt install tmux)")

TIMEOUT_S = 120.0  # for one answer on a crowded machine: a certificate takes 3 s on a free one
ACCEPT = [sys.executable, "-m", "accept"]
FILES = {
    "Stroke": ("stroke_one_stack.mat", "stroke_two_stacks.mat"),
    "Axial stiffness": ("add_mass_closed_circuit.mat", "add_mass_open_circuit.mat"),
    "Hysteresis": ("hysteresis.mat",),
    "High-pass": ("sweep_lf_with_R.mat", "sweep_lf.mat"),
    "Spurious modes": ("bending_X_top.mat", "bending_Y_top.mat", "torsion_left.mat", "torsion_top.mat"),
}


class Terminal:
    """A program in tmux, seen as a person sees it."""

    def __init__(self, socket: Path, command: list[str], home: Path) -> None:
        self._tmux = ["tmux", "-S", str(socket), "-f", "/dev/null"]
        set_home = ["-e", f"ACCEPT_HOME={home}", "-e", "LANG=C.UTF-8"]
        shell = ["sh", "-c", '"$@"; echo exit code $?; read wait', "sh"]  # which stays to say how the program ended
        self._run("new-session", "-d", "-x", "80", "-y", "24", *set_home, "-s", "t", *shell, *command)

    def _run(self, *words: str) -> str:
        return subprocess.run([*self._tmux, *words], check=True, capture_output=True, text=True).stdout

    def screen(self) -> str:
        return self._run("capture-pane", "-p", "-t", "t")

    def wait_for(self, pattern: str) -> re.Match[str]:
        """Until the screen shows this."""
        deadline = time.monotonic() + TIMEOUT_S
        while not (found := re.search(pattern, self.screen())):
            assert time.monotonic() < deadline, f"{pattern!r} did not appear on\n{self.screen()}"
            time.sleep(0.05)  # tmux tells nobody when a screen has changed
        return found

    def ended(self) -> int:
        """The exit code, when the program has ended."""
        return int(self.wait_for(r"exit code (\d+)")[1])

    def press(self, *keys: str) -> None:
        self._run("send-keys", "-t", "t", *keys)

    def line(self, text: str) -> None:
        self._run("send-keys", "-t", "t", "-l", text)
        self.press("Enter")

    def close(self) -> None:
        subprocess.run([*self._tmux, "kill-server"], check=False, capture_output=True)


class Technician:
    """Works through the steps, and goes on only when the screen has acknowledged what was given."""

    def __init__(self, terminal: Terminal) -> None:
        self.at = terminal
        self.events = 0

    def step(self, title: str) -> None:
        self.at.wait_for(r"Enter opens a step")
        self.at.press("Enter")
        self.at.wait_for(rf"\d/\d .*{title}")

    def stored(self) -> None:
        """Until a higher event is acknowledged than any before."""
        while (number := int(self.at.wait_for(r"stored as event (\d+)")[1])) <= self.events:
            time.sleep(0.05)
        self.events = number

    def reads(self, count: int = 1) -> None:
        for _ in range(count):
            self.at.wait_for(r"live \w+")
            self.at.press("F3")
            self.stored()

    def types(self, *lines: str) -> None:
        for line in lines:
            self.at.line(line)
            self.stored()

    def back(self) -> None:
        self.at.press("Escape")

    def signs(self) -> None:
        self.at.wait_for("Enter opens a step")
        self.at.press("F9")
        self.at.wait_for("F2 signs this result")
        self.at.press("F2")
        self.at.wait_for("The same again")
        for line in ("correct horse", "correct horse", "battery staple"):
            self.at.line(line)


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[list[Terminal]]:
    terminals: list[Terminal] = []
    yield terminals
    for terminal in terminals:
        terminal.close()


@pytest.fixture
def simulated_bench(tmp_path: Path) -> Iterator[Path]:
    """A unit of seed 4 without a fault, and the instruments that measure it: the folder of both."""
    unit, bench = tmp_path / "unit", tmp_path / "bench"
    subprocess.run([*ACCEPT, "simulate", "unit", "--kind", "apa", "--seed", "4", "--out", unit], check=True)
    server = subprocess.Popen([*ACCEPT, "simulate", "bench", "--unit", unit, "--out", bench], stdout=subprocess.PIPE)
    deadline = time.monotonic() + TIMEOUT_S
    while not (bench / "bench.toml").exists():
        assert server.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    yield tmp_path
    server.terminate()
    server.wait()


def test_an_apa_from_its_serial_to_a_certificate_that_verifies(simulated_bench: Path, opened: list[Terminal]) -> None:
    home = simulated_bench / "home"
    bench, records = simulated_bench / "bench" / "bench.toml", simulated_bench / "unit"
    run = [*ACCEPT, "run", "--spec", "apa", "--bench", str(bench), "--records", str(records), "--operator", "Ann"]
    opened.append(terminal := Terminal(simulated_bench / "tmux", run, home))
    ann = Technician(terminal)
    terminal.wait_for("Enter goes from line to line")
    terminal.line("APA-77")
    terminal.wait_for("new unit APA-77")
    terminal.press("Enter")
    ann.step("Flatness")
    ann.reads(8)
    ann.back()
    ann.step("Capacitance")
    ann.reads(2)
    ann.back()
    for title, files in FILES.items():
        ann.step(title)
        if title in ("Stroke", "Axial stiffness"):
            terminal.press("F6")
            terminal.wait_for("giving: records")
        ann.types(*files)
        if title == "Axial stiffness":
            ann.types("6.4 kg")
        terminal.wait_for(f"/8 .*[✓✗~?].*{title[:8]}")
        ann.back()
    ann.step("Frequency responses")
    ann.types("frf_sweep.mat", "frf_noise_hf.mat")
    ann.back()
    ann.signs()
    terminal.wait_for("✓ verified")
    terminal.press("C-q")
    assert terminal.ended() == Exit.INCOMPLETE  # the simulated bench has no calibration certificates
    certificates = list(home.rglob("APA-77*.pdf"))
    assert len(certificates) == 1
    env = os.environ | {"ACCEPT_HOME": str(home)}
    said = subprocess.run([*ACCEPT, "verify", certificates[0]], env=env, capture_output=True, text=True)
    assert said.returncode == 0, said.stdout + said.stderr


def test_a_strut_in_training_up_to_what_was_hidden(tmp_path: Path, opened: list[Terminal]) -> None:
    run = [*ACCEPT, "run", "--training", "--spec", "strut", "--seed", "6", "--operator", "Ann"]
    opened.append(terminal := Terminal(tmp_path / "tmux", run, tmp_path / "home"))
    ann = Technician(terminal)
    terminal.wait_for(r"new unit TRAIN-[^$]*on the last one it begins")
    terminal.press("Enter", "Enter")  # serial and kind as proposed
    terminal.wait_for("Serial of its APA")
    for serial in ("APA-1", "JB-1", "JT-1", "ENC-1"):
        terminal.line(serial)
    ann.step("Frequency responses")
    ann.types("frf_noise.mat", "frf_noise_hf.mat")
    terminal.wait_for(r"/3 .*✗ fail")
    ann.back()
    terminal.wait_for("Misalignment .*: to be judged")
    terminal.press("Down")
    ann.step("Hysteresis")
    ann.types("hysteresis.mat")
    terminal.wait_for(r"/3 .*✓ pass")
    ann.back()
    ann.step("Misalignment")
    terminal.wait_for(r"/3 .*\? no result")
    ann.back()
    ann.signs()
    terminal.wait_for("Training: what this unit had")
    terminal.wait_for("8 kg on the bench")
    terminal.press("Escape")
    terminal.wait_for("✓ verified")
    terminal.press("C-q")
    assert terminal.ended() == Exit.REJECTED
