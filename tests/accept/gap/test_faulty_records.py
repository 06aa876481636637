"""What judging refuses is refused by every command that fits a model, for the same cause in the same words."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import accept
from accept.cli.main import app
from accept.gap.unit_responses import responses
from checks.cause import Cause
from checks.errors import RecordError
from checks.signals.sampling_faults import sampling_faults
from specs.errors import AcceptError
from tests.accept.gap.faulty_records import FAULTS, AT_s, clipped, columns, lost, read_record, spoilt_unit
from tests.accept.units.units import DATA
from tests.checks.model.units_model import needs_data
from tests.shared.recorded_units import RecordedUnits
from tests.soak import SOAK


@pytest.fixture(scope="module")
def source(recorded_units: RecordedUnits) -> Path:
    """A unit in which nothing is wrong."""
    return recorded_units.folder("S-01")


@pytest.fixture(scope="module")
def spoilt(source: Path, tmp_path_factory: pytest.TempPathFactory):
    """The folder of the unit with a fault, made when it is first asked for."""
    place, made = tmp_path_factory.mktemp("faults"), {}

    def of(fault: str) -> Path:
        if fault not in made:
            made[fault] = spoilt_unit(source, place / fault.replace(" ", "-"), FAULTS[fault][0])
        return made[fault]

    return of


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_refused_by_its_cause(fault: str, spoilt) -> None:
    _, cause, channel = FAULTS[fault]
    with pytest.raises(RecordError) as refused:
        responses(spoilt(fault))
    reason = refused.value.reason
    assert reason.cause is cause
    assert (reason.record, reason.file) == ("low", "frf_noise.mat")
    assert reason.parameters.get("channel", "") == channel
    if "at_s" in reason.parameters:
        assert reason.parameters["at_s"] == pytest.approx(AT_s, abs=0.025)


@pytest.mark.parametrize("fault", ["de clipped", "de held", "block of all lost", "block of de lost", "jitter"])
def test_judging_says_the_same(fault: str, spoilt) -> None:
    with pytest.raises(RecordError) as refused:
        responses(spoilt(fault))
    judged = {f.quantity: f.cause for f in accept.judge(spoilt(fault)).findings}
    for quantity in ("axial_resonance_Hz", "dx_um", "dy_um"):
        assert judged[quantity] is not None
        assert str(judged[quantity]) == str(refused.value.reason), quantity


@pytest.mark.parametrize("command", ["gap", "misalign", "fit", "learn"])
def test_every_command_refuses_with_the_cause(
    command: str, spoilt, tmp_path: Path, recorded_units: RecordedUnits
) -> None:
    unit = spoilt("block of de lost")
    arguments = {
        "gap": ["gap", unit, "--out", tmp_path / "out"],
        "misalign": ["misalign", unit],
        "fit": ["model", "fit", unit],
        "learn": ["model", "learn", unit, *map(recorded_units.folder, ("S-02", "S-03")), "--out", tmp_path / "out"],
    }[command]
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    assert done.exit_code == 6, done.output
    assert "200 samples (20 ms) off from 3 s on" in " ".join(done.stderr.split())


@pytest.mark.parametrize("call", [accept.responses, accept.fit_model, accept.estimate_misalignment, accept.analyse_gap])
def test_the_api_refuses_too(call, spoilt) -> None:
    with pytest.raises(AcceptError) as refused:
        call(spoilt("Vs clipped"))
    assert refused.value.reason.cause is Cause.CHANNEL_CLIPPED


def test_a_fault_of_the_repeat_is_found(source: Path, tmp_path: Path) -> None:
    unit = spoilt_unit(source, tmp_path / "unit", lost(), "frf_noise_hf_2.mat")
    with pytest.raises(RecordError) as refused:
        responses(unit)
    assert refused.value.reason.cause is Cause.SAMPLES_LOST
    assert refused.value.reason.record == "high_repeat"


RECORDED = sorted(p.parent for p in DATA.glob("*/*/unit.toml")) or [DATA / "units" / "S-01"]


@needs_data
@pytest.mark.parametrize("unit", RECORDED if SOAK else [p for p in RECORDED if "-01" in p.name], ids=lambda p: p.name)
def test_recorded_units_are_sound(unit: Path) -> None:
    """On some hundred records of benches of four kinds nothing is refused; on one unit of each if it must be quick."""
    for record in accept.read_unit(unit).values("frf").values():
        if hasattr(record, "channels"):
            assert sampling_faults(record) == ()


HARMLESS = {  # what no sampling does: left to the fit, or to a remark
    "gain that drifts by 3 %": lambda c, y: y * (1.0 + 0.03 * np.linspace(0.0, 1.0, y.size)),
    "response that grows with the level": lambda c, y: y * (1.0 + 0.05 * np.abs(y - y.mean()) / y.std()),
    "delay": lambda c, y: np.interp(np.arange(y.size) - 2.3, np.arange(y.size), y),
    "hit": lambda c, y: y + _ringing(c["t"]) * y.std(),
}


def _ringing(t: np.ndarray) -> np.ndarray:
    since = np.maximum(t - t[0] - AT_s, 0.0)
    return 0.3 * np.exp(-5.0 * since) * np.sin(2.0 * np.pi * 85.0 * since)


@pytest.mark.parametrize("name", HARMLESS)
@pytest.mark.parametrize("file", ["frf_noise.mat", "frf_noise_hf.mat"])
def test_what_is_no_fault_of_sampling_is_not_called_so(name: str, file: str, source: Path) -> None:
    record = read_record(source / file)
    c = columns(source / file)
    changed = {k: x if k == "Va" else HARMLESS[name](c, x) for k, x in record.channels.items()}
    record = replace(record, channels=changed)
    assert not {r.cause for r in sampling_faults(record)} & {
        Cause.SAMPLES_LOST, Cause.SAMPLING_JITTER, Cause.CHANNEL_SLIPPED, Cause.CHANNEL_HELD,
    }  # fmt: skip


def test_findings_of_a_clipped_record_are_listed(source: Path, tmp_path: Path) -> None:
    """Batch writes the cause as data."""
    unit = spoilt_unit(source, tmp_path / "unit", clipped("Vs"))
    done = CliRunner().invoke(app, ["batch", str(unit), "--out", str(tmp_path / "out"), "--no-certificates"])
    assert done.exit_code == 4, done.output
    (judged,) = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
    causes = {f["quantity"]: f["cause"]["code"] for f in judged["findings"] if f["check"] in ("frf", "misalignment")}
    assert causes["dx_um"] == causes["axial_resonance_Hz"] == "channel_clipped"


def test_a_channel_that_stands_still_is_dead_and_not_clipped(source: Path) -> None:
    """A last digit that flickers at the end of the range of values is no range of the converter."""
    sound = read_record(source / "frf_noise.mat")
    digit = np.where(np.arange(sound["de"].size) % 7 == 0, 2.5e-9, 0.0)
    for still in (digit, np.zeros_like(digit)):
        assert sampling_faults(replace(sound, channels={**sound.channels, "de": still})) == ()
