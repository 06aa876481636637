"""`accept hw`, `accept simulate bench`: the command line against simulated instruments."""

import os
import signal
import subprocess
import sys
import tomllib
from functools import partial
from pathlib import Path

import pytest

from accept.simulate.bench_truth import world_of
from hw.errors import SettingsError
from hw.instruments import DRIVERS, open_instrument
from hw.simulated import BenchFault, FaultKind, LineFault, Stage
from specs.bench import InstrumentEntry, LineEntry, parse_bench
from tests.accept.units.test_watch_folder import stroke_bytes
from tests.accept.units.units import make_unit
from tests.hw.instruments.simbench import simulated_bench
from tests.shared import command_line

run = partial(command_line.accept, columns=160)


@pytest.fixture
def bench(tmp_path, monkeypatch):
    monkeypatch.setattr("accept.capture.reading_loop.PAUSES_S", (0.05, 0.3))
    with simulated_bench(tmp_path / "bench") as (simulated, _):
        simulated.stage.write(Stage(1, "sensor", "one_stack", 0.0))
        yield simulated


def test_list(bench):
    done = run("hw", "list", "--bench", bench.bench_file)
    assert done.exit_code == 0
    for words in ("gauge", "millimar", "SIM-LCR", "2099-12-31", str(bench.folder / "probe")):
        assert words in done.output


def test_list_says_which_port_is_not_there(bench):
    bench.bench_file.write_text(bench.bench_file.read_text().replace("bench/lcr", "bench/gone"))
    assert "(not there)" in run("hw", "list", "--bench", bench.bench_file).output


def test_test_names_who_answered_and_what(bench):
    done = run("hw", "test", "--bench", bench.bench_file)
    assert done.exit_code == 0, done.output
    assert "C1216 SIM-GAUGE" in done.output
    assert "uF, D 0.0145" in done.output


def test_the_bench_file_in_the_bench_s_folder_is_the_default(bench, bench_home):
    (bench_home / "bench.toml").write_bytes(bench.bench_file.read_bytes())
    assert run("hw", "test", "probe").exit_code == 0


def test_an_instrument_that_fails_gives_exit_5_and_the_reason(bench):
    bench.gauge.inject(LineFault(FaultKind.MENU_OPEN))
    done = run("hw", "test", "--bench", bench.bench_file)
    assert done.exit_code == 5
    assert "is a menu open" in done.output
    assert run("hw", "test", "probe", "--bench", bench.bench_file).exit_code == 0


def test_names_and_files_that_are_not_there(bench, tmp_path):
    assert run("hw", "test", "meter", "--bench", bench.bench_file).exit_code == 6
    assert run("hw", "list", "--bench", tmp_path / "no.toml").exit_code == 6
    assert run("hw", "list").exit_code == 6


def test_a_fault_of_the_file_is_bad_input_before_anything_is_asked(bench):
    text = bench.bench_file.read_text()
    bench.bench_file.write_text(text + '[instruments.meter]\ndriver = "multimeter"\nmeasures = ["capacitance"]\n')
    for command in ("list", "test"):
        done = run("hw", command, "--bench", bench.bench_file)
        assert done.exit_code == 6, done.output
        assert "unknown driver 'multimeter'" in done.output
    bench.bench_file.write_text(text + '[instruments.meter]\ndriver = "scpi_lcr"\nmeasures = ["capacitance"]\n')
    done = run("hw", "list", "--bench", bench.bench_file)
    assert done.exit_code == 6
    assert "profile" in done.output


def test_an_expired_calibration_is_marked(bench):
    bench.bench_file.write_text(bench.bench_file.read_text().replace("2099-12-31", "2020-12-31"))
    assert "2020-12-31 (expired)" in run("hw", "list", "--bench", bench.bench_file).output


def test_measure_begins_a_unit_and_enters_the_values(bench, tmp_path):
    done = run("hw", "measure", tmp_path / "N", "capacitance", "--bench", bench.bench_file, "--begin", "APA-09")
    assert done.exit_code == 0, done.output
    written = tomllib.loads((tmp_path / "N" / "unit.toml").read_text())
    assert written["serial"] == "APA-09"
    assert written["capacitance"]["actuator_uF"]["value"] == pytest.approx(10.03, rel=1e-3)
    assert "APA-09" in run("recall", "--instrument", "SIM-LCR", "--since", "2020-01-01").output


