"""The real program in tmux, in a terminal of 80 x 24 or another size, driven by keys and seen as a person sees it."""

import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

_NUMBERS = count()  # of the terminals of this process
TIMEOUT_S = 300.0  # for one answer on a crowded machine: a certificate takes 3 s on a free one
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

    def __init__(self, socket: Path, command: list[str], home: Path, size: tuple[int, int] = (80, 24)) -> None:
        # A server of its own: one that was told to end may still take the next session with it.
        self._tmux = ["tmux", "-S", f"{socket}-{next(_NUMBERS)}", "-f", "/dev/null"]
        set_home = ["-e", f"ACCEPT_HOME={home}", "-e", "LANG=C.UTF-8"]
        shell = ["sh", "-c", '"$@"; echo exit code $?; read wait', "sh"]  # which stays to say how the program ended
        width, height = map(str, size)
        set_home += ["-e", f"COLUMNS={width}", "-e", f"LINES={height}"]  # not those of the terminal that tests run in
        self._run("new-session", "-d", "-x", width, "-y", height, *set_home, "-s", "t", *shell, *command)

    def _run(self, *words: str) -> str:
        return subprocess.run([*self._tmux, *words], check=True, capture_output=True, text=True).stdout

    def screen(self) -> str:
        return self._run("capture-pane", "-p", "-t", "t")

    def wait_for(self, pattern: str) -> re.Match[str]:
        """Until the screen shows this."""
        deadline = time.monotonic() + TIMEOUT_S
        pause = 0.04
        while not (found := re.search(pattern, self.screen())):
            assert time.monotonic() < deadline, f"{pattern!r} did not appear on\n{self.screen()}"
            time.sleep(pause)  # tmux tells nobody when a screen has changed, and asking takes a process each time
            pause = min(1.5 * pause, 0.3)
        return found

    def ended(self) -> int:
        """The exit code, when the program has ended."""
        return int(self.wait_for(r"exit code (\d+)")[1])

    def press(self, *keys: str) -> None:
        self._run("send-keys", "-t", "t", *keys)

    def type(self, text: str) -> None:
        self._run("send-keys", "-t", "t", "-l", text)

    def line(self, text: str) -> None:
        self.type(text)
        self.press("Enter")

    def close(self) -> None:
        subprocess.run([*self._tmux, "kill-server"], check=False, capture_output=True)


class Technician:
    """Works through the steps, and goes on only when the screen has acknowledged what was given."""

    def __init__(self, terminal: Terminal) -> None:
        self.at = terminal
        self.events = 0

    def step(self, title: str) -> None:
        self.at.wait_for(r"Enter: open the step")
        self.at.press("Enter")
        self.at.wait_for(rf"{title}.* · \d of \d")

    def step_at(self, number: int, title: str) -> None:
        """Open the step at which the list stands: it must be this one."""
        self.at.press("Enter")
        self.at.wait_for(rf"{re.escape(title[:8])}.* · {number} of \d")

    def stored(self) -> None:
        """Until a higher event is acknowledged than any before."""
        while (number := int(self.at.wait_for(r"as entry (\d+)")[1])) <= self.events:
            time.sleep(0.05)
        self.events = number

    def reads(self, count: int = 1) -> None:
        for _ in range(count):
            self.at.wait_for(r"now [\d-]|F3 Take +[\d-]")  # beside the value, below large digits
            self.at.press("F3")
            self.stored()

    def types(self, *lines: str) -> None:
        for line in lines:
            self.at.line(line)
            self.stored()

    def back(self) -> None:
        self.at.press("Escape")

    def signs(self, training: bool = False, why: str = "") -> None:
        """training: its authority has no owner, so the page about the authority's key is not shown. why: asked for a
        unit that is not accepted."""
        self.at.wait_for("Enter: open the step")
        self.at.press("F9")
        self.at.wait_for(r"\^S: sign this result")
        self.at.press("F2")
        self.at.wait_for("Repeat passphrase")
        for line in (*([why] if why else []), "correct horse", "correct horse"):
            self.at.line(line)
        if not training:
            self.at.wait_for("Keys were created")
            self.at.press("Escape")


def patient(bench: Path) -> None:
    """The simulated instruments are a program beside the one under test: on a crowded machine both wait for a core, and
    a technician who was told that nothing came in time would read again."""
    text = bench.read_text(encoding="utf-8")
    text = text.replace("timeout_s = 1.0 }", "timeout_s = 8.0, deadline_s = 40.0 }")
    bench.write_text(text.replace("timeout_s = 1.0\n", "timeout_s = 8.0\ndeadline_s = 40.0\n"), encoding="utf-8")


@contextmanager
def bench_for_seed(place: Path, seed: int, peers: bool = False) -> Iterator[tuple[Path, Path]]:
    """A simulated APA without a fault, and instruments that measure it: folder of its records, bench file. peers: those
    that were written from the documents instead of the program's own."""
    unit, bench = place / "unit", place / "bench"
    subprocess.run([*ACCEPT, "simulate", "unit", "--kind", "apa", "--seed", str(seed), "--out", unit], check=True)
    served = [*ACCEPT, "simulate", "bench", "--unit", unit, "--out", bench]
    if peers:
        served = [sys.executable, "-m", "tests.hw.peers.bench", unit, bench]
    server = subprocess.Popen(served, stdout=subprocess.PIPE)
    deadline = time.monotonic() + TIMEOUT_S
    while not (bench / "bench.toml").exists():
        assert server.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    patient(bench / "bench.toml")
    try:
        yield unit, bench / "bench.toml"
    finally:
        server.terminate()
        server.communicate()
