"""SIGKILL of the real program at random moments of an APA on the simulated bench: after each restart the workflow
stands at the step where it stood, nothing acknowledged is missing, and the unit gets its certificate. In the heavy
lane all measurements of an APA, else the basic ones; a whole one without a kill is in `test_terminal_run.py`."""

import os
import random
import re
import signal
import subprocess
import threading
from pathlib import Path

import pytest

from accept.base.exit_codes import Exit
from accept.certificate.trust import keys
from accept.judging import load_spec
from accept.store import open_store
from accept.workflow.state.unit_state import Attempt, fold_run
from accept.workflow.steps.plan import steps_of
from accept.workflow.steps.status import open_steps
from tests.accept.batch.killing import gone, until
from tests.accept.tui.terminal_programs.terminal import ACCEPT, FILES, Technician, Terminal, bench_for_seed
from tests.soak import SOAK

pytestmark = pytest.mark.terminal

KILLS_A_RUN = 20 if SOAK else 3
LONGEST_S = 6.0  # until a kill: several entries and their judgement, or a signature
SERIAL = "APA-77"
ACKNOWLEDGED = re.compile(r"as entry (\d+)")
READ = "F3"
ENTRIES = {
    "flatness": (READ,) * 8,
    "capacitance": (READ,) * 2,
    "stroke": FILES["Stroke"],
    "stiffness": (*FILES["Axial stiffness"], "6.4 kg"),
    "hysteresis": FILES["Hysteresis"],
    "sensor_highpass": (*FILES["High-pass"], "1 MOhm"),
    "spurious_modes": FILES["Spurious modes"],
    "frf": ("frf_sweep.mat", "frf_noise_hf.mat"),
}
JUDGED_BY = {"sensor_highpass": 1}  # entries that a step is judged by; others may come later, and no kill loses these
SPEC = load_spec("apa" if SOAK else "apa-basic")
STEPS = steps_of(SPEC)


class Killed(Exception):
    """The program was killed while the technician waited for something."""


class Doomed(Terminal):
    """A terminal whose program is killed a while after `doom`; `seen` is what stood on the screen just before."""

    def __init__(self, socket: Path, command: list[str], home: Path) -> None:
        super().__init__(socket, command, home)
        self.seen, self.left_behind = "", set[int]()
        self._killed = threading.Event()
        self._timer: threading.Timer | None = None

    def doom(self, after_s: float) -> None:
        self._timer = threading.Timer(after_s, self._kill)
        self._timer.start()

    def _kill(self) -> None:
        program = children(int(self._run("display-message", "-p", "-t", "t", "#{pane_pid}")))
        self.left_behind = {child for pid in program for child in children(pid)}
        self.seen = self.screen()
        for pid in program:
            os.kill(pid, signal.SIGKILL)
        self._killed.set()

    def screen(self) -> str:
        if self._killed.is_set():
            raise Killed
        return super().screen()

    def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer.join()
        super().close()


def children(pid: int) -> set[int]:
    found = Path(f"/proc/{pid}/task/{pid}/children")
    return {int(child) for child in found.read_text().split()} if found.exists() else set()


def attempt_of_store() -> Attempt | None:
    with open_store() as store:
        assert store.check() is None
        return fold_run(SERIAL, store.events(SERIAL)).attempt


def stands_at(attempt: Attempt | None) -> int | None:
    """The number of the step that the store says comes next."""
    states = {step.name: attempt.step(step.check.reads) for step in STEPS} if attempt else {}
    step = next(iter(open_steps(STEPS, states, f"{SPEC.name}@{SPEC.sha256}")), None)
    return None if step is None else STEPS.index(step)


def begin(ann: Technician) -> None:
    ann.at.wait_for("Scan a serial")
    ann.at.type(SERIAL)
    ann.at.wait_for(f"({SERIAL} is a new unit|Enter (begins|opens) {SERIAL})")
    ann.at.press("Enter")
    if "step" not in ann.at.wait_for(r"Enter: open the step|Enter: begin it\. Esc|another kind")[0]:
        ann.at.press("Enter")  # a new one is as proposed
    ann.at.wait_for("Enter: open the step")


