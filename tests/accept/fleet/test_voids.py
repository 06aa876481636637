"""An attempt that quality assurance declared void is shown, counts nowhere, and makes no unit good."""

import json
import re
from dataclasses import replace

import pytest

from accept.base.documents.results import UnitHeader
from accept.base.home import home
from accept.certificate.trust import keys
from accept.fleet.errors import FleetError
from accept.fleet.matched_sets import pool
from accept.fleet.measurements import measurements
from accept.fleet.trend import trends
from accept.fleet.yields import pareto, yields
from accept.judging.reservations.parts import part_doubts
from accept.judging.reservations.void_attempts import VoidError, void, voids
from accept.store import fold, open_store
from accept.store.decisions import DecisionError, Signer
from accept.store.payloads import AttemptVoided
from tests.accept.certificate.verify.test_statements import certified, plainly, verified
from tests.accept.fleet.judgements import add, judgement
from tests.accept.units.units import make_unit
from tests.shared.command_line import accept

GOOD = {"sensor_uF": 5.0, "stroke_um": 360.0}
TYPED = GOOD | {"sensor_uF": 50.0}  # a comma too few


@pytest.fixture
def bench(monkeypatch):
    """A-1 mistyped and judged again, A-2 good, A-3 good and then rejected."""
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    with open_store() as store:
        add(store, [judgement("A-1", TYPED), judgement("A-2", GOOD), judgement("A-3", GOOD)])
        add(store, [judgement("A-1", GOOD), judgement("A-3", GOOD | {"stroke_um": 180.0})])
        yield store


def grace() -> Signer:
    credential = keys.unlock(home(), "qa", "battery staple")
    return Signer(credential.key, credential.certificate)


def of(frame, serial):
    counted = yields(frame, "serial").set_index("serial")
    return tuple(counted.loc[serial, ["first", "last"]]) if serial in counted.index else None


def test_a_void_attempt_is_shown_and_not_counted(bench, tmp_path):
    frame = measurements(bench)
    assert of(frame, "A-1") == (False, True)
    done = accept("store", "void", "A-1", 1, "--reason", "a comma was not typed")
    assert done.exit_code == 0, done.output
    frame = measurements(bench)
    assert of(frame, "A-1") == (True, True)
    assert pareto(frame).empty or "A-1" not in pareto(frame)
    (trend,) = trends(frame, "sensor_uF", "all")
    assert trend.rows["value"].max() == 5.0
    assert accept("history", "A-1", "--json", tmp_path / "h").exit_code == 0
    rows = json.loads((tmp_path / "h").read_text())
    assert [(r["attempt"], r["unit_verdict"]) for r in rows if r["quantity"] == "sensor_uF"] == [
        (1, "voided"), (2, "accepted"),
    ]  # fmt: skip
    assert all("a comma was not typed (Grace" in r["voided"] for r in rows if r["attempt"] == 1)
    assert not any(r["changed"] for r in rows)  # nothing is compared with what is void
    counted = accept("yield")
    assert "A-1 attempt 1" in counted.output  # what is left out is said
    assert "a comma was not typed" in accept("store", "log", "A-1").output


def test_a_void_rejection_makes_no_unit_good(bench, tmp_path):
    """A-3 was accepted, then rejected; without the rejection it is a unit to be judged again."""
    void(bench, "A-3", 2, "the wrong stack was connected", grace)
    frame = measurements(bench)
    assert of(frame, "A-3")[1] == False  # noqa: E712  # numpy's
    assert "A-3" not in pool(frame, "apa", ["stroke_um"]).serials
    assert accept("list", "--verdict", "voided", "--json", tmp_path / "l").exit_code == 0
    assert [r["serial"] for r in json.loads((tmp_path / "l").read_text())] == ["A-3"]
    assert "void" in "".join(part_doubts(bench, UnitHeader(serial="S-1", kind="strut", parts={"apa": "A-3"})))
    state = fold(bench.events("A-3"))
    assert state is not None
    assert not state.unchanged(
        state.judged.inputs, state.judged.spec_sha256, state.judged.code_sha256
    )  # a batch judges it again
    add(bench, [judgement("A-3", GOOD)])
    assert of(measurements(bench), "A-3") == (True, True)


def test_a_unit_of_which_all_is_void_is_not_counted(bench):
    void(bench, "A-2", 1, "measured on another unit", grace)
    frame = measurements(bench)
    assert of(frame, "A-2") is None
    with pytest.raises(FleetError, match="no value"):
        trends(frame[frame["serial"] == "A-2"], "stroke_um", "all")


