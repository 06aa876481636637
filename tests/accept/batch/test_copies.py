"""One recording under two serials, in two sections or two attempts counts for none of them until it is resolved."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from accept.base.documents.results import Information, UnitRecord
from accept.base.home import home
from accept.certificate import read_contents
from accept.certificate.trust import keys
from accept.certificate.verify.stated_check import check_copies
from accept.judging.rules import reserved
from accept.store import fold, open_store
from accept.store.decisions import recording_party
from accept.store.payloads import CopiesResolved, UnitJudged
from checks.cause import Cause
from checks.quantity import Quantity
from checks.verdict import UnitVerdict, judge
from hw.records import csv_bytes
from specs.spec import Limit
from tests.accept.units.units import DRIVE, GOOD, LOOPS, save_mat
from tests.checks.acceptance.play_model import Plays
from tests.shared.command_line import accept

UNCERTIFIED = "--no-certificates"  # where only the verdict is asked
UNIT = """
serial = "{serial}"
kind = "apa"
[capacitance]
sensor_uF = 4.99
actuator_uF = 9.85
[hysteresis]
record = "{file}"
"""
MOTION = Plays.of(gain=24e-6, share=0.15, largest=4.5, count=60).response(DRIVE)


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "loops.toml"
    path.write_text(LOOPS)
    return path


def columns(seed: int) -> dict[str, np.ndarray]:
    de = MOTION + 4e-9 * np.random.default_rng(seed).standard_normal(MOTION.size)
    return {"t": np.arange(de.size) * 1e-3, "Va": DRIVE, "de": 2.5e-9 * np.round(de / 2.5e-9)}


def unit(folder: Path, serial: str, seed: int, file: str = "h.mat", text: str = UNIT) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "unit.toml").write_text(text.format(serial=serial, file=file))
    if file.endswith(".csv"):
        data = {k: v.astype(np.float32).astype(float) for k, v in columns(seed).items() if k != "t"}
        (folder / file).write_bytes(csv_bytes({"t": columns(seed)["t"], **data}))
    else:
        save_mat(folder / file, **columns(seed))
    return folder


def verdicts(out: Path) -> dict[str, str]:
    return {u["serial"]: u["verdict"] for u in json.loads((out / "results.json").read_text())["units"]}


def batch(out: Path, spec: Path | str, *words: object) -> Result:
    return accept("batch", *words, "--spec", spec, "--out", out)


@pytest.fixture(autouse=True)
def _quality_assurance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whose recording it is quality assurance decides, with a key of its own."""
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")


