"""Calibration of the bench: conditional at best without a valid one, and the certificate says so."""

import datetime
import itertools
import json
from dataclasses import replace
from pathlib import Path

import pytest

from accept.judging import calibration, judge_unit, load_spec
from accept.units import unit_folder
from checks.cause import Cause, because
from checks.verdict import Verdict
from specs.bench import load_bench, parse_bench
from specs.strict import SpecError
from tests.accept.units.units import GOOD, make_unit
from tests.shared.command_line import accept

TODAY = datetime.date(2026, 11, 21)
INSTRUMENT = """
[instruments.{name}]
driver = "offline"
measures = ["{check}"]
serial = "{name}-1"
calibration = {{ certificate = "C-{name}", due = {due} }}
"""
CHECKS = ("flatness", "capacitance", "stroke", "stiffness")


def bench_text(**due: str) -> str:
    """A bench file with an instrument per check; `due`: other days than 2099."""
    entries = (INSTRUMENT.format(name=f"i_{check}", check=check, due=due.get(check, "2099-01-01")) for check in CHECKS)
    return 'name = "b"\n' + "".join(entries)


def judged(tmp_path: Path, text: str, on: datetime.date = TODAY):
    spec = load_spec("apa-basic")
    stated = calibration.statement(parse_bench(text.encode(), "bench.toml"), spec.checks, on)
    return judge_unit(unit_folder.read(make_unit(tmp_path / "U")), spec, stated)


def test_valid_calibrations_change_nothing_but_are_named(tmp_path):
    spec = load_spec("apa-basic")
    without = judge_unit(unit_folder.read(make_unit(tmp_path / "U")), spec)
    result = judged(tmp_path, bench_text())
    assert result.findings == without.findings
    assert result.verdict == without.verdict == "accepted"
    assert any("certificate C-i_stroke, valid to 2099-01-01" in note for note in result.notes)
    assert "calibration" not in without.to_json()


@pytest.mark.parametrize(("due", "verdict"), [("2026-11-20", "conditional"), ("2026-11-21", "accepted")])
def test_the_last_day_still_holds(tmp_path, due, verdict):
    result = judged(tmp_path, bench_text(stroke=due))
    assert result.verdict == verdict
    found = {f.quantity: f for f in result.findings}
    assert ("expired on 2026-11-20" in (found["stroke_um"].reason or "")) == (verdict == "conditional")
    assert found["sensor_uF"].verdict is Verdict.PASS


@pytest.mark.parametrize(
    ("day", "calibrated", "words"),
    [
        ("2026-01-01", None, None),  # measured while it held, judged after it expired
        ("2026-06-02", None, "expired on 2026-06-01, it was measured on 2026-06-02"),
        (None, None, "it was measured on 2026-11-21"),  # not told: the day of judging
        ("2025-01-01", "2025-06-01", "was calibrated on 2025-06-01"),  # a new certificate does not reach back
        ("2026-12-01", None, "after the day of judging"),
    ],
)
def test_the_day_of_measuring_counts(tmp_path, day, calibrated, words):
    text = bench_text(stroke="2026-06-01")
    if calibrated:
        text = text.replace("due = 2026-06-01", f"calibrated = {calibrated}, due = 2026-06-01")
    folder = make_unit(tmp_path / "U")
    if day:
        with (folder / "unit.toml").open("a") as file:
            file.write(f"[measured]\nstroke = {day}\n")
    spec = load_spec("apa-basic")
    stated = calibration.statement(parse_bench(text.encode(), "bench.toml"), spec.checks, TODAY)
    unit = unit_folder.read(folder, latest=datetime.date.max)  # the day of judging is the statement's here
    reason = {f.quantity: f for f in judge_unit(unit, spec, stated).findings}["stroke_um"].reason
    assert reason is None if words is None else words in reason


