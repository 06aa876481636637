"""A doubt stays with its evidence: what did not pass in an attempt does not pass later by the same recordings or
values, whatever was deleted, replaced or left out of the spec since. Editing files is all that is done here."""

import shutil
from collections.abc import Callable
from pathlib import Path
from time import sleep

import numpy as np
import pytest
from pypdf import PdfReader

from accept.store import open_store
from accept.store.payloads import UnitJudged
from hw.records import csv_bytes
from tests.accept.batch.test_parts import BAD, STRUT
from tests.accept.certificate import test_newest_measurement
from tests.accept.certificate.test_newest_measurement import accept, findings, judged, recorded
from tests.accept.units.test_calibration import INSTRUMENT
from tests.accept.units.test_inputs import UNIT
from tests.accept.units.units import DRIVE, LOOPS, make_unit, save_mat
from tests.checks.acceptance.play_model import Plays
from tests.checks.acceptance.test_response_consistency import again, good, unrelated_low
from tests.shared.recorded_units import RecordedUnits

_bench = test_newest_measurement._bench
CAPACITANCE, HYSTERESIS = LOOPS.index("[checks.capacitance"), LOOPS.index("[checks.hysteresis")
RESPONSES = """name = "responses"
kind = "apa"
title = "Responses"
[checks.frf.limits.axial_resonance_Hz]
lower = 80.0
upper = 110.0
unit = "Hz"
rule = "guarded"
source = "test"
"""
HIGHPASS = """
[checks.sensor_highpass]
required = false
[checks.sensor_highpass.limits.sensor_highpass_Hz]
lower = 1.0
upper = 10.0
unit = "Hz"
rule = "simple"
source = "test"
"""
RECORDS = """
serial = "A-1"
kind = "apa"
[frf]
low = "low.mat"
high = "high.mat"
low_repeat = "repeat.mat"
merge_Hz = 350
"""


def bench_text(hysteresis: str = "2099-01-01") -> str:
    due = {"capacitance": "2099-01-01", "hysteresis": hysteresis}
    return 'name = "b"\n' + "".join(INSTRUMENT.format(name=f"i_{c}", check=c, due=day) for c, day in due.items())


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    (tmp_path / "loops.toml").write_text(LOOPS)
    return tmp_path / "loops.toml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return recorded(tmp_path / "u" / "A-1", 1)


def edit(folder: Path, old: str, new: str) -> None:
    text = (folder / "unit.toml").read_text()
    assert old in text
    (folder / "unit.toml").write_text(text.replace(old, new))


def held() -> str:
    """What holds the unit by its last judgement."""
    with open_store() as store:
        last = store.latest("A-1", UnitJudged.KIND)
    assert last is not None
    return "; ".join(UnitJudged.of(last).result.nonconformances)


def page(pdf: Path) -> str:
    return " ".join(" ".join(p.extract_text() for p in PdfReader(pdf).pages).split())


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_the_repeat_that_contradicts_is_deleted(tmp_path: Path) -> None:
    """E6; with new records of the check the unit is accepted, and with one of the old ones it is not."""
    folder, spec = tmp_path / "u" / "A-1", written(tmp_path / "responses.toml", RESPONSES)
    folder.mkdir(parents=True)
    (folder / "unit.toml").write_text(RECORDS)
    for name, record in (("low", good()["low"]), ("high", good()["high"]), ("repeat", unrelated_low())):
        save_mat(folder / f"{name}.mat", t=record.t, **record.channels)
    assert judged(folder, spec) == "incomplete"
    edit(folder, 'low_repeat = "repeat.mat"\n', "")
    for _ in range(2):
        assert judged(folder, spec) == "conditional"
    assert held().startswith("frf: no result in attempt 1 of 20")
    assert "its recordings (low.mat, high.mat) are used again; repeat.mat is gone, unit.toml was changed" in held()
    save_mat(folder / "low.mat", t=again().t, **again().channels)
    assert judged(folder, spec) == "conditional"
    save_mat(folder / "high.mat", t=again(key="high").t, **again(key="high").channels)
    assert judged(folder, spec) == "accepted"


@pytest.mark.parametrize("now", ["", '[parts]\napa = "X-2"'])
def test_the_part_that_was_not_accepted_is_deleted_or_replaced(tmp_path: Path, now: str) -> None:
    """E7; the same part, accepted since, raises no doubt any more."""
    spec = written(tmp_path / "loops.toml", LOOPS[:CAPACITANCE].replace('"apa"', '"strut"') + LOOPS[HYSTERESIS:])
    folder, part = recorded(tmp_path / "u" / "A-1", 1), make_unit(tmp_path / "X-1", "X-1", BAD)
    judged_part = ("batch", part, "--spec", "apa-basic", "--out", tmp_path / "p", "--no-certificates")
    accept(*judged_part)
    (folder / "unit.toml").write_text(STRUT.replace("{{serial}}", "A-1").format(apa="X-1", file="loops.csv"))
    edit(folder, "{file}", "loops.csv")
    before = (folder / "unit.toml").read_text()
    assert judged(folder, spec) == "conditional"
    edit(folder, '[parts]\napa = "X-1"\njoint_bottom = "FJ-a"', now)
    assert judged(folder, spec) == "conditional"
    assert "hysteresis: conditional in attempt 1" in held()
    make_unit(part, "X-1")
    accept(*judged_part, "--reason", "measured again")
    (folder / "unit.toml").write_text(before)
    assert judged(folder, spec) == "accepted"