def test_one_recording_belongs_to_one_unit_and_quality_assurance_signs(
    tmp_path: Path, spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for serial in ("A-1", "X-1"):
        unit(tmp_path / "units" / serial, serial, 1)
    words = ("batch", tmp_path / "units", "--spec", spec, "--out", tmp_path / "out")
    accept(*words)
    both = ("--measured", "A-1", "--measured", "X-1", "--reason", "both were on the bench")
    refused = accept("store", "resolve", "X-1", *both)
    assert (refused.exit_code, "measured at one unit" in refused.stderr) == (6, True), refused.output
    with monkeypatch.context() as patch:
        for name in ("ACCEPT_QA_PASSPHRASE", "ACCEPT_PASSPHRASE"):
            patch.delenv(name)
        assert accept("store", "resolve", "X-1", "--measured", "A-1", "--reason", "typed").exit_code == 6
    with open_store() as store:  # by a program of its own, in QA's name and without her signature
        judged = {s: UnitJudged.of(store.latest(s, UnitJudged.KIND)).result for s in ("A-1", "X-1")}
        parties = tuple(recording_party(s, name, held) for s, r in judged.items() for name, held in r.samples.items())
        chosen = tuple(("X-1", name) for name in judged["X-1"].samples)
        store.write(CopiesResolved(parties, chosen, "typed"), "X-1", who="Grace")
    assert accept(*words).exit_code == 4
    assert accept("store", "resolve", "X-1", "--measured", "A-1", "--reason", "X-1 was not there").exit_code == 0
    accept(*words)
    assert accept("verify", tmp_path / "out/certificates/A-1.pdf", "--require", "accepted").exit_code == 0
    assert accept("verify", tmp_path / "out/certificates/X-1.pdf", "--require", "accepted").exit_code == 3
    contents = read_contents((tmp_path / "out/certificates/A-1.pdf").read_bytes())
    unsigned = [{**c, "resolved": {**c["resolved"], "signed": None}} for c in contents.result["copies"]]
    forged = replace(contents, result={**contents.result, "copies": unsigned})
    steps = check_copies(forged, [keys.ca(home())], [])
    assert not steps[0].complete
    assert check_copies(contents, [keys.ca(home())], []) == []


def test_a_copy_under_two_serials_counts_for_neither_until_it_is_resolved(tmp_path: Path, spec: Path) -> None:
    """Stored by another program, in another container, in single precision; in one batch."""
    units, out = tmp_path / "units", tmp_path / "out"
    unit(units / "A", "A-1", 1)
    unit(units / "B", "B-1", 1, "copied.csv")
    unit(units / "C", "C-1", 2)
    done = batch(out, spec, units)
    assert verdicts(out) == {"A-1": "incomplete", "B-1": "incomplete", "C-1": "accepted"}, done.output
    assert "hysteresis/record of B-1" in done.output
    certificate = out / "certificates" / "A-1.pdf"
    for pdf in (certificate, out / "certificates" / "B-1.pdf"):
        verified = accept("verify", pdf)
        assert "incomplete" in verified.stdout
        assert "copies: hysteresis/record holds the samples of" in verified.stderr
    assert verdicts_again(out, spec, units) == {"A-1": "incomplete", "B-1": "incomplete", "C-1": "accepted"}
    listed = accept("store", "copies")
    assert (listed.exit_code, listed.stdout.count("open")) == (4, 2)

    for words in (["--measured", "A-1", "--reason", " "], ["--measured", "C-1", "--reason", "x"]):
        assert accept("store", "resolve", "A-1", *words).exit_code == 6
    said = accept("store", "resolve", "A-1", "--measured", "A-1", "--reason", "B-1 was not on the bench")
    assert said.exit_code == 0, said.output
    assert verdicts_again(out, spec, units) == {"A-1": "accepted", "B-1": "incomplete", "C-1": "accepted"}
    assert "B-1 was not on the bench" in accept("verify", certificate).stderr
    assert "B-1 was not on the bench" in accept("store", "log", "A-1").stdout
    assert accept("store", "copies").exit_code == 0
    unit(units / "D", "D-1", 1)  # a third one: what was resolved was between two
    assert verdicts_again(out, spec, units)["A-1"] == "incomplete"


def verdicts_again(out: Path, spec: Path | str, *words: object) -> dict[str, str]:
    batch(out, spec, *words)
    return verdicts(out)


def test_a_copy_of_a_unit_judged_earlier_is_found_in_the_store(tmp_path: Path, spec: Path) -> None:
    """By `report`; the earlier unit's certificate no longer verifies plainly at this bench and is not countersigned."""
    first, second = tmp_path / "a.pdf", tmp_path / "b.pdf"
    assert accept("report", unit(tmp_path / "A", "A-1", 1), "--spec", spec, "--out", first).exit_code == 0
    assert accept("verify", first).exit_code == 0
    copied = accept("report", unit(tmp_path / "B", "B-1", 1), "--spec", spec, "--out", second)
    assert (copied.exit_code, "A-1 was judged with a recording" in copied.stderr) == (4, True), copied.output
    found = accept("verify", first)
    assert (found.exit_code, "hysteresis/record is also B-1" in found.output) == (4, True), found.output
    assert accept("countersign", first).exit_code == 4
    with open_store() as store:
        assert store.check() is None
        units = [fold(store.events(serial)) for serial in ("A-1", "B-1")]
    assert [unit and unit.verdict for unit in units] == ["incomplete", "incomplete"]
    assert "copied: hysteresis/record" in accept("store", "log", "A-1").stdout


@pytest.mark.parametrize("file", ["h.mat", "copied.csv"])
def test_a_copy_without_its_first_sample_is_no_other_units(tmp_path: Path, spec: Path, file: str) -> None:
    """Red before: both were accepted."""
    from scipy.io import loadmat

    first, second = (unit(tmp_path / "units" / serial, serial, 1, file) for serial in ("A-1", "B-1"))
    assert first != second
    if file.endswith(".csv"):
        head, _, *rows = (second / file).read_text().splitlines()
        (second / file).write_text("\n".join([head, *rows]) + "\n")
    else:
        held = {k: v.ravel()[1:] for k, v in loadmat(second / file).items() if not k.startswith("_")}
        save_mat(second / file, **held)
    batch(tmp_path / "out", spec, tmp_path / "units", UNCERTIFIED)
    assert verdicts(tmp_path / "out") == {"A-1": "incomplete", "B-1": "incomplete"}


def test_one_recording_in_two_sections_counts_in_neither(tmp_path: Path, spec: Path) -> None:
    text = UNIT + '[stiffness]\nclosed_circuit = "{file}"\nmass_kg = 6.4\n'
    spec.write_text(
        LOOPS + '[checks.stiffness]\nrequired = false\n[checks.stiffness.limits.k_closed_N_per_um]\nlower = 1.0\n'
        'unit = "N/um"\nrule = "simple"\nsource = "test"\n'
    )  # fmt: skip
    batch(tmp_path / "out", spec, unit(tmp_path / "A", "A-1", 1, text=text), UNCERTIFIED)
    (entry,) = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
    found = {f["quantity"]: f for f in entry["findings"]}
    assert found["hysteresis_percent"]["cause"]["code"] == "samples_copied"
    assert found["k_closed_N_per_um"]["cause"]["code"] == "samples_copied"
    assert found["sensor_uF"]["verdict"] == "pass"


def test_one_recording_that_goes_over_to_another_section_is_a_copy(tmp_path: Path, spec: Path) -> None:
    """In the same folder, with another recording in its place."""
    spec.write_text(
        LOOPS + '[checks.stiffness]\nrequired = false\n[checks.stiffness.limits.k_closed_N_per_um]\nlower = 1.0\n'
        'unit = "N/um"\nrule = "simple"\nsource = "test"\n'
    )  # fmt: skip
    batch(tmp_path / "out", spec, unit(tmp_path / "A", "A-1", 1))
    text = UNIT + '[stiffness]\nclosed_circuit = "h.mat"\nmass_kg = 6.4\n'
    batch(tmp_path / "out", spec, unit(tmp_path / "A", "A-1", 2, "other.mat", text))
    (entry,) = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
    found = {f["quantity"]: f for f in entry["findings"]}
    assert found["k_closed_N_per_um"]["cause"]["code"] == "samples_copied"
    assert found["hysteresis_percent"]["verdict"] == "pass"


def test_judging_again_and_measuring_again_are_no_copies(tmp_path: Path, spec: Path) -> None:
    """The same folder, the folder moved and one added to it; a golden unit measured ten times in folders of its own."""
    folder, out = unit(tmp_path / "A", "A-1", 1), tmp_path / "out"
    assert verdicts_again(out, spec, folder, UNCERTIFIED) == {"A-1": "accepted"}
    (folder / "unit.toml").write_text(UNIT.format(serial="A-1", file="h.mat").replace("4.99", "4.98"))
    assert verdicts_again(out, spec, folder, UNCERTIFIED) == {"A-1": "accepted"}
    moved = Path(shutil.move(folder, tmp_path / "archive"))
    assert verdicts_again(out, spec, moved, UNCERTIFIED) == {"A-1": "accepted"}
    for seed in range(10, 20):
        assert verdicts_again(out, spec, unit(tmp_path / f"G{seed}", "G-1", seed), UNCERTIFIED) == {"G-1": "accepted"}
    assert accept("store", "copies").stdout == ""


def test_a_record_of_an_earlier_attempt_is_no_second_measurement(tmp_path: Path, spec: Path) -> None:
    """As the workflow keeps attempts: one folder each below that of the serial."""
    place, out = tmp_path / "units" / "A-1", tmp_path / "out"
    assert verdicts_again(out, spec, unit(place / "attempt-1", "A-1", 1), UNCERTIFIED) == {"A-1": "accepted"}
    assert verdicts_again(out, spec, unit(place / "attempt-2", "A-1", 1), UNCERTIFIED) == {"A-1": "incomplete"}
    accept("store", "resolve", "A-1", "--measured", "A-1", "--reason", "only the capacitance was measured anew")
    assert verdicts_again(out, spec, place / "attempt-2", UNCERTIFIED) == {"A-1": "accepted"}


def typed(folder: Path, serial: str, stroke_um: float = 373.2, heights: str = "42, 45.5, 52.5, 46") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    text = GOOD.replace("{serial}", serial).replace("42, 45.5, 52.5, 46", heights)
    (folder / "unit.toml").write_text(text.replace("373.2", str(stroke_um)))
    return folder


def test_readings_that_are_all_those_of_another_serial_were_not_measured_twice(tmp_path: Path) -> None:
    """In one batch, against the store and in a certificate that is judged again; one reading of its own is enough."""
    units, out = tmp_path / "units", tmp_path / "out"
    typed(units / "A", "A-1")
    typed(units / "B", "B-1")
    typed(units / "C", "C-1", stroke_um=373.3)
    assert verdicts_again(out, "apa-basic", units) == {"A-1": "incomplete", "B-1": "incomplete", "C-1": "accepted"}
    (entry, *_) = json.loads((out / "results.json").read_text())["units"]
    assert {f["cause"]["code"] for f in entry["findings"]} == {"samples_copied"}
    assert "typed values: holds the same data as capacitance/typed values of B-1" in entry["findings"][1]["reason"]
    certificate = out / "certificates" / "A-1.pdf"
    assert "valid: A-1 incomplete" in accept("verify", certificate).stdout

    later = batch(tmp_path / "later", "apa-basic", typed(tmp_path / "D", "D-1", stroke_um=373.3))
    assert (verdicts(tmp_path / "later"), "C-1 was judged" in later.output) == ({"D-1": "incomplete"}, True)
    accept("store", "resolve", "A-1", "--measured", "A-1", "--reason", "B-1 was entered from A-1's sheet")
    assert verdicts_again(out, "apa-basic", units) == {"A-1": "accepted", "B-1": "incomplete", "C-1": "incomplete"}


def test_few_readings_may_be_equal_and_one_unit_may_be_typed_again(tmp_path: Path) -> None:
    """Five different ones of two digits; another folder, and one section more, of the same serial."""
    units, out = tmp_path / "units", tmp_path / "out"
    for serial in ("A-1", "B-1"):
        typed(units / serial, serial, heights="3.5, 3.5, 3.5, 3.5")
    assert verdicts_again(out, "apa-basic", units, UNCERTIFIED) == {"A-1": "accepted", "B-1": "accepted"}
    for name, text in (("one", ""), ("two", ""), ("three", '[hysteresis]\nrecord = "h.mat"\n')):
        folder = typed(tmp_path / name, "C-1")
        (folder / "unit.toml").write_text((folder / "unit.toml").read_text() + text)
        assert verdicts_again(out, "apa-basic", folder, UNCERTIFIED) == {"C-1": "accepted"}
    assert accept("store", "copies").stdout == ""


def test_the_index_is_held_against_the_events_and_made_anew_by_a_restored_backup(tmp_path: Path, spec: Path) -> None:
    """Without its rows in the index a copy would not be found: that is a fault of the store like any other."""
    import sqlite3

    batch(tmp_path / "out", spec, unit(tmp_path / "A", "A-1", 1))
    file = home() / "store.sqlite"
    assert accept("store", "backup", tmp_path / "b.sqlite").exit_code == 0
    with sqlite3.connect(file) as database:
        assert database.execute("DELETE FROM samples").rowcount > 0
    database.close()
    done = batch(tmp_path / "out", spec, tmp_path / "A")
    assert (done.exit_code, "index of samples" in done.stderr) == (6, True), done.output
    assert accept("store", "restore", tmp_path / "b.sqlite").exit_code == 0
    assert accept("store", "check").exit_code == 0
    assert keys.exist(home())


def test_a_decision_of_a_key_that_was_lost_counts_for_nothing(tmp_path: Path, spec: Path) -> None:
    """Its finder dates it as he likes: at the bench it is open again, and its certificate is not plainly valid."""
    out = tmp_path / "out"
    units = [unit(tmp_path / "A", "A-1", 1), unit(tmp_path / "B", "B-1", 1)]
    batch(out, spec, *units)
    accept("store", "resolve", "A-1", "--measured", "A-1", "--reason", "B-1 was not on the bench")
    assert verdicts_again(out, spec, *units) == {"A-1": "accepted", "B-1": "incomplete"}
    assert accept("verify", out / "certificates" / "A-1.pdf").exit_code == 0
    phrase = keys.folder(home()) / keys.AUTHORITY_PASSPHRASE
    done = accept("keys", "revoke", "Grace", "--reason", "lost", "--passphrase-file", phrase)
    assert done.exit_code == 0, done.output
    done = accept("verify", out / "certificates" / "A-1.pdf")
    assert (done.exit_code, "lost or compromised" in done.stdout) == (4, True), done.output
    assert verdicts_again(out, spec, *units) == {"A-1": "incomplete", "B-1": "incomplete"}


def test_a_decision_is_about_the_recording_that_was_there(tmp_path: Path, spec: Path) -> None:
    """Another recording under the name of the one that was decided about is another party."""
    out = tmp_path / "out"
    units = [unit(tmp_path / "A", "A-1", 1), unit(tmp_path / "B", "B-1", 1)]
    batch(out, spec, *units)
    accept("store", "resolve", "A-1", "--measured", "A-1", "--reason", "B-1 was not on the bench")
    batch(out, spec, *units)
    contents = read_contents((out / "certificates" / "A-1.pdf").read_bytes())
    roots = [keys.ca(home())]
    assert check_copies(contents, roots, ()) == []
    (name,) = [copy["sample"] for copy in contents.result["copies"]]
    other = {**contents.result, "samples": {**contents.result["samples"], name: {"de": "of another day"}}}
    (step,) = check_copies(replace(contents, result=other), roots, ())
    assert not step.complete


@pytest.mark.parametrize("more", [(), ("--no-certificates",)], ids=["certified", "judged only"])
def test_a_run_makes_one_attempt_of_each_unit(tmp_path: Path, spec: Path, more: tuple[str, ...]) -> None:
    """Found in the run that judged both first, the copy makes one more of the unit that was judged before."""
    for serial in ("A-1", "X-1"):
        unit(tmp_path / "units" / serial, serial, 1)
    words = ("batch", tmp_path / "units", "--spec", spec, "--out", tmp_path / "out", "--workers", 1, *more)

    def attempts() -> dict[str, int]:
        accept(*words)
        with open_store() as store:
            return {serial: len(list(store.events(serial, UnitJudged.KIND))) for serial in ("A-1", "X-1")}

    assert attempts() == {"A-1": 2, "X-1": 1}
    assert verdicts(tmp_path / "out") == {"A-1": "incomplete", "X-1": "incomplete"}
    accept("store", "resolve", "A-1", "--measured", "A-1", "--reason", "X-1 was not on the bench that day")
    assert attempts() == {"A-1": 3, "X-1": 2}
    assert verdicts(tmp_path / "out") == {"A-1": "accepted", "X-1": "incomplete"}
    assert attempts() == {"A-1": 3, "X-1": 2}
    for serial in ("A-1", "X-1") if not more else ():
        done = accept("verify", tmp_path / "out" / "certificates" / f"{serial}.pdf", "--require", "current")
        assert done.exit_code == 0, done.output


def test_a_copy_of_a_record_whose_check_is_not_installed_any_more() -> None:
    """Its package is gone; what the store has of it is withheld like all else."""
    limit = Limit(lower=1.0, unit="N", rule="simple", source="drawing")
    found = judge("torque", Quantity("torque_N", 2.0, 0.1), limit)
    none = judge("torque", Quantity.missing("pull_N", Cause.NOT_IN_DATA), limit)
    measured = Information("torque", "play_N", 0.1, "N", None)
    copy = {"sample": "torque/record", "with": [{"serial": "B-2", "sample": "torque/record"}], "withheld": True}
    kept = Information("friction", "friction_N", 0.1, "N", None)
    record = UnitRecord(
        serial="B-1", kind="apa", verdict=UnitVerdict.ACCEPTED, findings=(found, none), information=(measured, kept)
    )
    held = reserved(replace(record, copies=(copy,)))
    assert (held.verdict, held.information) == ("incomplete", (kept,))
    assert [f.value for f in held.findings] == [None, None]
