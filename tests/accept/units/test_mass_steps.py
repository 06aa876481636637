"""Stiffness with an added mass, live: an interferometer by its maker's protocol is followed while the mass is put on
and taken off, through the workflow to a signed certificate; no fault on the way gives a wrong stiffness."""

import random
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.capture import recipes
from accept.cli.main import app
from accept.commands.bench import hw
from accept.judging import judge_unit, load_spec
from accept.store import open_store
from accept.units import toml_edit, unit_folder
from accept.workflow import certify
from accept.workflow.capture import measure_folder
from accept.workflow.dialogue.begin import Begun
from accept.workflow.instruments.hardware import BenchInstrument
from accept.workflow.open_bench import open_bench
from accept.workflow.worker.judging import judge_whole_unit
from checks.verdict import Verdict
from hw.errors import Implausible, InstrumentError, SettingsError
from hw.instruments import Heidenhain
from hw.instruments.heidenhain import Nd287Settings
from hw.instruments.ids3010 import Ids3010, Ids3010Settings
from hw.link import Link
from specs.bench import InstrumentEntry
from tests.checks.acceptance.test_stiffness import Bench, G
from tests.hw.instruments.dialogue import LINE
from tests.hw.peers.faults import OF_A_NETWORK
from tests.hw.peers.heidenhain import HeidenhainPeer
from tests.hw.peers.ids3010 import Ids3010Peer
from tests.hw.peers.line import Line, random_faults
from tests.hw.peers.network import served
from tests.soak import SOAK

MASS = 6.4
K = {"closed_circuit": 1.75e6, "open_circuit": 1.93e6}  # N/m of a good APA
BENCH = """
name = "bench 1"
[instruments.ids]
driver = "ids3010"
measures = ["stiffness"]
resource = "{address}"
serial = "L01234567"
settings = {{ axis = 0, pass_mode = 0, range_mm = [-1.0, 1.0], quiet_s = 0.05 }}
"""


class Moving(Ids3010Peer):
    """In front of it an APA creeps under a mass; clock: of the bench [s]."""

    clock: Callable[[], float] = staticmethod(lambda: 0.0)
    bench, began, noise = Bench(), 0.0, random.Random(7)

    @property
    def truth(self) -> float:
        now, it = self.clock() - self.began, self.bench
        steps = it._step(np.array([now - it.add])) - it._step(np.array([now - it.remove]))
        return it.drift * now - MASS * G / it.k * float(steps[0]) + self.noise.gauss(0.0, it.noise)

    @truth.setter
    def truth(self, _: float) -> None:
        """The base class sets it first."""


