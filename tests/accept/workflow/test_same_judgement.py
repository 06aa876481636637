"""Batch, report and workflow judge and certify the same unit by the same bench file to the same contents."""

import json
import shutil
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta, tzinfo
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from accept.batch import pipeline
from accept.certificate import read_contents
from accept.certificate.trust import keys
from accept.cli.main import app
from accept.judging import load_spec
from accept.store import open_store
from accept.workflow import certify
from accept.workflow.session.open_session import open_session
from accept.workflow.worker.judging import judge_whole_unit
from checks.declare import Measured
from specs.bench import load_bench

ANN, PASSPHRASE = "Ann", "correct horse"
# of the bench; and the reason that a person gives who signs, which a command does not ask for
OF_A_BENCH = ("head", "crl", "bench", "signature", "signed_because")
BENCH = """name = "bench 1"
[instruments.lcr]
driver = "lcr800"
measures = ["capacitance"]
model = "LCR-819"
serial = "E1"
link = { port = "/dev/x", baud = 38400, data_bits = 8, parity = "none", stop_bits = 1, handshake = "none" }
calibration = { certificate = "GW-7", due = 2099-03-01 }
[instruments.probe]
driver = "offline"
measures = ["flatness", "stroke", "stiffness"]
serial = "P1"
calibration = { certificate = "P-1", due = 2020-01-01 }
"""
GIVEN = {
    "flatness": {"z_um": (0, -2.5, -3, 0, -1.5, 1, -2, -4)},
    "capacitance": {"sensor_uF": (4.99,), "actuator_uF": (9.85,)},
    "stroke": {"stroke_um": (365.5,)},
    "stiffness": {"k_N_per_um": (1.75,)},
}


def by_workflow(home: Path, bench: Path) -> Path:
    with open_store() as store:
        session = open_session(store, home, load_spec("apa-basic"), ANN, "APA-02", load_bench(bench))
        session.begin({})
        for step, inputs in GIVEN.items():
            for name, values in inputs.items():
                for index, value in enumerate(values):
                    at = index if len(values) > 1 else None
                    session.entries.take(step, session.step(step).check.inputs[name], Measured(float(value)), index=at)
        certify.Signing(session).sign(PASSPHRASE, "only these readings were taken")
        path = Path(str(session.attempt.certificate))
        session.close()
    return path


def by_command(command: str) -> Callable[[Path, Path, Path], Path]:
    def certified(home: Path, bench: Path, unit: Path) -> Path:
        out = home / "out"
        path = out / "certificates" / "APA-02.pdf"
        place = out if command == "batch" else path
        words = (command, unit, "--spec", "apa-basic", "--bench", bench, "--operator", ANN, "--out", place)
        done = CliRunner().invoke(app, [str(w) for w in words])
        assert done.exit_code == 4, done.output
        return path

    return certified


def contents(pdf: Path) -> dict[str, Mapping[str, Any]]:
    """Result and manifest, without what tells one bench from another."""
    read = read_contents(pdf.read_bytes())
    provenance = {key: value for key, value in read.provenance.items() if key not in OF_A_BENCH}
    panels = {name: repr(panel) for name, panel in read.panels.items()}
    return {"result": read.result, "manifest": read.manifest() | {"provenance": provenance}, "panels": panels}


def test_batch_report_and_workflow_certify_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One instrument was never commissioned, another's calibration has expired."""
    bench = tmp_path / "bench.toml"
    bench.write_text(BENCH)
    monkeypatch.setenv("ACCEPT_HOME", str(first := tmp_path / "workflow"))
    keys.init(first, PASSPHRASE, ANN)
    by_hand = by_workflow(first, bench)
    (folder,) = (path.parent for path in first.rglob("unit.toml"))
    unit = tmp_path / "APA-02"
    shutil.copytree(folder, unit)
    wanted = contents(by_hand)
    assert "unproven: never commissioned" in json.dumps(wanted["result"]["calibration"])
    for command in ("batch", "report"):
        monkeypatch.setenv("ACCEPT_HOME", str(home := tmp_path / command))
        home.mkdir()
        keys.init(home, PASSPHRASE, ANN)
        pdf = by_command(command)(home, bench, unit)
        assert contents(pdf) == wanted, command
        with open_store() as store:
            (judged,) = store.events("APA-02", "unit_judged")
        assert judged.data["result"] == wanted["result"], command


@pytest.mark.parametrize("later", [0, 30], ids=["same-day", "a-month-later"])
def test_to_look_at_a_certified_unit_is_no_attempt_at_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, later: int
) -> None:
    """A program that was restarted judges the unit for its summary: the certificate still states the last judgement."""
    monkeypatch.setenv("ACCEPT_HOME", str(home := tmp_path / "workflow"))
    (bench := tmp_path / "bench.toml").write_text(BENCH)
    keys.init(home, PASSPHRASE, ANN)
    signed = by_workflow(home, bench)
    before = CliRunner().invoke(app, ["verify", str(signed)])

    class Later(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> datetime:
            return datetime.now(tz) + timedelta(days=later)

    monkeypatch.setattr(pipeline, "datetime", Later)
    with open_store() as store:
        session = open_session(store, home, load_spec("apa-basic"), ANN, "APA-02", load_bench(bench))
        seen = judge_whole_unit(session)
        assert seen.to_json() == contents(signed)["result"]
        assert (session.attempt.certificate, session.attempt.void) == (str(signed), None)
        session.close()
        assert len(list(store.events("APA-02", "unit_judged"))) == 1
    after = CliRunner().invoke(app, ["verify", str(signed)])
    assert (after.exit_code, after.output) == (before.exit_code, before.output)