def test_measure_that_fails_gives_exit_5(bench, tmp_path):
    bench.lcr.inject(LineFault(FaultKind.OVERRANGE))
    make_unit(tmp_path / "U")
    done = run("hw", "measure", tmp_path / "U", "capacitance", "--bench", bench.bench_file)
    assert done.exit_code == 5
    assert "PRIM:OVER" in done.output
    for section in ("stiffness", "weight"):  # no instrument was asked: the order is wrong
        assert run("hw", "measure", tmp_path / "U", section, "--bench", bench.bench_file).exit_code == 6


def test_without_a_terminal_nobody_is_asked(bench, tmp_path):
    """A real bench has no stage file: hands are a person's."""
    text = bench.bench_file.read_text()
    bench.bench_file.write_text("\n".join(line for line in text.splitlines() if not line.startswith("stage")))
    make_unit(tmp_path / "U")
    done = run("hw", "measure", tmp_path / "U", "capacitance", "--bench", bench.bench_file)
    assert done.exit_code == 5
    assert "no terminal for a question" in done.output


def test_pickup(tmp_path, monkeypatch):
    monkeypatch.setattr("accept.commands.bench.hw.STABLE_S", 0.1)
    make_unit(tmp_path / "U", text='serial = "{serial}"\nkind = "apa"\n')
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig" / "a.mat").write_bytes(stroke_bytes())
    (tmp_path / "rig" / "Half.mat").write_bytes(stroke_bytes()[:3000])
    words = ("hw", "pickup", tmp_path / "rig", tmp_path / "U", "stroke", "one_stack")
    early = run(*words, "--wait", 0.3)
    assert early.exit_code == 6
    assert "--old only: Half.mat, a.mat" in early.output
    done = run(*words, "--wait", 5, "--old")
    assert done.exit_code == 0, done.output
    assert "Half.mat is left where it is" in done.output
    assert tomllib.loads((tmp_path / "U" / "unit.toml").read_text())["stroke"]["one_stack"] == "a.mat"


@pytest.mark.slow
def test_simulate_bench_as_a_program_of_its_own(tmp_path):
    """Two programs: one simulates, the other measures; a signal ends the first in good order."""
    make_unit(tmp_path / "U", "U-7")
    command = [sys.executable, "-m", "accept", "simulate", "bench", "--unit", tmp_path / "U", "--out", tmp_path / "b"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ)) as process:
        assert process.stdout is not None
        try:
            printed = dict(process.stdout.readline().split() for _ in range(4))
            done = run("hw", "measure", tmp_path / "N", "capacitance", "--bench", printed["bench"], "--begin", "N-1")
        finally:
            process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 0
    assert set(printed) == {"gauge", "lcr", "probe", "bench"}
    assert done.exit_code == 0, done.output
    assert not (tmp_path / "b" / "gauge").exists()


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("gauge:menu_open", "is a menu open"),
        ("lcr:overrange", "PRIM:OVER"),
        ("probe:half_line", "only 'ND-' came in time"),
        ("lcr:half_line:3", "not acknowledged"),
        ("gauge:swapped:probe", "gauge: no reply"),
    ],
)
def test_a_fault_to_practise_with(bench, fault, words):
    bench.strike([BenchFault.of(fault)])
    done = run("hw", "test", fault.split(":")[0], "--bench", bench.bench_file)
    assert done.exit_code == 5, done.output
    assert words in done.output


@pytest.mark.slow
def test_a_fault_asked_for_on_the_command_line(tmp_path):
    make_unit(tmp_path / "U", "U-7")
    words = ["simulate", "bench", "--unit", tmp_path / "U", "--fault", "lcr:overrange"]
    command = [sys.executable, "-m", "accept", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ)) as process:
        assert process.stdout is not None
        try:
            printed = dict(process.stdout.readline().split() for _ in range(4))
            assert run("hw", "test", "probe", "--bench", printed["bench"]).exit_code == 0
            done = run("hw", "test", "lcr", "--bench", printed["bench"])
        finally:
            process.send_signal(signal.SIGTERM)
    assert done.exit_code == 5
    assert "PRIM:OVER" in done.output


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("scale:garbage", "one of gauge, lcr, probe"),
        ("gauge:broken", "menu_open"),
        ("gauge:swapped", "gauge:swapped:lcr"),
        ("gauge:swapped:gauge", "gauge:swapped:lcr"),
        ("lcr:slow:soon", "'soon' is not a number"),
    ],
)
def test_a_fault_that_is_none(tmp_path, fault, words):
    make_unit(tmp_path / "U", "U-7")
    done = run("simulate", "bench", "--unit", tmp_path / "U", "--seconds", 0, "--fault", fault)
    assert done.exit_code == 6
    assert words in done.output