class Technician:
    """Does what the program asks for, at the moments that it names."""

    sets_each_voltage = True

    def __init__(self, peer: Moving) -> None:
        self.peer = peer

    def weigh(self) -> str:
        return str(MASS)

    def load(self, circuit: str) -> None:
        late = 0.37  # s: nobody is on time
        add, remove = recipes.ADD_S + late, recipes.REMOVE_S + late
        self.peer.bench = Bench(k=K[circuit], add=add, remove=remove)
        self.peer.began = self.peer.clock()


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of ten seconds: the check needs two before, between and after."""
    for name, value in (("ADD_S", 3.0), ("REMOVE_S", 6.0), ("END_S", 10.0)):
        monkeypatch.setattr(recipes, name, value)


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    toml_edit.begin(tmp_path / "APA-09", "APA-09", "apa")
    return tmp_path / "APA-09"


def followed(unit: Path, line: Line, peer: Moving, technician: type[Technician] = Technician) -> None:
    peer.clock = line.clock
    settings = Ids3010Settings(axis=0, pass_mode=0, quiet_s=0.05, range_mm=[-1.0, 1.0])
    driver = Ids3010("ids", Link(LINE, line.open, line.clock), settings, None, "L01234567")
    entry = InstrumentEntry(driver="ids3010", measures=["stiffness"], resource="192.168.1.1:9090", serial="L01234567")
    with open_store() as store:
        measure_folder(unit, "stiffness", BenchInstrument("ids", driver, entry), technician(peer), store, "Ann")


def stiffnesses(unit: Path) -> dict[str, float]:
    result = judge_unit(unit_folder.read(unit), load_spec("apa"))
    found = {f.quantity: f for f in result.findings}
    return {name: found[name].value for name in ("k_closed_N_per_um", "k_open_N_per_um")}


def right(unit: Path) -> bool:
    """Within 0.5 %: the creep law and the moment of the steps leave 0.2 %."""
    found = stiffnesses(unit)
    return found == {
        "k_closed_N_per_um": pytest.approx(K["closed_circuit"] / 1e6, rel=5e-3),
        "k_open_N_per_um": pytest.approx(K["open_circuit"] / 1e6, rel=5e-3),
    }


@pytest.mark.usefixtures("short")
def test_followed_at_the_bench_taken_up_by_the_workflow_and_certified(unit: Path) -> None:
    peer = Moving()
    peer.enabled = True
    followed(unit, Line(peer), peer)
    assert right(unit)
    bench = open_bench("apa-basic", folder=unit)
    session, problems = bench.open_unit(Begun("APA-09", "apa", "Ann"))
    assert problems == []
    (found,) = [f for f in judge_whole_unit(session).findings if f.quantity == "k_closed_N_per_um"]
    assert found.verdict is Verdict.PASS
    assert found.value == pytest.approx(1.75, rel=5e-3)
    certify.Signing(session).make_keys("correct horse")
    report = certify.Signing(session).sign("correct horse", "only the stiffness was wanted")
    assert report.valid, report.reason
    session.close()
    bench.close()


@pytest.mark.usefixtures("short")
def test_no_fault_gives_a_wrong_stiffness(tmp_path: Path) -> None:
    """Covered, stopped, another pass mode, late, lost, without power, unplugged, anywhere in the run."""
    outcomes: Counter[str] = Counter()
    for seed in range(200 if SOAK else 6):
        rng = random.Random(seed)
        unit = tmp_path / str(seed)
        toml_edit.begin(unit, f"A-{seed}", "apa")
        peer = Moving()
        peer.enabled = True
        line = Line(peer, random_faults(rng, most=2, span=9000, kinds=OF_A_NETWORK))
        try:
            followed(unit, line, peer)
        except InstrumentError as e:
            outcomes[type(e).__name__] += 1
            assert "stiffness" not in unit_folder.read(unit).sections
        else:
            outcomes["right"] += 1
            assert right(unit), (seed, stiffnesses(unit), line.log)
    assert len(outcomes) > 1, outcomes


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"contrast": 100}, "the contrast of axis 0 is 100 permille"),
        ({"pass_mode": 1}, "its pass mode is 1"),
        ({"serial": "L99"}, "serial number 'L99'"),
        ({"enabled": False}, "its measurement is not running"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_is_entered(unit: Path, change: dict[str, object], words: str) -> None:
    peer = Moving()
    for name, value in ({"enabled": True} | change).items():
        setattr(peer, name, value)
    with pytest.raises(InstrumentError, match=words):
        followed(unit, Line(peer), peer)
    assert "stiffness" not in unit_folder.read(unit).sections


class Asleep(Technician):
    """Never puts the mass on."""

    def load(self, circuit: str) -> None:
        super().load(circuit)
        self.peer.bench = replace(self.peer.bench, k=1e30)


@pytest.mark.usefixtures("short")
def test_a_record_without_steps_is_said_at_once(unit: Path) -> None:
    peer = Moving()
    peer.enabled = True
    with pytest.raises(Implausible, match="closed_circuit"):
        followed(unit, Line(peer), peer, Asleep)
    assert "stiffness" not in unit_folder.read(unit).sections
    (journal,) = (unit / "readings").iterdir()
    assert len(journal.read_text().splitlines()) > 100  # what was read is kept


def test_an_instrument_that_is_too_slow_is_said(unit: Path) -> None:
    peer = HeidenhainPeer()
    line = Line(peer)
    settings = Nd287Settings(axis="single", identification="ND-287", range_mm=[-1.0, 1.0])
    driver = Heidenhain("probe", Link(LINE, line.open, line.clock), settings)
    entry = InstrumentEntry(driver="nd287", measures=["stiffness"], serial="1")
    with open_store() as store, pytest.raises(SettingsError, match="cannot follow what moves"):
        measure_folder(unit, "stiffness", BenchInstrument("probe", driver, entry), Technician(Moving()), store, "Ann")


class Slow(Line):
    """A line on which each answer takes a quarter of a tenth of a second, and one of them, once, `once_s`."""

    def __init__(self, peer: Moving, once_s: float = 0.0, after_s: float = 0.0) -> None:
        super().__init__(peer)
        self.once_s, self.after_s = once_s, after_s

    def write(self, data: bytes, /) -> int:
        self.now += 0.025
        if self.once_s and self.now > self.after_s and b"getAxisDisplacement" in data:
            self.now, self.once_s = self.now + self.once_s, 0.0
        return super().write(data)


@pytest.mark.usefixtures("short")
def test_a_round_trip_of_25_ms_makes_a_record(unit: Path) -> None:
    """Six questions at each value would leave 0.15 s and more between two values."""
    peer = Moving()
    peer.enabled = True
    followed(unit, Slow(peer), peer)
    assert right(unit)


@pytest.mark.usefixtures("short")
def test_the_first_gap_ends_the_record(unit: Path) -> None:
    """And not the end of the record, when the mass has been on and off for nothing."""
    peer = Moving()
    peer.enabled = True
    line = Slow(peer, once_s=0.17, after_s=2.0)
    with pytest.raises(Implausible, match=r"closed_circuit, .* s went by between two readings"):
        followed(unit, line, peer)
    assert line.now < 3.0  # the gap is at 2 s of the clock, the record would take 10
    (journal,) = (unit / "readings").iterdir()
    assert "stiffness" not in unit_folder.read(unit).sections
    assert len(journal.read_text().splitlines()) > 10


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("change", ["reset", "dual pass", "beam lost"])
def test_what_changes_within_a_record_ends_it(unit: Path, change: str) -> None:
    """The state is asked one question a value: a change shows within five values."""
    peer = Moving()
    peer.enabled = True

    class Changed(Line):
        def write(self, data: bytes, /) -> int:
            if change and self.now > 4.0 and not self.log:
                self.log.append(change)
                peer.panel[change]()
            return super().write(data)

    line = Changed(peer)
    with pytest.raises(InstrumentError):
        followed(unit, line, peer)
    assert line.now < 4.5
    assert "stiffness" not in unit_folder.read(unit).sections


@pytest.mark.soak
@pytest.mark.usefixtures("short")
def test_by_the_command_over_the_network(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In real time, from a peer on a TCP port, with the technician's answers typed."""
    peer = Moving()
    peer.enabled, peer.clock = True, time.monotonic
    technician = Technician(peer)

    def typed(words: str) -> str:
        if words.startswith("Weigh"):
            return str(MASS)
        technician.load("closed_circuit" if words.startswith("Connect") else "open_circuit")
        return ""

    monkeypatch.setattr(hw, "ask_at_terminal", typed)
    unit = tmp_path / "APA-09"
    with served(peer) as address:
        (tmp_path / "bench.toml").write_text(BENCH.format(address=address))
        words = ["hw", "measure", str(unit), "stiffness", "--begin", "APA-09", "--bench", str(tmp_path / "bench.toml")]
        done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "put the mass on now" in done.stderr
    assert right(unit)
