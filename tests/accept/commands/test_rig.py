"""From the rig's folder to a verdict without editing a file: File Logs with names, counts and units of the rig."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from accept.cli.main import app
from accept.judging import judge_unit, load_spec
from accept.models.model_file import open_model
from accept.simulate.unit import UnitRequest, simulate, write
from accept.units import toml_edit, unit_folder
from accept.workflow.dialogue.begin import Begun
from accept.workflow.open_bench import open_bench
from accept.workflow.worker.process import WorkerProcess
from checks.acceptance import CHECKS
from hw import records
from specs.bench import load_bench
from specs.strict import SpecError

COUNTS = 32767 / 10.0  # per volt, of a 16 bit converter
BENCH = """
name = "bench 1"
[rig]
folder = "{rig}"
records = [
    {{ pattern = "*low*.mat", section = "frf", name = "low" }},
    {{ pattern = "*high*.mat", section = "frf", name = "high" }},
]
[rig.channels]
Va = {{ name = "DAC_1", gain = {gain} }}
Vs = "log.adc.sensor"
de = {{ name = "encoder", unit = "nm" }}
da = {{ name = "ids", gain = 1e-12 }}
t = "time"
[instruments.encoder]
driver = "offline"
measures = ["frf"]
"""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    request = UnitRequest("ST-07", "strut", open_model("strut"), seed=7)
    return write(simulate(request), tmp_path_factory.mktemp("simulated") / "ST-07")


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    (tmp_path / "rig").mkdir()
    text = BENCH.format(rig=(tmp_path / "rig").as_posix(), gain=1 / COUNTS)
    (tmp_path / "bench.toml").write_text(text)
    return tmp_path / "rig"


def file_log(source: Path, target: Path) -> None:
    """What the rig stores of a run: its own names, in its own units, in structures."""
    found = records.read(source, CHECKS["frf"].inputs["low"])
    log = {
        "time": found.t, "dac": {"DAC_1": found["Va"] * COUNTS}, "adc": {"sensor": found["Vs"]},
        "encoder": found["de"] * 1e9, "ids": found["da"] * 1e12, "state": np.ones(found.t.size),
    }  # fmt: skip
    savemat(target, {"log": log})


def responses_of(folder: Path) -> dict[str, float | None]:
    spec = load_spec("strut")
    only = spec.model_copy(update={"checks": {"frf": spec.checks["frf"]}})
    return {f.quantity: f.value for f in judge_unit(unit_folder.read(folder), only).findings}


def run(*words: object):
    return CliRunner().invoke(app, [str(w) for w in words], env={"COLUMNS": "160"})


@pytest.mark.slow
def test_file_logs_of_the_rig_are_picked_up_and_judged_unedited(simulated, rig, tmp_path, monkeypatch):
    monkeypatch.setattr("accept.commands.bench.hw.STABLE_S", 0.1)
    unit = tmp_path / "ST-07"
    toml_edit.begin(unit, "ST-07", "strut")
    entries = tomllib.loads((simulated / "unit.toml").read_text())["frf"]
    for name in ("low", "high"):
        file_log(simulated / entries[name], rig / f"run3_{name}_sweep.mat")
    (rig / "notes.mat").write_bytes(b"no record")
    done = run("hw", "pickup", unit, "--bench", tmp_path / "bench.toml", "--wait", 20, "--old")
    assert done.exit_code == 0, done.output
    assert "no pattern of [rig] fits" in done.output
    for name in ("low", "high"):  # copied as they are
        copied = tomllib.loads((unit / "unit.toml").read_text())["frf"][name]
        assert (unit / copied).read_bytes() == (rig / f"run3_{name}_sweep.mat").read_bytes()
    if "merge_Hz" in entries:
        toml_edit.enter(unit, "frf", {"merge_Hz": entries["merge_Hz"]})
    expected, found = responses_of(simulated), responses_of(unit)
    assert None not in {found[name] for name, value in expected.items() if value is not None}
    for name, value in expected.items():  # the rig's numbers are rounded twice on their way through its units
        assert found[name] == (None if value is None else pytest.approx(value, rel=1e-6, abs=1e-9)), name


@pytest.mark.slow
def test_the_same_map_serves_frf_and_the_workflow(simulated, rig, tmp_path, monkeypatch):
    monkeypatch.setattr(WorkerProcess, "warm", lambda self: None)
    entries = tomllib.loads((simulated / "unit.toml").read_text())["frf"]
    file_log(simulated / entries["low"], rig / "low.mat")
    done = run("frf", rig / "low.mat", "--bench", tmp_path / "bench.toml", "--f-lo", 20, "--json", tmp_path / "f.json")
    assert done.exit_code == 0, done.output
    bench = open_bench("strut", bench_file=tmp_path / "bench.toml")
    assert bench.records == rig
    session, _ = bench.open_unit(Begun("ST-08", "strut", "Ann"))
    session.records.link("frf", CHECKS["frf"].inputs["low"], rig / "low.mat")
    written = session.written()
    assert written.channels["de"] == {"name": "encoder", "unit": "nm"}
    unit = unit_folder.read(session.folder)
    assert unit.channels == load_bench(tmp_path / "bench.toml").rig.channels
    session.close()
    bench.close()


def test_a_unit_s_own_channels_hold(simulated, rig, tmp_path, monkeypatch):
    """[channels] of the unit say how its records are read: the rig's do not replace them."""
    monkeypatch.setattr("accept.commands.bench.hw.STABLE_S", 0.1)
    unit = tmp_path / "ST-09"
    toml_edit.begin(unit, "ST-09", "strut")
    (unit / "unit.toml").write_text((unit / "unit.toml").read_text() + '[channels]\nVa = "drive"\n')
    entries = tomllib.loads((simulated / "unit.toml").read_text())["frf"]
    file_log(simulated / entries["low"], rig / "low.mat")
    words = ("hw", "pickup", unit, "--bench", tmp_path / "bench.toml", "--wait", 1, "--old")
    done = run(*words)
    assert done.exit_code == 6
    assert "'Va' (here 'drive')" in done.output
    found = records.read(simulated / entries["low"], CHECKS["frf"].inputs["low"])
    content = {"t": found.t, "drive": found["Va"], **{c: found[c] for c in ("Vs", "de", "da")}}
    savemat(rig / "low.mat", content)
    assert run("hw", "pickup", rig, unit, "frf", "low", "--wait", 5, "--old").exit_code == 0
    assert run(*words).exit_code == 4  # one of two
    assert tomllib.loads((unit / "unit.toml").read_text())["channels"] == {"Va": "drive"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"DAC_1"', "3"), "Va"),
        (("gain = 1e-12", "gian = 1e-12"), "unknown key"),
        (('unit = "nm"', "sampling_time_s = 1e-4"), "stands alone"),
    ],
)
def test_a_rig_that_cannot_be(rig, tmp_path, change, words):
    path = tmp_path / "bench.toml"
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(SpecError, match=words):
        load_bench(path)


def test_without_a_rig_the_record_must_be_named(tmp_path):
    (tmp_path / "bench.toml").write_text('name = "b"\n[instruments.e]\ndriver = "offline"\nmeasures = ["frf"]\n')
    toml_edit.begin(tmp_path / "U", "U-1", "apa")
    for words in ((tmp_path / "U",), (tmp_path, tmp_path / "U", "frf")):
        assert run("hw", "pickup", *words, "--bench", tmp_path / "bench.toml").exit_code == 6
