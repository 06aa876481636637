"""Limits that were revised: capability of each revision, and a meter behind a step, by command."""

import datetime
import json

import numpy as np
import pytest

from accept.fleet.process_control.capability import capability
from accept.store import open_store
from tests.accept.fleet.judgements import add, judgement
from tests.shared.command_line import accept


@pytest.fixture
def values():
    """A hundred units; from the 60th on the lower limit is 345 um, and another gauge reads 15 um more."""
    x = 360.0 + 4.0 * np.random.default_rng(2).standard_normal(100)
    x[60:] += 15.0
    with open_store() as store:
        for n, value in enumerate(x):
            day = datetime.date(2026, 7, 6) + datetime.timedelta(days=n)
            made = judgement(f"A-{n:03d}", {"stroke_um": float(value)}, "B1", day=day)
            made.payload["result"]["findings"][0]["lower"] = 304.0 if n < 60 else 345.0
            gauge = {"check": "stroke", "name": "gauge", "serial": "G-77" if n < 60 else "G-79", "problem": None}
            made.payload["result"]["calibration"]["instruments"] = [gauge]
            add(store, [made], at=datetime.datetime.combine(day, datetime.time(9), datetime.UTC))
    return x


def test_each_revision_has_its_capability(values, tmp_path):
    done = accept("trend", "stroke_um", "--json", tmp_path / "t")
    (found,) = json.loads((tmp_path / "t").read_text())
    assert found["Cpk"] is None
    before, after = found["stages"]
    assert (before["lower"], before["n"], after["lower"], after["n"]) == (304.0, 60, 345.0, 40)
    assert (before["since"], before["until"], after["since"]) == ("2026-07-06", "2026-09-03", "2026-09-04")
    for stage, part in ((before, values[:60]), (after, values[60:])):
        made = capability(part, stage["lower"], None)
        assert stage["capability"]["Cpk"] == pytest.approx(made.Cpk.value)
        assert stage["capability"]["Ppk_lo"] == pytest.approx(made.Ppk.lo)
    assert "capability by revision of the limits" in done.output


def test_a_meter_that_was_exchanged_with_the_step_is_named(values, tmp_path):
    accept("trend", "stroke_um", "--json", tmp_path / "t")
    (alarm,) = json.loads((tmp_path / "t").read_text())[0]["alarms"]
    assert alarm["place"] == {"instrument": "G-79"}
    assert "with instrument G-79" in alarm["words"]