def test_only_a_signature_of_quality_assurance_counts(bench, monkeypatch):
    judged = next(bench.events("A-1", "unit_judged")).seq
    bench.write(AttemptVoided(1, judged, "typed"), "A-1", who="Grace")  # nobody signed
    assert voids(bench) == {}
    technician = keys.unlock(home(), "technician", "correct horse")
    with pytest.raises(DecisionError, match="not of quality assurance"):
        void(bench, "A-1", 1, "typed", lambda: Signer(technician.key, technician.certificate))
    void(bench, "A-1", 1, "a comma was not typed", grace)
    *_, said = map(AttemptVoided.of, bench.events("A-1", AttemptVoided.KIND))
    other = list(bench.events("A-3", "unit_judged"))[1].seq
    bench.write(replace(said, attempt=2, judged=other), "A-3", who="Grace")  # the signature of another decision
    assert list(voids(bench)) == [judged]
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "wrong horse")
    assert accept("store", "void", "A-2", 1, "--reason", "x").exit_code == 6


def test_what_cannot_be_void_is_refused(bench):
    void(bench, "A-1", 1, "a comma was not typed", grace)
    for serial, attempt, reason in (("A-1", 1, "again"), ("A-1", 3, "x"), ("A-9", 1, "x"), ("A-2", 1, "  ")):
        with pytest.raises(VoidError):
            void(bench, serial, attempt, reason, grace)


@pytest.mark.slow
def test_a_certificate_of_a_void_attempt_is_not_plainly_valid(tmp_path, monkeypatch):
    """By the store, and elsewhere by the list that the bench published."""
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "correct horse")
    pdf = certified(tmp_path, "A-1", serial="A-1")
    assert plainly(verified(pdf))
    assert accept("store", "void", "A-1", 1, "--reason", "another unit was on the bench").exit_code == 0
    done = verified(pdf)
    assert (done.exit_code, "another unit was on the bench" in done.stdout) == (4, True), done.output
    assert verified(pdf, "--require", "current").exit_code == 3
    assert accept("countersign", pdf).exit_code == 4
    assert accept("store", "publish", tmp_path / "list.json").exit_code == 0
    ca = keys.folder(home()) / "ca.pem"
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "office"))
    elsewhere = verified(pdf, "--trust", ca, "--log", tmp_path / "list.json")
    assert (elsewhere.exit_code, "void" in elsewhere.stdout) == (4, True), elsewhere.output


def test_a_void_attempt_judged_once_more_is_held(tmp_path, monkeypatch):
    """Neither another spec nor another spelling of unit.toml makes the values of a void attempt good; quality assurance
    may release them, and other values are another measurement."""
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    unit = make_unit(tmp_path / "units" / "APA-01", "APA-01")

    def judged() -> str:
        words = ("--spec", "apa-basic", "--out", tmp_path / "out", "--no-certificates")
        accept("batch", tmp_path / "units", *words)
        (entry,) = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
        return entry["verdict"]

    assert judged() == "accepted"
    assert accept("store", "void", "APA-01", 1, "--reason", "another unit was on the bench").exit_code == 0
    assert judged() == "conditional"
    text = (unit / "unit.toml").read_text()
    (unit / "unit.toml").write_text(f"{text}# judged once more\n")
    assert judged() == "conditional"
    done = accept("store", "dispose", "APA-01", "--disposition", "use-as-is", "--because", "it was this unit after all")
    assert done.exit_code == 0, done.output
    assert judged() == "accepted"


def test_a_void_attempt_measured_anew_is_judged_as_any(tmp_path, monkeypatch):
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    unit = make_unit(tmp_path / "units" / "APA-01", "APA-01")

    def judged() -> str:
        accept("batch", tmp_path / "units", "--spec", "apa-basic", "--out", tmp_path / "out", "--no-certificates")
        (entry,) = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
        return entry["verdict"]

    assert judged() == "accepted"
    assert accept("store", "void", "APA-01", 1, "--reason", "a digit was exchanged").exit_code == 0
    assert judged() == "conditional"  # by mistake
    text = (unit / "unit.toml").read_text()
    (unit / "unit.toml").write_text(re.sub(r"(?m)^(stroke_um = )[\d.]+", r"\g<1>366.7", text))
    assert judged() == "accepted"
