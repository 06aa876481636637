"""The same recording, read otherwise: another number beside the same samples makes nothing pass that did not."""

import json
import shutil
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from accept.base.home import home
from accept.certificate import read_contents
from accept.certificate.contents.content import CertificateContent
from accept.certificate.trust import keys
from accept.certificate.verify.against_store import check_store
from accept.certificate.verify.signatures import signatures_of
from tests.accept.units.test_inputs import HEAVY_KG, MASS_KG, UNIT
from tests.shared.command_line import accept
from tests.shared.recorded_units import RecordedUnits

LIGHT_KG = 5.9  # by which the recorded stiffness lies below its limit
QUANTITY = "k_closed_N_per_um"


@pytest.fixture(autouse=True)
def _quality_assurance(monkeypatch: pytest.MonkeyPatch) -> None:
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")


@pytest.fixture
def folder(recorded_units: RecordedUnits, tmp_path: Path) -> Path:
    place = tmp_path / "units" / "A-9"
    place.mkdir(parents=True)
    shutil.copy(next(recorded_units.folder("A-01").glob("add_mass_closed*.mat")), place / "closed.mat")
    return place


def judged(folder: Path, mass_kg: float, more: str = "", spec: Path | str = "apa-basic") -> dict[str, Any]:
    """Judge the folder again with this mass; returns its entry in results.json."""
    (folder / "unit.toml").write_text(UNIT.format(mass_kg=mass_kg) + more)
    out = folder.parents[1] / "out"
    accept("batch", folder, "--spec", spec, "--out", out, "--no-certificates", "--reason", "again")
    (entry,) = json.loads((out / "results.json").read_text())["units"]
    return entry


def stiffness(entry: dict[str, Any]) -> dict[str, Any]:
    return next(f for f in entry["findings"] if f["quantity"] == QUANTITY)


def test_another_mass_beside_the_same_recording_accepts_nothing(folder: Path) -> None:
    """Red before: accepted. It stays so however often it is judged, and until quality assurance voids the first one."""
    assert judged(folder, LIGHT_KG)["verdict"] == "rejected"
    for _ in range(2):
        entry = judged(folder, MASS_KG)
        assert entry["verdict"] == "conditional"
        assert "read otherwise: added mass 6.4 kg, before 5.9 kg (fail on" in stiffness(entry)["reason"]
        assert entry["rereadings"][QUANTITY]["was"] == "fail"
    again = accept("batch", folder, "--spec", "apa-basic", "--out", folder.parents[1] / "out", "--no-certificates")
    assert "unchanged" in again.output
    accept("store", "void", "A-9", "1", "--reason", "mass mistyped")
    entry = judged(folder, MASS_KG)
    assert entry["verdict"] == "accepted", [f["reason"] for f in entry["findings"]]


@pytest.mark.parametrize("source", ["{ gain = 0.5 }", '{ unit = "mm" }'])
def test_a_scale_that_is_taken_away_is_said(folder: Path, source: str) -> None:
    first = judged(folder, MASS_KG, f"[channels]\nde = {source}\n")
    assert first["verdict"] != "accepted"
    entry = judged(folder, MASS_KG)
    if stiffness(first)["value"] is None:  # no result was no measurement of it
        assert entry["verdict"] == "conditional"
    assert "before de is" in stiffness(entry)["reason"]


def test_another_setting_of_the_spec_is_said(folder: Path, tmp_path: Path) -> None:
    text = accept("spec", "copy", "apa-basic", tmp_path / "mine.toml") and (tmp_path / "mine.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace("mass_kg = 6.4", "mass_kg = 6.4\ngravity = 9.0"))
    assert judged(folder, MASS_KG, spec=tmp_path / "mine.toml")["verdict"] == "rejected"
    entry = judged(folder, MASS_KG)
    assert entry["verdict"] == "conditional"
    assert "before gravity = 9" in stiffness(entry)["reason"]


@pytest.mark.parametrize("cut", [0, 1])
def test_a_record_that_was_altered_in_its_file_accepts_nothing(folder: Path, cut: int) -> None:
    """Red before: accepted. All samples times a factor, that brings the stiffness into its limits, with the first
    sample dropped or not."""
    from scipy.io import loadmat, savemat

    file = folder / "closed.mat"
    recorded = {k: v for k, v in loadmat(file).items() if not k.startswith("_")}
    savemat(file, recorded | {"de": recorded["de"] * 1.15})
    assert judged(folder, MASS_KG)["verdict"] == "rejected"
    length = recorded["de"].size
    savemat(file, {k: v.reshape(-1, 1)[cut:] if v.size == length else v for k, v in recorded.items()})
    entry = judged(folder, MASS_KG)
    assert entry["verdict"] == "conditional", [f["reason"] for f in entry["findings"]]
    assert "read otherwise: closed.mat gives 1." in stiffness(entry)["reason"]
    assert entry["rereadings"][QUANTITY]["was"] == "fail"


def test_two_that_pass_are_a_remark_only(folder: Path) -> None:
    assert judged(folder, MASS_KG)["verdict"] == "accepted"
    entry = judged(folder, MASS_KG * 1.004)  # within the U of the mass
    assert entry["verdict"] == "accepted"
    assert "read otherwise: added mass 6.4256 kg, before 6.4 kg (pass on" in stiffness(entry)["note"]


def test_the_same_reading_again_is_no_remark(folder: Path) -> None:
    assert judged(folder, HEAVY_KG)["verdict"] == "conditional"
    (folder / "unit.toml").write_text((folder / "unit.toml").read_text() + '[notes]\nflatness = ["cleaned"]\n')
    assert "rereadings" not in judged(folder, HEAVY_KG)


def test_a_certificate_that_does_not_state_it_is_not_plainly_valid_at_its_bench(folder: Path, tmp_path: Path) -> None:
    assert judged(folder, LIGHT_KG)["verdict"] == "rejected"
    (folder / "unit.toml").write_text(UNIT.format(mass_kg=MASS_KG))
    pdf = tmp_path / "a.pdf"
    assert accept("report", folder, "--spec", "apa-basic", "--out", pdf, "--reason", "again").exit_code == 4
    contents = read_contents(pdf.read_bytes())
    assert accept("verify", pdf).exit_code == 0
    roots = [keys.ca(home())]
    signatures = signatures_of(pdf.read_bytes(), roots, datetime.now(UTC), (), ())

    def otherwise(stated: CertificateContent) -> list[str]:
        steps = check_store(pdf.read_bytes(), stated, signatures, None, roots)
        return [step.words for step in steps if not step.complete and "read otherwise" in step.words]

    assert otherwise(contents) == []
    findings = [f | {"verdict": "pass"} for f in contents.result["findings"]]
    result = {k: v for k, v in contents.result.items() if k != "rereadings"} | {"findings": findings}
    (words,) = otherwise(replace(contents, result=result))
    assert "5.9 kg" in words