@pytest.mark.parametrize(
    "line", ['stroke = "2026-01-01"', "stroke = 2026-01-01T10:00:00", "strok = 2026-01-01", "stroke = 1"]
)
def test_days_that_are_none(tmp_path, line):
    folder = make_unit(tmp_path / "U")
    (folder / "unit.toml").write_text((folder / "unit.toml").read_text() + f"[measured]\n{line}\n")
    with pytest.raises(unit_folder.UnitError, match="measured"):
        unit_folder.read(folder)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('calibration = { certificate = "C-i_stroke", due = 2099-01-01 }', "", "is unknown"),
        ('serial = "i_stroke-1"', "", "no serial number"),
        ('measures = ["stroke"]', 'measures = ["frf"]', "names no instrument"),
    ],
)
def test_unknown_is_not_valid(tmp_path, old, new, words):
    result = judged(tmp_path, bench_text().replace(old, new))
    assert result.verdict == "conditional"
    found = {f.quantity: f for f in result.findings}
    assert words in found["stroke_um"].reason


def test_two_instruments_for_a_check_must_both_be_valid(tmp_path):
    second = INSTRUMENT.format(name="probe2", check="stroke", due="2020-01-01")
    assert judged(tmp_path, bench_text() + second).verdict == "conditional"


def test_every_verdict_is_at_best_conditional(tmp_path):
    """Over findings of every verdict: never better than before, never a pass."""
    finding = judged(tmp_path, bench_text()).findings[0]
    order = [Verdict.FAIL, Verdict.NO_RESULT, Verdict.CONDITIONAL, Verdict.PASS]
    for verdict, reason in itertools.product(Verdict, (None, "why")):
        import dataclasses

        before = dataclasses.replace(finding, verdict=verdict, reason=reason)
        after = before.weakened(because(Cause.CALIBRATION, detail="expired"))
        assert order.index(after.verdict) <= min(order.index(verdict), order.index(Verdict.CONDITIONAL))
        assert verdict is Verdict.NO_RESULT or "expired" in after.reason


def test_batch_and_certificate_say_so_and_verify_judges_it_again(tmp_path):
    make_unit(tmp_path / "U", "U-1")
    (tmp_path / "bench.toml").write_text(bench_text(stroke="2020-01-01"))
    out = tmp_path / "out"
    done = accept("batch", tmp_path / "U", "--out", out, "--spec", "apa-basic", "--bench", tmp_path / "bench.toml")
    assert done.exit_code == 4, done.output
    (entry,) = json.loads((out / "results.json").read_text())["units"]
    assert entry["verdict"] == "conditional"
    assert [r["problem"] for r in entry["calibration"]["instruments"] if r["check"] == "flatness"] == [None]
    verified = accept("verify", out / "certificates" / "U-1.pdf")
    assert verified.exit_code == 0, verified.output
    from pypdf import PdfReader

    text = " ".join(" ".join(p.extract_text().split()) for p in PdfReader(out / "certificates" / "U-1.pdf").pages)
    assert "expired on 2020-01-01" in text


LATER = GOOD.replace("5.10", "5.06").replace("373.2", "371.5").replace("1.70", "1.68").replace("10.03", "9.98")


def test_a_renewed_calibration_is_judged_again(tmp_path):
    """What was measured by an instrument out of its date stays in doubt: quality assurance decides, or it is measured
    anew."""
    make_unit(tmp_path / "U", "U-1")
    batch = ("batch", tmp_path / "U", "--out", tmp_path / "out", "--spec", "apa-basic", "--no-certificates")
    batch += ("--bench", tmp_path / "bench.toml")
    (tmp_path / "bench.toml").write_text(bench_text(stroke="2020-01-01"))
    assert accept(*batch).exit_code == 4
    assert "unchanged" in accept(*batch).output
    (tmp_path / "bench.toml").write_text(bench_text())
    done = accept(*batch)
    assert done.exit_code == 4
    assert "unchanged" not in done.output
    assert "the bench file is another one or gone" in (tmp_path / "out" / "results.json").read_text()
    make_unit(tmp_path / "again", "U-1", LATER)
    anew = ("batch", tmp_path / "again", *batch[2:])
    assert accept(*anew).exit_code == 0