def test_the_world_is_the_unit_s(tmp_path):
    world = world_of(make_unit(tmp_path / "U", "U-7"))
    assert world.heights_m[4:6] == pytest.approx((42e-6, 45.5e-6))
    assert (world.sensor_F, world.actuator_F) == pytest.approx((5.10e-6, 10.03e-6))
    assert world.one_stack_m + world.two_stacks_m == pytest.approx(373.2e-6)
    bare = world_of(make_unit(tmp_path / "B", text='serial = "{serial}"\nkind = "apa"\n'))
    assert bare.one_stack_m == pytest.approx(120e-6)


def test_the_world_of_records(tmp_path):
    folder = make_unit(
        tmp_path / "U", text='serial = "{serial}"\nkind = "apa"\n[stroke]\none_stack = "1.mat"\ntwo_stacks = "2.mat"\n'
    )
    (folder / "1.mat").write_bytes(stroke_bytes(120e-6))
    (folder / "2.mat").write_bytes(stroke_bytes(240e-6))
    world = world_of(folder)
    assert (world.one_stack_m, world.two_stacks_m) == pytest.approx((120e-6, 240e-6), rel=1e-4)  # sampled near the top
    (folder / "2.mat").write_bytes(b"nothing")
    assert run("simulate", "bench", "--unit", folder, "--seconds", 0).exit_code == 6


LINE = LineEntry(port="/dev/x", baud=9600, data_bits=7, parity="even", stop_bits=2, handshake="none")


@pytest.mark.parametrize(
    ("driver", "settings", "link", "words"),
    [
        ("millimar", {"protocol": "OPTORSD", "unit": "mm"}, LINE, "range_mm"),
        ("millimar", {"protocol": "MARTALK", "unit": "mm", "range_mm": [0, 1]}, LINE, "protocol"),
        ("millimar", {"protocol": "M1240", "unit": "mm", "range_mm": [0, 1], "timout_s": 1}, LINE, "unknown key"),
        ("millimar", {"protocol": "OPTORSD", "unit": "mm", "range_mm": [0, 1]}, None, "link"),
        ("lcr800", {"voltage_V": 2.0}, LINE, "voltage_V"),
        ("nd287", {}, LINE, "range_mm"),
        ("manual", {"measure": "mass", "unit": "kg", "range": [0, 1]}, None, "measure"),
        ("offline", {}, None, "no wire"),
        ("millimeter", {}, LINE, "unknown driver"),
    ],
)
def test_settings_that_a_driver_refuses(driver, settings, link, words):
    entry = InstrumentEntry(driver=driver, measures=[], settings=settings, link=link)
    with pytest.raises(SettingsError, match=words):
        open_instrument("x", entry, input)


def test_every_driver_opens():
    settings = {
        "millimar": {"protocol": "M1240", "unit": "mm", "range_mm": [-1, 1]},
        "lcr800": {},
        "nd287": {"range_mm": [-1, 1], "axis": "single"},
        "nd281b": {"range_mm": [-1, 1]},
        "scpi_lcr": {"profile": "keysight"},
        "ids3010": {"axis": 0, "pass_mode": 0, "range_mm": [-1, 1]},
        "manual": {"measure": "capacitance", "unit": "uF", "range": [0, 10]},
        "pymeasure": {
            "class": "pymeasure.instruments.agilent.AgilentE4980",
            "value": "impedance[0]",
            "unit": "F",
            "expect": {"frequency": 1000.0},
            "range": [1e-8, 1e-4],
            "agreement": 1e-8,
        },
    }
    assert set(settings) == set(DRIVERS)
    for driver, given in settings.items():
        where = {"resource": "host:9090"} if driver in ("scpi_lcr", "ids3010", "pymeasure") else {"link": LINE}
        entry = InstrumentEntry(driver=driver, measures=[], settings=given, **where)
        assert open_instrument("x", entry, input).unit in ("m", "F")


def test_the_bench_file_of_the_documentation_is_one():
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "instruments.md").read_text()
    bench = parse_bench(page.split("```toml\n")[1].split("```")[0].encode(), "docs/how-to/instruments.md")
    for name, entry in bench.instruments.items():
        if entry.driver != "offline":
            open_instrument(name, entry, input)
