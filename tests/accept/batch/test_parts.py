"""A strut with a part that was not accepted, or that stands in another strut, is conditional at best."""

import json
from pathlib import Path

import pytest

from accept.batch.judge_batch import BatchRequest, run
from accept.judging import load_spec
from accept.store import open_store
from accept.store.payloads import StepNoted
from tests.accept.batch.test_copies import accept, unit
from tests.accept.units.units import GOOD, LOOPS, make_unit

STRUT = """
serial = "{{serial}}"
kind = "strut"
[parts]
apa = "{apa}"
joint_bottom = "FJ-a"
[hysteresis]
record = "{{file}}"
"""
BAD = GOOD.replace("sensor_uF = 5.10", "sensor_uF = 1.72")


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    """Of loops alone: quick."""
    path = tmp_path / "loops.toml"
    head, loops = LOOPS.index("[checks.capacitance"), LOOPS.index("[checks.hysteresis")
    path.write_text(LOOPS[:head].replace('"apa"', '"strut"') + LOOPS[loops:])
    return path


def strut(folder: Path, serial: str, apa: str, seed: int) -> Path:
    return unit(folder / serial, serial, seed, text=STRUT.format(apa=apa))


def judged(tmp_path: Path, spec: Path, *folders: Path) -> dict[str, str]:
    """Serial -> verdict and what is said of it, in one batch of both kinds."""
    specs = {"apa": load_spec("apa-basic"), "strut": load_spec(str(spec))}
    with open_store() as store:
        run(BatchRequest(folders, tmp_path / "out", specs, "Ann", workers=1), store, print)
    units = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
    return {u["serial"]: "; ".join([u["verdict"], *u.get("part_doubts", [])]) for u in units}


def test_a_part_that_was_not_accepted_is_not_built_in_plainly(tmp_path: Path, spec: Path) -> None:
    """Known before, or judged after the strut in the same batch; accepted in the end; one that the store does not know
    changes nothing."""
    units = tmp_path / "units"
    strut(units, "A-S", "X-1", 1)  # judged before its APA, in order of path
    strut(units, "B-S", "never-judged", 2)
    make_unit(units / "X-1", "X-1", BAD)
    found = judged(tmp_path, spec, units)
    assert found["A-S"].startswith("conditional; apa X-1 was judged 'rejected' on 20")
    assert found["B-S"] == "accepted"
    assert judged(tmp_path, spec, units) == found
    make_unit(units / "X-1", "X-1")
    assert judged(tmp_path, spec, units) == {"A-S": "accepted", "B-S": "accepted", "X-1": "accepted"}


def test_a_part_stands_in_one_strut(tmp_path: Path, spec: Path) -> None:
    """Two struts of one batch, whichever came first, until one of them names another part; it is measured with that."""
    units = tmp_path / "units"
    make_unit(units / "X-1", "X-1")
    strut(units, "A-S", "X-1", 1)
    strut(units, "B-S", "X-1", 2)
    found = judged(tmp_path, spec, units)
    assert found["A-S"] == "conditional; apa X-1 stands in B-S too"
    assert found["B-S"] == "conditional; apa X-1 stands in A-S too"
    strut(units, "A-S", "X-2", 1)
    assert judged(tmp_path, spec, units) == {"A-S": "conditional", "B-S": "accepted", "X-1": "accepted"}
    strut(units, "A-S", "X-2", 3)
    assert judged(tmp_path, spec, units) == {"A-S": "accepted", "B-S": "accepted", "X-1": "accepted"}


def test_capitals_do_not_make_another_part(tmp_path: Path, spec: Path) -> None:
    """Misspelt where the part is known, or before it was: neither strut is accepted with a part of the other."""
    units = tmp_path / "units"
    assert judged(tmp_path, spec, strut(units, "A-S", "x-1", 1)) == {"A-S": "accepted"}  # of X-1 nothing is known yet
    make_unit(units / "X-1", "X-1", BAD)
    strut(units, "B-S", "X-1", 2)
    found = judged(tmp_path, spec, units)
    assert found["A-S"] == "conditional; apa x-1 differs from X-1, which the store knows, in capitals only"
    assert "conditional; apa X-1 was judged 'rejected'" in found["B-S"]
    assert found["B-S"].endswith("; apa X-1 stands in A-S too")


def test_a_certificate_states_what_speaks_against_a_part(tmp_path: Path, spec: Path) -> None:
    """It is judged again to the same; one from before the part was rejected no longer verifies plainly here."""
    before, after = tmp_path / "before.pdf", tmp_path / "after.pdf"
    folder = strut(tmp_path, "A-S", "X-1", 1)
    assert accept("report", folder, "--spec", spec, "--out", before).exit_code == 0
    accept("report", make_unit(tmp_path / "X-1", "X-1", BAD), "--spec", "apa-basic", "--out", tmp_path / "x.pdf")
    held = accept("verify", before)
    assert (held.exit_code, "apa X-1 was judged 'rejected'" in held.stdout) == (4, True), held.output
    done = accept("report", folder, "--spec", spec, "--out", after)
    assert (done.exit_code, "built in" in done.stderr) == (4, True), done.output
    verified = accept("verify", after)
    assert (verified.exit_code, "valid: A-S conditional" in verified.stdout) == (0, True), verified.output


def test_a_part_that_is_held_since_it_was_accepted(tmp_path: Path, spec: Path) -> None:
    units = tmp_path / "units"
    make_unit(units / "X-1", "X-1")
    strut(units, "S-1", "X-1", 1)
    assert set(judged(tmp_path, spec, units).values()) == {"accepted"}
    with open_store() as store:
        store.write(StepNoted("stroke", "frame cracked", nonconformance=True), "X-1", who="Ann")
    found = judged(tmp_path, spec, units / "S-1")["S-1"]
    assert found == "conditional; apa X-1 is held since it was accepted: stroke: frame cracked (Ann)"


def test_a_part_that_was_simulated_is_in_no_strut_that_was_measured(tmp_path: Path, spec: Path) -> None:
    units = tmp_path / "units"
    make_unit(units / "X-1", "X-1", "simulated = true\n" + GOOD)
    real, simulated = strut(units, "S-1", "X-1", 1), strut(tmp_path / "more", "S-1", "X-1", 1)
    assert judged(tmp_path, spec, units)["S-1"] == "conditional; apa X-1 was simulated"
    simulated.joinpath("unit.toml").write_text("simulated = true\n" + real.joinpath("unit.toml").read_text())
    assert judged(tmp_path, spec, simulated)["S-1"] == "accepted"