def test_a_certificate_whose_calibration_was_prettied_is_refused(tmp_path):
    """The downgrade is judged again from the dates on the certificate."""
    from accept.certificate import CertificateContent, rejudge
    from accept.certificate.verify.result_diff import differences

    folder = make_unit(tmp_path / "U")
    spec = load_spec("apa-basic")
    stated = calibration.statement(parse_bench(bench_text(stroke="2020-01-01").encode(), "b"), spec.checks, TODAY)
    result = judge_unit(unit_folder.read(folder), spec, stated).to_json()
    text = {"unit.toml": (folder / "unit.toml").read_bytes()}
    content = CertificateContent(result, spec.name, spec.title, spec.text, "Ann", files=text)
    assert not differences(result, rejudge(content).to_json())
    forged = json.loads(json.dumps(result))
    for row in forged["calibration"]["instruments"]:
        row["problem"] = None
    assert differences(forged, rejudge(replace(content, result=forged)).to_json())


def test_report_with_a_bench_file(tmp_path):
    make_unit(tmp_path / "U", "U-1")
    (tmp_path / "bench.toml").write_text(bench_text(stroke="2020-01-01"))
    words = ("report", tmp_path / "U", "--out", tmp_path / "c.pdf", "--spec", "apa-basic")
    assert accept(*words, "--bench", tmp_path / "bench.toml").exit_code == 4
    assert accept(*words).exit_code == 4  # the doubt stays if the bench file is left out


def test_recall_lists_every_unit_that_an_instrument_touched(tmp_path):
    for serial in ("U-1", "U-2"):
        make_unit(tmp_path / serial, serial)
    (tmp_path / "bench.toml").write_text(bench_text())
    for folder in ("U-1", "U-2"):
        words = ("batch", tmp_path / folder, "--out", tmp_path / "o", "--spec", "apa-basic", "--no-certificates")
        accept(*words, *(("--bench", tmp_path / "bench.toml") if folder == "U-1" else ()))
    done = accept("recall", "--instrument", "i_stroke-1", "--since", "2020-01-01")
    assert done.exit_code == 0
    assert "U-1" in done.output
    assert "judged stroke: accepted" in done.output
    assert "U-2" not in done.output  # judged without a bench file: no instrument is known
    later = accept("recall", "--instrument", "i_stroke-1", "--since", "2099-01-01")
    assert (later.exit_code, "no unit" in later.output) == (0, True)
    mistyped = accept(
        "recall", "--instrument", "i-stroke-1", "--since", "2020-01-01"
    )  # would hide every unit behind it
    assert (mistyped.exit_code, "is its serial number right?" in mistyped.output) == (4, True)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('name = "b"', "instruments"),
        ('name = "b"\n[instruments.a]\ndriver = "offline"', "measures"),
        (bench_text().replace("driver", "drivr", 1), "unknown key"),
        (bench_text().replace("due = 2099-01-01", 'due = "2099-01-01"', 1), "expected a date"),
        (bench_text().replace("due = 2099-01-01", "due = 2099-01-01T10:00:00", 1), "expected a date"),
        (bench_text() + 'link = { port = "/dev/a" }', "baud"),
        ("name =", "is not TOML"),
    ],
)
def test_a_bench_file_is_read_strictly(text, words):
    with pytest.raises(SpecError, match=words):
        parse_bench(text.encode(), "bench.toml")


def test_a_port_given_twice():
    line = (
        'link = { port = "/dev/a", baud = 9600, data_bits = 8, parity = "none", stop_bits = 1, handshake = "none" }\n'
    )
    entry = '[instruments.{}]\ndriver = "lcr800"\nmeasures = []\n' + line
    with pytest.raises(SpecError, match="/dev/a is given to two"):
        parse_bench(('name = "b"\n' + entry.replace("{}", "a", 1) + entry.replace("{}", "b", 1)).encode(), "bench.toml")


def test_a_bench_file_that_is_not_there(tmp_path):
    with pytest.raises(SpecError, match="cannot be read"):
        load_bench(tmp_path / "bench.toml")
