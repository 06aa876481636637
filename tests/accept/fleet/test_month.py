"""A month of 200 units with all that goes wrong in one: each cause is named with direction, size, place and first unit,
and nothing else rings.

Two benches, ten units a day, three operators; imported as a backlog, in another order than that of measurement.
Stroke drifts by 8 um (2 sigma), two units have a dead stack; the sensor stack reads 0.12 uF more at B2 from unit 105;
lot LX has low actuator stacks; stiffness and flatness, which is skewed, are in control; four units are tested again.
"""

import datetime
import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from accept.fleet.measurements import measurements
from accept.fleet.trend import summary, trends
from accept.fleet.yields import pareto, yields
from accept.store import open_store
from tests.accept.fleet.judgements import add, judgement

QUANTITIES = ("flatness_um", "sensor_uF", "actuator_uF", "stroke_um", "k_closed_N_per_um")
DEAD = ("Q-061", "Q-149")


def month(seed: int):
    """The events of a month in the order of measurement."""
    rng = np.random.default_rng(seed)
    events = []
    for i in range(200):
        z, day = rng.standard_normal(4), i // 10
        bench, lot = f"B{1 + i % 10 // 5}", "LX" if 140 <= i < 160 else f"L{day // 2}"
        serial = f"Q-{i:03d}"
        values = {
            "flatness_um": 2.5 * rng.weibull(1.8),
            "sensor_uF": 4.9 + 0.03 * z[0] + (0.12 if bench == "B2" and i >= 105 else 0.0),
            "actuator_uF": 9.7 + 0.15 * z[1] - (0.9 if lot == "LX" else 0.0),
            "stroke_um": 181.0 if serial in DEAD else 360.0 - 8.0 * i / 199 + 4.0 * z[2],
            "k_closed_N_per_um": 2.9 + 0.08 * z[3],
        }
        event = judgement(serial, values, bench, lot, datetime.date(2026, 10, 1 + day))
        events.append(replace(event, payload={**event.payload, "batch": {"seq": 1, "place": i}}))
    return events


def retests():
    """Four units of the month once more, at its end: the dead stacks with new ones, and two that are as before."""
    day = datetime.date(2026, 10, 24)
    good = {"flatness_um": 2.0, "sensor_uF": 4.9, "actuator_uF": 9.7, "stroke_um": 358.0, "k_closed_N_per_um": 2.9}
    return [judgement(serial, good, "B1", "L6", day) for serial in (*DEAD, "Q-003", "Q-004")]


def stored(seed: int):
    with open_store() as store:
        events = month(seed)
        for i in np.random.default_rng(0).permutation(200):
            add(store, [events[i]], who=("Ann", "Bob", "Cy")[i % 3])
        add(store, retests())


def test_each_cause_is_named_and_nothing_else_rings(tmp_path):
    stored(8)
    alarms = {}
    for name in QUANTITIES:
        done = CliRunner().invoke(app, ["trend", name, "--json", str(tmp_path / "t.json")])
        (row,) = json.loads((tmp_path / "t.json").read_text())
        alarms[name] = row["alarms"]
        assert done.exit_code == (4 if alarms[name] else 0), done.output
        assert row["n"] == 200  # first attempts: a re-test is none
        assert [p["serial"] for p in row["points"]] == sorted(p["serial"] for p in row["points"])
    assert alarms["flatness_um"] == alarms["k_closed_N_per_um"] == []

    (step,) = alarms["sensor_uF"]
    assert (step["rule"], step["direction"], step["place"]) == ("shift", "up", {"bench": "B2"})
    assert (step["first"], step["last"], step["since"], step["units"]) == ("Q-105", "Q-199", "2026-10-11", 50)
    assert step["size"] == pytest.approx(0.12, abs=step["U"])

    (lot,) = alarms["actuator_uF"]
    assert (lot["rule"], lot["direction"], lot["place"]) == ("shift", "down", {"lot": "LX"})
    assert (lot["first"], lot["last"]) == ("Q-140", "Q-159")
    assert lot["size"] == pytest.approx(-0.9, abs=lot["U"])

    drift, *dead = alarms["stroke_um"]
    assert (drift["rule"], drift["direction"], drift["place"]) == ("drift", "down", None)
    assert drift["size"] == pytest.approx(-8.0, abs=drift["U"])
    assert drift["first"] == "Q-000"
    assert [(a["rule"], a["first"], a["direction"]) for a in dead] == [("value", serial, "down") for serial in DEAD]
    assert all(a["size"] == pytest.approx(-175.0, abs=1.5 * a["U"]) for a in dead)

    with open_store() as store:
        frame = measurements(store)
    counted = yields(frame, "month").set_index("month").loc["2026-10"]
    assert (counted["units"], counted["first"]) == (200, 200 - len(first_failures(frame)))
    assert counted["last"] == counted["first"] + 2  # the two dead stacks pass now
    assert dict(zip(pareto(frame)["quantity"], pareto(frame)["units"], strict=True))["stroke_um"] == 2
    assert CliRunner().invoke(app, ["history", "Q-061", "--json", str(tmp_path / "h.json")]).exit_code == 0
    changed = {r["quantity"] for r in json.loads((tmp_path / "h.json").read_text()) if r["changed"]}
    assert "stroke_um" in changed


