"""Judging the store again under another spec, and sets of units that fit together."""

import json
from itertools import combinations

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from accept.store import open_store
from tests.accept.fleet.judgements import U, add, judgement
from tests.accept.units.units import make_unit


def ask(*words: object):
    return CliRunner().invoke(app, [str(w) for w in words])


SPEC = """name = "tighter"
kind = "apa"
title = "Tighter capacitance"
[checks.capacitance.limits.sensor_uF]
lower = 4.9
upper = 5.5
unit = "uF"
rule = "guarded"
source = "test"
"""


def test_flips_and_nothing_else_changes(tmp_path):
    """4.95 +- 0.02 holds 4.9 guarded, 4.91 is open, 4.8 fails; a value that is missing stays without a result."""
    (tmp_path / "s.toml").write_text(SPEC)
    with open_store() as store:
        values = {"A": 4.95, "B": 4.91, "C": 4.8, "D": None}
        add(store, [judgement(s, {"sensor_uF": v}) for s, v in values.items()])
        head = store.head()
        done = ask("rejudge", "--spec", tmp_path / "s.toml", "--json", tmp_path / "f.json")
        assert store.head() == head
    assert done.exit_code == 4, done.output
    rows = {r["serial"]: (r["was"], r["now"]) for r in json.loads((tmp_path / "f.json").read_text())}
    assert rows == {"B": ("accepted", "conditional"), "C": ("accepted", "rejected")}
    assert "2 of 4 units" in done.output


def test_from_records_where_they_are_unchanged(tmp_path):
    make_unit(tmp_path / "u", "U-1")
    assert ask("batch", tmp_path / "u", "--out", tmp_path / "out", "--no-certificates").exit_code in (0, 4)
    (tmp_path / "s.toml").write_text(SPEC.replace("4.9\n", "5.4\n"))
    done = ask("rejudge", "--spec", tmp_path / "s.toml", "--records", "--json", tmp_path / "f.json")
    (row,) = json.loads((tmp_path / "f.json").read_text())
    assert row["judged_from"] == "records", done.output
    (tmp_path / "u" / "unit.toml").write_text((tmp_path / "u" / "unit.toml").read_text() + "\n# touched\n")
    ask("rejudge", "--spec", tmp_path / "s.toml", "--records", "--json", tmp_path / "f.json")
    assert json.loads((tmp_path / "f.json").read_text())[0]["judged_from"] == "stored values"


def test_the_six_that_fit_best_are_the_best_of_all(tmp_path):
    rng = np.random.default_rng(8)
    values = {f"A-{i:02d}": (5.0 + 0.1 * rng.standard_normal(), 360 + 2 * rng.standard_normal()) for i in range(11)}
    with open_store() as store:
        add(store, [judgement(s, {"sensor_uF": c, "stroke_um": d}) for s, (c, d) in values.items()])
        add(store, [judgement("A-99", {"sensor_uF": 5.0, "stroke_um": 100.0})])  # rejected: never chosen

    def cost(chosen):
        x = np.array([values[s] for s in chosen]) / [U["sensor_uF"], U["stroke_um"]]
        return np.ptp(x, axis=0).sum()

    best = min(combinations(values, 6), key=cost)
    by = ("--by", "sensor_uF", "--by", "stroke_um")
    done = ask("match", "--n", 6, "--kind", "apa", *by, "--json", tmp_path / "m.json")
    assert done.exit_code == 0, done.output
    chosen = [r["serial"] for r in json.loads((tmp_path / "m.json").read_text())]
    assert cost(chosen) == pytest.approx(cost(best), rel=1e-6)
    assert "one more unit with sensor_uF" in done.output
    assert ask("match", "--n", 6, "--sets", 2, "--kind", "apa", *by).exit_code == 6  # eleven are too few
    assert "no accepted apa has k_um" in ask("match", "--kind", "apa", "--by", "k_um").output