@pytest.mark.parametrize("now", ["", bench_text()], ids=["left out", "replaced"])
def test_the_bench_file_is_left_out_or_replaced(tmp_path: Path, spec: Path, folder: Path, now: str) -> None:
    """E8."""
    bench = written(tmp_path / "bench.toml", bench_text(hysteresis="2020-01-01"))
    assert judged(folder, spec, "--bench", bench) == "conditional"
    bench.write_text(now)
    assert judged(folder, spec, *(("--bench", bench) if now else ())) == "conditional"
    assert "used again; the bench file is another one or gone" in held()
    assert findings() == {"capacitance": "pass", "hysteresis": "conditional"}
    assert judged(recorded(folder, 2), spec, *(("--bench", bench) if now else ())) == "accepted"


def narrower(text: str) -> str:
    return text[:CAPACITANCE] + text[HYSTERESIS:]


def optional(text: str) -> str:
    return text.replace(
        "[checks.capacitance.limits", "[checks.capacitance]\nrequired = false\n[checks.capacitance.limits"
    )


def of_other_kind(text: str) -> str:
    return narrower(text).replace('"apa"', '"strut"')


@pytest.mark.parametrize("change", [narrower, optional, of_other_kind])
def test_another_spec_leaves_out_what_failed(
    tmp_path: Path, spec: Path, folder: Path, change: Callable[[str], str]
) -> None:
    """E9. Of a unit that is measured anew, and of one that passed the check since, nothing is left to hold."""
    other = written(tmp_path / "other.toml", change(LOOPS).replace('"loops"', '"other"'))
    edit(folder, "sensor_uF = 4.99", "sensor_uF = 4.1")
    assert judged(folder, spec) == "rejected"
    if change is of_other_kind:
        edit(folder, 'kind = "apa"', 'kind = "strut"')
    if change is optional:
        edit(folder, "[capacitance]\nsensor_uF = 4.1\nactuator_uF = 9.85\n", "")
    assert judged(folder, other) == "conditional"
    assert "capacitance: fail in attempt 1" in held()
    assert "the spec does not require sensor_uF now" in held()
    if change is not of_other_kind:
        assert judged(recorded(folder, 1, sensor=4.97), spec) == "accepted"
        assert judged(folder, other) == "accepted"


def test_what_is_missing_is_left_out_of_the_spec(tmp_path: Path, spec: Path, folder: Path) -> None:
    """E9; what is measured later is new."""
    (folder / "unit.toml").write_text((folder / "unit.toml").read_text().replace("sensor_uF = 4.99\n", ""))
    assert judged(folder, spec) == "incomplete"
    assert judged(folder, written(tmp_path / "other.toml", narrower(LOOPS))) == "conditional"
    assert judged(recorded(folder, 1), spec) == "accepted"


def test_a_spec_that_quality_assurance_approved_since_judges_the_same_data(
    tmp_path: Path, spec: Path, folder: Path
) -> None:
    """Neither before it is approved, nor with other data, nor by the approved one of another name."""
    edit(folder, "sensor_uF = 4.99", "sensor_uF = 4.3")
    assert judged(folder, spec) == "rejected"
    revised = LOOPS.replace("lower = 4.4", "lower = 4.2")
    spec.write_text(revised)
    other = written(tmp_path / "other.toml", revised.replace('"loops"', '"other"'))
    assert judged(folder, spec) == "conditional"
    sleep(1.0)  # an approval states whole seconds: one of the same second is none since
    for each in (spec, other):
        assert accept("spec", "approve", each).exit_code == 0
    assert judged(folder, other) == "conditional"
    assert judged(folder, spec) == "accepted"
    edit(folder, "actuator_uF = 9.85", "actuator_uF = 9.85\n[notes]\ncapacitance = ['cold']")
    assert judged(folder, spec) == "conditional"


@pytest.mark.parametrize("all_typed", [False, True])
def test_a_number_is_typed_in_place_of_the_recording(
    tmp_path: Path, recorded_units: RecordedUnits, all_typed: bool
) -> None:
    """E10. A recording of its own is new."""
    folder = tmp_path / "u" / "A-1"
    folder.mkdir(parents=True)
    shutil.copy(next(recorded_units.folder("A-01").glob("add_mass_closed*.mat")), folder / "closed.mat")
    (folder / "unit.toml").write_text(UNIT.replace('"A-9"', '"A-1"').format(mass_kg=5.9))
    assert judged(folder, "apa-basic") == "rejected"
    edit(folder, 'closed_circuit = "closed.mat"\nmass_kg = 5.9', "k_N_per_um = 1.69")
    if all_typed:
        for old, new in (("4.9", "4.91"), ("9.8", "9.81"), ("366", "366.5"), ("0.5, 1, 2, 0]", "0.5, 1, 2.5, 0]")):
            edit(folder, old, new)
    assert judged(folder, "apa-basic") == "conditional"
    assert "stiffness: fail in attempt 1" in held()
    assert "and is typed now; closed.mat is gone" in held()