def first_failures(frame):
    """Serials with a first value outside the limits, counted from the values themselves."""
    first = frame.sort_values("seq").drop_duplicates(["serial", "quantity"])
    return set(first.loc[(first["value"] < first["lower"]) | (first["value"] > first["upper"]), "serial"])


@pytest.mark.slow
def test_the_causes_of_many_months_are_named():
    """Twelve months: every step and lot with its place, every dead stack; a drift of 2 sigma at least as a shift down.
    60 charts ring without a cause 2.4 times on average; 7 is 3 sd above."""
    others = drifts = 0
    for seed in range(100, 112):
        with open_store() as store:
            before = store.head().seq
            add(store, month(seed))
            frame = measurements(store)
        frame = frame[frame["seq"] > before].assign(attempt=1)
        found = {name: summary(trends(frame, name, "all")[0])["alarms"] for name in QUANTITIES}
        wanted = {
            "sensor_uF": lambda a: a["place"] == {"bench": "B2"} and a["direction"] == "up",
            "actuator_uF": lambda a: a["place"] == {"lot": "LX"} and a["direction"] == "down",
            "stroke_um": lambda a: a["rule"] in ("drift", "shift") and a["direction"] == "down" and not a["place"],
        }
        for name, alarms in found.items():
            gross = [a for a in alarms if a["first"] in DEAD and a["rule"] == "value"]
            named = [a for a in alarms if name in wanted and wanted[name](a)]
            assert bool(named) == (name in wanted), (seed, name, alarms)
            assert len(gross) == (2 if name == "stroke_um" else 0)
            drifts += any(a["rule"] == "drift" for a in named)
            others += len(alarms) - len(gross) - bool(named)
    assert drifts >= 8  # 85 to 93 % are called a drift, the others a shift; 8 of 12 is 3 sd below
    assert others <= 7


def test_a_baseline_of_the_first_days_finds_the_same_causes(tmp_path):
    """The baseline is the first five days: what drifted within them is in it."""
    stored(8)
    days = ("--baseline", "2026-10-01..2026-10-05")
    found = {}
    for name in QUANTITIES:
        done = CliRunner().invoke(app, ["trend", name, *days, "--json", str(tmp_path / "t.json")])
        assert done.exit_code in (0, 4), done.output
        found[name] = json.loads((tmp_path / "t.json").read_text())[0]["alarms"]
    assert found["flatness_um"] == found["k_closed_N_per_um"] == []
    (step,) = found["sensor_uF"]
    assert (step["first"], step["place"], step["direction"]) == ("Q-105", {"bench": "B2"}, "up")
    (lot,) = found["actuator_uF"]
    assert (lot["first"], lot["last"], lot["place"]) == ("Q-140", "Q-159", {"lot": "LX"})
    lasting = [a for a in found["stroke_um"] if a["rule"] == "shift"]
    assert lasting
    assert all(a["direction"] == "down" for a in lasting)
    assert {a["first"] for a in found["stroke_um"] if a["rule"] == "value"} == set(DEAD)
