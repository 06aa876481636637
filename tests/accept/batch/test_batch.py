"""The batch and the demo, as a script sees them: files, exit codes, what is judged again and what is refused."""

import csv
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from concurrent.futures.process import BrokenProcessPool
from datetime import UTC, datetime
from pathlib import Path

import pytest

from accept.base.child_processes import process_pool
from accept.base.home import home
from accept.batch.judge_batch import BatchRequest, run
from accept.certificate import content_of
from accept.certificate.page.document import render
from accept.certificate.signature.signing import sign
from accept.certificate.trust import keys
from accept.commands.trust.bench_keys import demo_credential
from accept.judging import judge_unit, load_spec
from accept.simulate import published_units
from accept.store import open_store
from accept.units import unit_folder
from specs.spec import builtin
from tests.accept.units.units import DATA, GOOD, make_unit
from tests.shared.command_line import accept
from tests.shared.demo_run import DemoRun

COLUMNS = ["serial", "kind", "unit_verdict", "check", "quantity", "value", "unit", "U", "lower", "upper", "rule",
           "verdict", "p_false_accept", "required", "reason", "gap", "attempt", "time", "operator",
           "simulated"]  # fmt: skip
recorded = pytest.mark.needs_data


def batch(*arguments: object, spec: str = "apa-basic"):
    return accept("batch", *arguments, "--spec", spec)


def results(out: Path) -> dict:
    return json.loads((out / "results.json").read_text())


def verdicts(out: Path) -> dict[str, str]:
    return {u["serial"]: u["verdict"] for u in results(out)["units"]}


@pytest.mark.slow
def test_demo(demo_run: DemoRun) -> None:
    """APA 3 is rejected for capacitance and stroke, by name; the others and the simulated strut are accepted. What is
    hidden in the strut is named, by a model that three others have taught what their batch has in common."""
    done, out = demo_run, demo_run.out
    assert done.exit_code == 0, done.output
    expected = {apa.serial: "accepted" for apa in published_units.SEED_APAS} | {"APA-03": "rejected"}
    assert verdicts(out) == expected | {"SIM-STRUT-04": "accepted"}
    third = next(u for u in results(out)["units"] if u["serial"] == "APA-03")
    failed = {f["quantity"] for f in third["findings"] if f["verdict"] == "fail"}
    assert failed == {"sensor_uF", "actuator_uF", "stroke_um"}
    assert len(list((out / "certificates").glob("*.pdf"))) == 8
    assert "8 of 8 verified" in done.stderr
    last = done.stdout.strip().splitlines()[-1]
    hidden = next(u for u in results(out)["units"] if u["serial"] == "SIM-STRUT-04")["gap"]
    named = hidden["named"][0]["parameters"]
    dx, dy = named["dx_um"]["value"], named["dy_um"]["value"]
    assert f"misalignment dx {dx:.0f} um, dy {dy:.0f} um named (truth 0, -170)" in last
    assert abs(dx) < 5.0
    for name, truth in (("dx_um", 0.0), ("dy_um", -170.0)):
        lo, hi = named[name]["ci95"]
        assert lo <= truth <= hi
    assert hidden["model"] == "strut, batch of 3"  # which has what the batch has in common
    assert max(hidden["gap_after"]["channels"].values()) < 1.0 < max(hidden["gap_before"]["channels"].values())
    assert (out / hidden["improved"]).is_file()
    row = next(line for line in done.stdout.splitlines() if "APA-07" in line)
    assert "18.7" in row  # as published
    assert "2.43" in row  # exact


