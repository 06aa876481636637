"""Judging the store again under another spec, and sets of units that fit together."""

import gc
import hashlib
import json
import tracemalloc
from itertools import combinations

import numpy as np
import pytest

from accept.base.home import home
from accept.batch.judge_batch import BatchRequest, run
from accept.commands.fleet import selection
from accept.commands.trust.bench_keys import demo_credential
from accept.fleet.judged_again import judged_again
from accept.fleet.site.page_data import document
from accept.judging import load_spec
from accept.store import open_store
from accept.store import store as store_module
from tests.accept.fleet.judgements import U, add, judgement
from tests.accept.units.units import make_unit
from tests.shared.command_line import accept

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
        done = accept("rejudge", "--spec", tmp_path / "s.toml", "--json", tmp_path / "f.json")
        assert store.head() == head
    assert done.exit_code == 4, done.output
    rows = {r["serial"]: (r["was"], r["now"]) for r in json.loads((tmp_path / "f.json").read_text())}
    assert rows == {"B": ("accepted", "conditional"), "C": ("accepted", "rejected")}
    assert "2 of 4 units" in done.output


def test_a_simulated_unit_is_in_no_yield_trend_or_set_and_is_called_so(tmp_path):
    """Nine measured units of which four pass; a tenth, simulated, would pass and lie in the middle of the others."""
    with open_store() as store:
        values = {f"A-{n}": 4.9 + 0.01 * n if n < 4 else 4.0 for n in range(9)}
        add(store, [judgement(s, {"sensor_uF": v}) for s, v in values.items()])
        add(store, [judgement("SIM-1", {"sensor_uF": 4.9}, simulated=True)])
        page = document(store, {})
    out = tmp_path / "f.json"

    def rows(*words: object) -> list:
        done = accept(*words, "--json", out)
        assert done.exit_code in (0, 4), done.output
        assert words[0] == "list" or "1 simulated and not counted: SIM-1 attempt 1" in done.output
        return json.loads(out.read_text())

    (group,) = rows("yield", "--by", "kind")
    assert (group["units"], group["first"], group["last"]) == (9, 4, 4)
    (trend,) = rows("trend", "sensor_uF")
    assert trend["n"] == 9
    assert "SIM-1" not in {point["serial"] for point in trend["points"]}
    assert {row["serial"]: row["simulated"] for row in rows("list")} == dict.fromkeys(values, False) | {"SIM-1": True}
    matched = accept("match", "--kind", "apa", "--by", "sensor_uF", "--n", "5")
    assert matched.exit_code == 6, matched.output  # four accepted units are too few for a set of five
    shown = {j["serial"]: (j["simulated"], j["first"], j["passed"]) for j in page["judgements"]}
    assert shown["SIM-1"] == (True, False, False)
    assert shown["A-0"] == (False, True, True)


def test_memory_does_not_depend_on_how_many_units_there_are(tmp_path, monkeypatch):
    """Ten times the units take as much at the peak, but for a tenth: one page of the store is held at once. A store of
    100,000 units is in benchmarks/bench_store.py."""
    monkeypatch.setattr(store_module, "_PAGE", 40)
    (tmp_path / "s.toml").write_text(SPEC)
    specs = {"apa": load_spec(str(tmp_path / "s.toml"))}

    def peak(units: int) -> int:
        with open_store(f"sqlite:///{tmp_path / str(units)}.sqlite") as store:
            add(store, [judgement(f"A-{n:04d}", {"sensor_uF": 4.95 - 0.2 * (n % 2)}) for n in range(units)])
            gc.collect()
            tracemalloc.start()
            flipped = sum(unit.flipped for unit in judged_again(store, specs, False))
            found = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        assert flipped == units // 2
        return found

    peak(40)  # what is loaded once is loaded
    assert peak(1200) < 1.1 * peak(120)


def test_a_certificate_stays_as_it_is(tmp_path):
    """Judged again to another verdict, by values and from records: no file and no event is new or another."""
    folder = make_unit(tmp_path / "u", "U-1")
    specs = {"apa": load_spec("apa-basic")}
    order = BatchRequest([folder], tmp_path / "out", specs, "Ada", credential=demo_credential(home()), workers=1)
    with open_store() as store:
        assert run(order, store, lambda _: None).verdicts == {"accepted": 1}
    (tmp_path / "s.toml").write_text(SPEC.replace("4.9\n", "5.4\n"))
    with open_store() as store:
        head, before = store.head(), contents(tmp_path)
        for more in ((), ("--records",)):
            again = accept("rejudge", "--spec", tmp_path / "s.toml", *more)
            assert again.exit_code == 4, again.output
            assert "1 of 1 units" in again.output
        assert store.head() == head
    assert contents(tmp_path) == before
    assert "out/certificates/U-1.pdf" in before


def contents(folder):
    """Hash of every file by its name."""
    files = (p for p in folder.rglob("*") if p.is_file())
    return {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def test_more_flips_than_a_terminal_shows(tmp_path, monkeypatch):
    monkeypatch.setattr(selection, "SHOWN", 2)
    (tmp_path / "s.toml").write_text(SPEC)
    with open_store() as store:
        add(store, [judgement(s, {"sensor_uF": 4.8}) for s in ("C", "A", "B")])
    done = accept("rejudge", "--spec", tmp_path / "s.toml", "--csv", tmp_path / "f.csv")
    assert "3 of 3 units" in done.output
    assert "the first 2 are shown" in done.stderr
    assert [line.split(",")[0] for line in (tmp_path / "f.csv").read_text().splitlines()] == ["serial", "A", "B", "C"]


def test_from_records_where_they_are_unchanged(tmp_path):
    make_unit(tmp_path / "u", "U-1")
    assert accept("batch", tmp_path / "u", "--out", tmp_path / "out", "--no-certificates").exit_code in (0, 4)
    (tmp_path / "s.toml").write_text(SPEC.replace("4.9\n", "5.4\n"))
    done = accept("rejudge", "--spec", tmp_path / "s.toml", "--records", "--json", tmp_path / "f.json")
    (row,) = json.loads((tmp_path / "f.json").read_text())
    assert row["judged_from"] == "records", done.output
    (tmp_path / "u" / "unit.toml").write_text((tmp_path / "u" / "unit.toml").read_text() + "\n# touched\n")
    done = accept("rejudge", "--spec", tmp_path / "s.toml", "--records", "--json", tmp_path / "f.json")
    assert "1 of 1 units were not measured again" in done.stderr
    assert "(U-1)" in done.stderr
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
    done = accept("match", "--n", 6, "--kind", "apa", *by, "--json", tmp_path / "m.json")
    assert done.exit_code == 0, done.output
    chosen = [r["serial"] for r in json.loads((tmp_path / "m.json").read_text())]
    assert cost(chosen) == pytest.approx(cost(best), rel=1e-6)
    assert "one more unit with sensor_uF" in done.output
    assert accept("match", "--n", 6, "--sets", 2, "--kind", "apa", *by).exit_code == 6  # eleven are too few
    assert "no accepted apa has k_um" in accept("match", "--kind", "apa", "--by", "k_um").output