def work(ann: Technician) -> None:
    """From the list of steps, as it stands, to the signed certificate."""
    while (at := stands_at(attempt := attempt_of_store())) is not None:
        step = STEPS[at]
        ann.step_at(at + 1, step.title)
        given = attempt.step(step.name).entries if attempt else ()
        if step.name in ("stroke", "stiffness") and not given:
            if ann.at.wait_for(r"\^F: (values|records)")[1] == "records":  # it opens with what is there
                ann.at.press("C-f")
            ann.at.wait_for(r"\^F: values")
        for entry in ENTRIES[step.name][len(given) :]:
            ann.reads() if entry == READ else ann.types(entry)
        ann.at.wait_for(rf"[✓✗~?] [a-z ]+ · {at + 1} of \d")
        ann.back()
        ann.at.wait_for("Enter: open the step")
    ann.at.press("F9")
    ann.at.wait_for(r"\^S: sign this result|Signed\. ")
    if attempt is None or attempt.certificate is None:
        sign(ann)
    ann.at.wait_for(r"✓ verified|◐ signed|Signed\. ")


def sign(ann: Technician) -> None:
    ann.at.press("F2")
    word = ann.at.wait_for(r"You sign as technician: (\w+)")[1]
    if word != "ACCEPTED":
        ann.at.line("as it was recorded")
    ann.at.line("correct horse")


def one_life(place: Path, run: list[str], home: Path, rng: random.Random, events: int) -> int:
    """Start, work, be killed somewhere; returns the last event that was acknowledged."""
    terminal = Doomed(place / "tmux", run, home)
    ann = Technician(terminal)
    ann.events = events
    try:
        if at_start := rng.random() < 0.15:
            terminal.doom(rng.uniform(0.0, LONGEST_S))
        begin(ann)
        if not at_start:
            terminal.doom(rng.uniform(0.0, LONGEST_S))
        work(ann)
        terminal.wait_for("never to be seen")
    except Killed:
        pass
    finally:
        terminal.close()
    assert until(lambda: all(gone(pid) for pid in terminal.left_behind)), "a computation went on without its program"
    return max([ann.events, *(int(number) for number in ACKNOWLEDGED.findall(terminal.seen))])


@pytest.mark.parametrize("seed", range(10 if SOAK else 1))
@pytest.mark.slow
def test_a_run_that_is_killed_again_and_again_loses_nothing(seed: int, bench_home: Path, tmp_path: Path):
    rng, events = random.Random(seed), 0
    keys.init(bench_home, "correct horse", "Ann", "Quinn", "battery staple")
    with bench_for_seed(tmp_path, 4) as (records, bench):
        given = ["--spec", SPEC.name, "--bench", str(bench), "--records", str(records)]
        run = [*ACCEPT, "run", *given, "--operator", "Ann"]
        for _ in range(KILLS_A_RUN):
            events = one_life(tmp_path, run, bench_home, rng, events)
            with open_store() as store:
                assert events <= max((event.seq for event in store.events(SERIAL)), default=0)
        if (attempt := attempt_of_store()) is None or attempt.certificate is None:
            finish(tmp_path, run, bench_home, events)
    said = subprocess.run([*ACCEPT, "verify", bench_home / "certificates" / f"{SERIAL}.pdf"], capture_output=True)
    assert said.returncode == Exit.INCOMPLETE, said.stdout + said.stderr  # the instruments are simulated
    attempt = attempt_of_store()
    assert attempt is not None
    for name, given in ENTRIES.items():
        if name in SPEC.checks:
            assert JUDGED_BY.get(name, len(given)) <= len(attempt.step(name).entries) <= len(given), name


def finish(place: Path, run: list[str], home: Path, events: int) -> None:
    """The last life, to its natural end."""
    terminal = Terminal(place / "tmux", run, home)
    try:
        ann = Technician(terminal)
        ann.events = events
        begin(ann)
        work(ann)
    finally:
        terminal.close()
