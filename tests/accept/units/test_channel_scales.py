"""A gain in unit.toml decides the verdict, so it is said, and is no acceptance unless the bench file states it too."""

import datetime
from pathlib import Path

import pytest
from scipy.io import loadmat, savemat

from accept.judging import calibration, judge_unit, load_spec
from accept.units import unit_folder
from checks.cause import Cause
from checks.verdict import Finding, UnitVerdict, Verdict
from hw.records.contents.variable import OWN_RECORD
from specs.bench import parse_bench
from tests.accept.units.test_calibration import bench_text
from tests.causes import causes
from tests.shared.recorded_units import RecordedUnits

HALF, TWICE = 0.55, 1.0 / 0.55
SPEC = load_spec("apa-basic")


@pytest.fixture
def folder(recorded_units: RecordedUnits, tmp_path: Path) -> Path:
    """A sound actuator whose recorded displacement is 0.55 of what it was: by its own records it is rejected."""
    for name in ("one_stack", "two_stacks"):
        m = loadmat(recorded_units.folder("A-01") / f"stroke_{name}.mat")
        kept = {k: v for k, v in m.items() if not k.startswith("__") and k != OWN_RECORD}
        savemat(tmp_path / f"{name}.mat", kept | {"d": HALF * m["d"]})
    (tmp_path / "unit.toml").write_text(
        'serial = "A-9"\nkind = "apa"\n[flatness]\nz_um = [0, -0.5, -2, 1, 0.5, 1, 2, 0]\n'
        "[capacitance]\nsensor_uF = 4.9\nactuator_uF = 9.8\n[stiffness]\nk_N_per_um = 1.7\n"
        '[stroke]\none_stack = "one_stack.mat"\ntwo_stacks = "two_stacks.mat"\n'
    )
    return tmp_path


def stroke(folder: Path, bench: str = "") -> tuple[Finding, list[str], UnitVerdict]:
    stated = None
    if bench:
        stated = calibration.statement(parse_bench(bench.encode(), "bench.toml"), SPEC.checks, datetime.date.today())
    result = judge_unit(unit_folder.read(folder), SPEC, stated)
    return next(f for f in result.findings if f.quantity == "stroke_um"), list(result.notes), result.verdict


def mapped(folder: Path, source: str) -> None:
    with (folder / "unit.toml").open("a") as file:
        file.write(f"[channels]\nd = {source}\n")


def test_the_record_alone_is_rejected(folder: Path) -> None:
    finding, _, verdict = stroke(folder)
    assert (finding.verdict, verdict) == (Verdict.FAIL, UnitVerdict.REJECTED)


@pytest.mark.parametrize("source", [f"{{ gain = {TWICE} }}", f'{{ unit = "mm", gain = {1e3 * TWICE} }}'])
def test_a_gain_of_the_unit_alone_is_said_and_accepts_nothing(folder: Path, source: str) -> None:
    """Red before: accepted, with no word of it on the page."""
    mapped(folder, source)
    finding, notes, verdict = stroke(folder)
    assert (finding.verdict, verdict) == (Verdict.CONDITIONAL, UnitVerdict.CONDITIONAL)
    assert Cause.CHANNEL_SCALED in causes(finding.cause)
    assert any("d is multiplied by" in note for note in notes)


def test_a_gain_that_the_bench_file_states_is_the_benchs(folder: Path) -> None:
    rig = bench_text(stroke="2030-01-01") + f'[rig]\nfolder = "in"\n[rig.channels]\nd = {{ gain = {TWICE} }}\n'
    mapped(folder, f"{{ gain = {TWICE} }}")
    assert Cause.CHANNEL_SCALED not in causes(stroke(folder, rig)[0].cause)
    text = (folder / "unit.toml").read_text()
    (folder / "unit.toml").write_text(text.replace(str(TWICE), str(1.01 * TWICE)))
    assert Cause.CHANNEL_SCALED in causes(stroke(folder, rig)[0].cause)


def test_another_name_is_no_scale(folder: Path) -> None:
    mapped(folder, '"d"')
    assert Cause.CHANNEL_SCALED not in causes(stroke(folder)[0].cause)