@pytest.mark.slow
def test_demo_certificates_are_trusted_as_a_demo_only(
    demo_run: DemoRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The demo's key has no secret passphrase: what it signs is valid for the demo's own units and nothing else."""
    monkeypatch.setenv("ACCEPT_HOME", demo_run.home)
    for serial in ("APA-01", "SIM-STRUT-04"):
        pdf = demo_run.out / "certificates" / f"{serial}.pdf"
        assert accept("verify", pdf).exit_code == 3
        done = accept("verify", "--demo", pdf)
        assert (done.exit_code, done.stdout.startswith("DEMO")) == (0, True)
    folder = make_unit(tmp_path / "forged", "APA-01")
    spec = load_spec("apa-basic")
    judged = judge_unit(unit_folder.read(folder), spec)
    forged = render(content_of(judged, spec, folder, "me", provenance={"demo": True}))
    (tmp_path / "forged.pdf").write_bytes(sign(forged, demo_credential(home()), datetime.now(UTC)))
    done = accept("verify", "--demo", tmp_path / "forged.pdf")
    assert done.exit_code == 3
    assert "not a unit of the demo" in done.stdout


def test_results_json_csv_and_junit(tmp_path: Path) -> None:
    make_unit(tmp_path / "in" / "a", "A")
    make_unit(tmp_path / "in" / "b", "B", GOOD.replace("5.10", "1.72"))
    done = batch(tmp_path / "in", "--out", tmp_path / "out")
    assert done.exit_code == 3
    document = results(tmp_path / "out")
    assert document["spec"]["name"] == "apa-basic"
    assert len(document["spec"]["sha256"]) == 64
    a, b = document["units"]
    assert (a["serial"], a["kind"], a["verdict"], a["certificate"]) == ("A", "apa", "accepted", "certificates/A.pdf")
    assert list(a["inputs"]) == ["unit.toml"]
    sensor = next(f for f in b["findings"] if f["quantity"] == "sensor_uF")
    keys = {"check", "quantity", "value", "unit", "U", "lower", "upper", "rule", "verdict", "p_false_accept", "reason"}
    assert keys <= set(sensor)
    assert (sensor["value"], sensor["verdict"], sensor["p_false_accept"]) == (1.72, "fail", 0.0)
    assert sensor["reason"]
    rows = list(csv.DictReader((tmp_path / "out" / "results.csv").read_text(encoding="utf-8").splitlines()))
    assert list(rows[0]) == COLUMNS
    assert len(rows) == len(a["findings"]) + len(b["findings"])
    assert {row["attempt"] for row in rows} == {"1"}
    suites = ET.parse(tmp_path / "out" / "junit.xml").getroot()
    assert [(s.get("name"), s.get("failures")) for s in suites] == [("A", "0"), ("B", "1")]


def test_a_row_of_results_csv_says_who_judged_when_and_which_attempt(tmp_path: Path) -> None:
    """As the store has it; a unit that is unchanged keeps the time, the operator and the attempt of its judgement."""
    words = (tmp_path / "in", "--out", tmp_path / "out", "--no-certificates", "--operator")
    make_unit(tmp_path / "in" / "a", "A")
    make_unit(tmp_path / "in" / "b", "B")
    batch(*words, "Ada")
    make_unit(tmp_path / "in" / "b", "B", GOOD.replace("5.10", "1.72"))
    batch(*words, "Bob")
    rows = list(csv.DictReader((tmp_path / "out" / "results.csv").read_text(encoding="utf-8").splitlines()))
    with open_store() as store:
        times = [event.time for event in store.events(what="unit_judged")]
    told = dict.fromkeys((row["serial"], row["attempt"], row["time"], row["operator"]) for row in rows)
    assert list(told) == [("A", "1", times[0], "Ada"), ("B", "2", times[2], "Bob")]


def test_one_finding_per_quantity(tmp_path: Path) -> None:
    make_unit(tmp_path / "a", "A")
    batch(tmp_path / "a", "--out", tmp_path / "out", "--no-certificates")
    (unit,) = results(tmp_path / "out")["units"]
    names = [f["quantity"] for f in unit["findings"]]
    assert len(names) == len(set(names)) == 5
    assert unit["certificate"] is None


def test_exit_codes(tmp_path: Path) -> None:
    good = make_unit(tmp_path / "good", "G")
    lacking = make_unit(tmp_path / "lacking", "L", GOOD.replace("[stroke]\nstroke_um = 373.2", ""))
    failing = make_unit(tmp_path / "failing", "F", GOOD.replace("5.10", "1.72"))
    near = make_unit(tmp_path / "near", "N", GOOD.replace("5.10", "5.49"))
    broken = make_unit(tmp_path / "broken", "B", 'serial = "B"')
    out = ("--out", tmp_path / "out", "--no-certificates")
    assert batch(good, *out).exit_code == 0
    assert batch(good, lacking, *out).exit_code == 4
    assert batch(near, *out).exit_code == 4
    assert batch(good, lacking, failing, *out).exit_code == 3
    assert batch(good, broken, *out).exit_code == 4  # what was refused was not accepted
    assert batch(broken, *out).exit_code == 6
    assert batch(tmp_path / "absent", *out).exit_code == 6
    assert batch(good, *out, spec="no-such-spec").exit_code == 6
    assert accept("batch").exit_code == 2


def test_bad_units_are_refused_in_one_line_each_and_the_rest_is_judged(tmp_path: Path) -> None:
    make_unit(tmp_path / "in" / "good", "GOOD")
    make_unit(tmp_path / "in" / "twin-1", "TWIN")
    make_unit(tmp_path / "in" / "twin-2", "TWIN")
    make_unit(tmp_path / "in" / "strut", "STRUT", GOOD.replace('"apa"', '"strut"'))
    make_unit(tmp_path / "in" / "latin", "LATIN")
    (tmp_path / "in" / "latin" / "unit.toml").write_bytes(b'serial = "\xe9"')
    (tmp_path / "file").write_text("not a folder")
    done = batch(tmp_path / "in", tmp_path / "file", "--out", tmp_path / "out", "--no-certificates")
    assert done.exit_code == 4
    assert verdicts(tmp_path / "out") == {"GOOD": "accepted"}
    lines = [line for line in done.stderr.splitlines() if line.startswith("refused:")]
    assert len(lines) == 5
    for words in ("twin-1", "twin-2", "must be unique", "'strut'", "not UTF-8", "is a file"):
        assert any(words in line for line in lines), words
    assert len(results(tmp_path / "out")["refused"]) == 5
    with open_store() as store:
        assert len(list(store.events(what="unit_refused"))) == 5


def test_a_folder_whose_path_is_no_utf8_is_refused_and_the_rest_is_judged(tmp_path: Path) -> None:
    """Red before: a traceback, and no unit was judged."""
    make_unit(tmp_path / "in" / "good", "GOOD")
    try:
        (make_unit(tmp_path / "in" / "other", "OTHER")).rename(os.fsdecode(bytes(tmp_path / "in") + b"/\xff"))
    except OSError:
        pytest.skip("this file system takes no such name")
    done = batch(tmp_path / "in", "--out", tmp_path / "out", "--no-certificates")
    assert done.exit_code == 4
    assert verdicts(tmp_path / "out") == {"GOOD": "accepted"}
    (refused,) = results(tmp_path / "out")["refused"]
    assert refused["path"].endswith("udcff")


def test_the_same_folder_named_twice_is_one_unit(tmp_path: Path) -> None:
    folder = make_unit(tmp_path / "a", "A")
    assert batch(folder, folder, tmp_path, "--out", tmp_path / "out", "--no-certificates").exit_code == 0
    assert len(results(tmp_path / "out")["units"]) == 1


def test_only_what_changed_is_judged_again(tmp_path: Path) -> None:
    a, _ = make_unit(tmp_path / "in" / "a", "A"), make_unit(tmp_path / "in" / "b", "B")
    out = tmp_path / "out"
    batch(tmp_path / "in", "--out", out)
    before = {p.name: p.read_bytes() for p in (out / "certificates").iterdir()}
    first = (out / "results.json").read_bytes()
    done = batch(tmp_path / "in", "--out", out)
    assert "2 of 2 units unchanged" in done.stderr
    assert (out / "results.json").read_bytes() == first
    assert {p.name: p.read_bytes() for p in (out / "certificates").iterdir()} == before

    (a / "unit.toml").write_text(GOOD.replace("{serial}", "A").replace("5.10", "1.72"))
    done = batch(tmp_path / "in", "--out", out)
    assert "B: unchanged" in done.stderr
    assert "A: rejected" in done.stderr
    assert verdicts(out) == {"A": "rejected", "B": "accepted"}
    assert "no longer list" not in done.stderr
    done = batch(a, "--out", out)
    assert "results.* no longer list B: not asked for this time" in done.stderr
    batch(tmp_path / "in", "--out", out)

    (out / "certificates" / "B.pdf").write_bytes(b"damaged")
    assert "B: accepted" in batch(tmp_path / "in", "--out", out).stderr  # a damaged certificate is written anew
    assert accept("verify", out / "certificates" / "B.pdf").exit_code == 0


def test_another_spec_judges_again(tmp_path: Path) -> None:
    make_unit(tmp_path / "a", "A")
    other = tmp_path / "other.toml"
    other.write_text(builtin()["apa-basic"].read_text().replace("upper = 10.0", "upper = 5.0"))
    batch(tmp_path / "a", "--out", tmp_path / "out", "--no-certificates")
    assert verdicts(tmp_path / "out") == {"A": "accepted"}
    batch(tmp_path / "a", "--out", tmp_path / "out", "--no-certificates", spec=str(other))
    assert verdicts(tmp_path / "out") == {"A": "rejected"}


def test_without_a_passphrase_units_are_judged_and_not_certified(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.delenv("ACCEPT_PASSPHRASE")
    make_unit(tmp_path / "a", "A")
    done = batch(tmp_path / "a", "--out", tmp_path / "out")
    assert done.exit_code == 0
    assert "ACCEPT_PASSPHRASE" in done.stderr
    assert results(tmp_path / "out")["units"][0]["certificate"] is None


def test_a_wrong_passphrase_is_said(tmp_path: Path, monkeypatch) -> None:
    make_unit(tmp_path / "a", "A")
    batch(tmp_path / "a", "--out", tmp_path / "out")
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "wrong")
    done = batch(tmp_path / "a", "--out", tmp_path / "out")
    assert done.exit_code == 6
    assert "technician.key.pem" in done.stderr


@pytest.mark.parametrize("command", ["report", "batch"])
def test_a_signed_certificate_is_set_aside_not_replaced(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "correct horse")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    pdf = tmp_path / "certificates" / "T-01.pdf"
    out = ("--out", tmp_path) if command == "batch" else ("--out", pdf)
    kept, before = [], b""
    for sensor in ("5.10", "5.06", "5.02"):
        unit = make_unit(tmp_path / "unit", "T-01", GOOD.replace("5.10", sensor))
        done = accept(command, unit, "--spec", "apa-basic", *out, "--reason", "measured again")
        assert done.exit_code == 0, done.output
        assert pdf.read_bytes() != before
        if sensor != "5.06":  # the second has the technician's signature alone
            assert accept("countersign", pdf).exit_code == 0
        before = pdf.read_bytes()
        kept.append(before)
    assert pdf.read_bytes() == kept[2]
    aside = [pdf.with_name(f"T-01_superseded-{n}.pdf") for n in (1, 2)]
    assert {*pdf.parent.iterdir()} == {pdf, *aside}
    assert [path.read_bytes() for path in aside] == kept[:2]


def test_report_verify_countersign_and_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    assert accept("keys", "init", "--qa", "Grace Hopper").exit_code == 0
    folder = make_unit(tmp_path / "a", "A")
    pdf = tmp_path / "A.pdf"
    assert accept("report", folder, "--out", pdf, "--spec", "apa-basic").exit_code == 0
    done = accept("verify", pdf)
    assert done.exit_code == 0
    assert "countersignature open" in done.stdout
    assert accept("countersign", pdf).exit_code == 0
    done = accept("verify", pdf)
    assert done.exit_code == 0
    assert "countersigned" in done.stdout
    assert accept("countersign", pdf).exit_code == 6  # nobody signs a third time
    assert accept("keys", "list").exit_code == 0
    log = accept("store", "log", "A")
    assert "unit_judged" in log.stdout
    assert accept("store", "check").exit_code == 0


def test_a_foreign_bench_does_not_trust_it(tmp_path: Path, monkeypatch) -> None:
    folder = make_unit(tmp_path / "a", "A")
    accept("report", folder, "--out", tmp_path / "A.pdf", "--spec", "apa-basic")
    ours = Path(os.environ["ACCEPT_HOME"]) / "keys" / "ca.pem"
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "elsewhere"))
    assert "no trusted CA" in accept("verify", tmp_path / "A.pdf").stdout
    assert accept("keys", "init").exit_code == 0
    assert accept("verify", tmp_path / "A.pdf").exit_code == 3
    assert accept("verify", tmp_path / "A.pdf", "--trust", ours).exit_code == 0


def test_a_unit_with_a_missing_file_has_a_certificate_that_verifies(tmp_path: Path) -> None:
    text = GOOD.replace("stroke_um = 373.2", 'one_stack = "one.mat"\ntwo_stacks = "two.mat"')
    folder = make_unit(tmp_path / "a", "A", text)
    assert accept("report", folder, "--out", tmp_path / "A.pdf", "--spec", "apa-basic").exit_code == 4
    done = accept("verify", tmp_path / "A.pdf")
    assert done.exit_code == 0, done.stdout


@pytest.mark.slow
def test_a_pool_that_is_broken_loses_no_unit(tmp_path: Path) -> None:
    """It refuses the first job that it is given; all units, the one judged here too, are judged nevertheless."""
    units = [make_unit(tmp_path / serial, serial) for serial in "AB"]
    with process_pool(1) as broken:
        with pytest.raises(BrokenProcessPool):
            broken.submit(os._exit, 1).result()
        order = BatchRequest(units, tmp_path / "out", {"apa": load_spec("apa-basic")}, "NN", workers=2, pool=broken)
        with open_store(f"sqlite:///{tmp_path / 'store.sqlite'}") as store:
            report = run(order, store, lambda words: None)
    assert [u.serial for u in report.units] == ["A", "B"]
    assert not report.refused


@pytest.mark.parametrize("where", ["out", "home"])
def test_a_folder_that_cannot_be_written_is_a_clear_error(tmp_path: Path, monkeypatch, where: str) -> None:
    """A file stands where the folder should be: that refuses root too, unlike permissions."""
    make_unit(tmp_path / "a", "A")
    (tmp_path / "taken").write_text("")
    if where == "home":
        monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "taken" / "home"))
    out = tmp_path / "taken" / "out" if where == "out" else tmp_path / "out"
    done = batch(tmp_path / "a", "--out", out)
    assert done.exit_code == 6
    assert "taken" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("full", ["out", "home"])
def test_a_full_disk_is_a_clear_error(tmp_path: Path, monkeypatch, full: str) -> None:
    """A file system of its own, too small for the certificates or the events."""
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=160k", "tmpfs", str(small)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a small file system can be mounted by root only")
    try:
        for serial in "ABCDEF":
            make_unit(tmp_path / "units" / serial, serial)
        if full == "home":
            monkeypatch.setenv("ACCEPT_HOME", str(small))
        out = small / "out" if full == "out" else tmp_path / "out"
        done = batch(tmp_path / "units", "--out", out, "--workers", 1)
    finally:
        subprocess.run(["umount", str(small)], check=True)
    assert done.exit_code == 6
    assert str(small) in done.stderr
    assert "Traceback" not in done.output


def test_the_command_line_itself(tmp_path: Path) -> None:
    """Through the installed entry point: exit code, data on stdout, talk on stderr."""
    make_unit(tmp_path / "a", "A")
    command = [sys.executable, "-m", "accept", "batch", str(tmp_path / "a"), "--out", str(tmp_path / "out"),
               "--spec", "apa-basic", "--no-certificates"]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    assert done.returncode == 0
    assert "accepted" in done.stdout
    assert "[1/1] A: accepted" in done.stderr


@recorded
@pytest.mark.slow
def test_recorded_units(tmp_path: Path) -> None:
    """A-01..03 against what was put into them, with two workers: stroke within 0.3 %, stiffness within 1 %."""
    truth = json.loads((DATA / "units" / "truth.json").read_text())
    units = [DATA / "units" / name for name in ("A-01", "A-02", "A-03")]
    done = batch(*units, "--out", tmp_path, "--workers", 2)
    assert done.exit_code == 3
    assert verdicts(tmp_path) == {"A-01": "accepted", "A-02": "rejected", "A-03": "accepted"}
    for one in results(tmp_path)["units"]:
        found = {f["quantity"]: f for f in one["findings"]}
        expected = truth[one["serial"]]
        assert found["stroke_um"]["value"] == pytest.approx(expected["stroke_um"], rel=0.003)
        assert found["k_closed_N_per_um"]["value"] == pytest.approx(expected["k_closed"], rel=0.01)
        assert found["flatness_um"]["value"] == pytest.approx(expected["flatness_um"], rel=1e-6)
        named = " ".join(one["not_judged"])
        for section in ("hysteresis", "sensor_highpass", "spurious_modes", "frf"):
            assert section in named
    second = next(u for u in results(tmp_path)["units"] if u["serial"] == "A-02")
    assert {f["quantity"] for f in second["findings"] if f["verdict"] == "fail"} == {"sensor_uF", "actuator_uF"}
    for serial in ("A-01", "A-02", "A-03"):
        assert accept("verify", tmp_path / "certificates" / f"{serial}.pdf").exit_code == 0