def test_the_day_of_measuring_is_deleted(tmp_path: Path, spec: Path, folder: Path) -> None:
    """E17, as are the next three."""
    text = bench_text().replace('"C-i_hysteresis", ', '"C-i_hysteresis", calibrated = 2020-01-01, ')
    bench = ("--bench", written(tmp_path / "bench.toml", text))
    edit(folder, "[hysteresis]", "[measured]\nhysteresis = 2019-06-01\n[hysteresis]")
    assert judged(folder, spec, *bench) == "conditional"
    edit(folder, "[measured]\nhysteresis = 2019-06-01\n", "")
    assert judged(folder, spec, *bench) == "conditional"


def test_the_map_of_channels_is_deleted(spec: Path, folder: Path) -> None:
    """The file has another channel of that name, so other samples are read from the same file."""
    rng = np.random.default_rng(3)
    good_one, bad_one = (Plays.of(gain=24e-6, share=s, largest=4.5, count=60).response(DRIVE) for s in (0.15, 0.4))
    columns = {"t": np.arange(DRIVE.size) * 1e-3, "Va": DRIVE}
    for name, motion in (("de", good_one), ("da", bad_one)):
        columns[name] = 2.5e-9 * np.round((motion + 4e-9 * rng.standard_normal(motion.size)) / 2.5e-9)
    (folder / "loops.csv").write_bytes(csv_bytes(columns))
    edit(folder, "[hysteresis]", '[channels]\nde = { name = "da" }\n[hysteresis]')
    assert judged(folder, spec) in ("rejected", "conditional", "incomplete")
    edit(folder, '[channels]\nde = { name = "da" }\n', "")
    assert judged(folder, spec) == "conditional"


def test_a_section_with_the_same_recording_is_deleted(spec: Path, folder: Path) -> None:
    """Of which of the two it is a recording is not known."""
    shutil.copy(folder / "loops.csv", folder / "copy.csv")
    spec.write_text(LOOPS + HIGHPASS)
    edit(folder, "[hysteresis]", '[sensor_highpass]\nwith_resistor = "copy.csv"\nresistor_ohm = 80000.0\n[hysteresis]')
    columns = np.genfromtxt(folder / "copy.csv", delimiter=",", names=True)
    named = {name: columns[name] for name in columns.dtype.names or ()}
    (folder / "copy.csv").write_bytes(csv_bytes(named | {"Vs": 1e5 * named["de"]}))
    assert judged(folder, spec) == "incomplete"
    edit(folder, '[sensor_highpass]\nwith_resistor = "copy.csv"\nresistor_ohm = 80000.0\n', "")
    assert judged(folder, spec) == "conditional"


def test_the_note_of_a_nonconformance_is_deleted(spec: Path, folder: Path) -> None:
    edit(folder, "[hysteresis]", '[notes]\nhysteresis = ["NONCONFORMANCE: chipped"]\n[hysteresis]')
    assert judged(folder, spec) == "conditional"
    edit(folder, '[notes]\nhysteresis = ["NONCONFORMANCE: chipped"]\n', "")
    assert judged(folder, spec) == "conditional"


def test_quality_assurance_releases_it_which_is_stated(tmp_path: Path, spec: Path, folder: Path) -> None:
    bench = written(tmp_path / "bench.toml", bench_text(hysteresis="2020-01-01"))
    assert judged(folder, spec, "--bench", bench) == "conditional"
    pdf = tmp_path / "1.pdf"
    assert accept("report", folder, "--spec", spec, "--out", pdf, "--reason", "again").exit_code == 4
    assert "hysteresis: conditional in attempt 1" in page(pdf)
    assert "A-1 held" in accept("verify", pdf).output
    assert accept("store", "dispose", "A-1", "--disposition", "use-as-is", "--because", "checked").exit_code == 0
    for number in range(2):
        pdf = tmp_path / f"{number + 2}.pdf"
        done = accept("report", folder, "--spec", spec, "--out", pdf, "--reason", "again")
        assert done.exit_code == 0, done.output
        said = " ".join(accept("verify", pdf).output.split())
        assert "conceded: hysteresis: conditional in attempt 1" in said, said


def test_what_failed_is_measured_again_and_the_rest_is_kept(spec: Path, folder: Path) -> None:
    """Also a failed recording beside typed values that passed."""
    recorded(folder, 1, share=3.0)
    assert judged(folder, spec) == "rejected"
    assert judged(recorded(folder, 2), spec) == "accepted"
