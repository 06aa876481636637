"""Questions over units and time, as a QA engineer asks them, on a store whose content is known."""

import datetime
import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.special import ndtri

from accept.fleet.history import changes
from accept.fleet.history import panels as history_panels
from accept.fleet.measurements import day, is_between, measurements
from accept.fleet.trend import trends
from accept.fleet.yields import panels as yield_panels
from accept.fleet.yields import pareto, yields
from accept.store import open_store
from accept.store.payloads import InstrumentChecked
from checks.picture import Band, Line, Text
from tests.accept.fleet.judgements import add, judgement
from tests.shared.command_line import accept

OCTOBER, NOVEMBER = (datetime.datetime(2026, month, 12, 9, tzinfo=datetime.UTC) for month in (10, 11))


@pytest.fixture
def bench():
    """October: ten units, three fail, one of them is repaired in November; November: five units on another bench."""
    with open_store() as store:
        good = {"sensor_uF": 5.0, "stroke_um": 360.0}
        add(store, [judgement(f"A-{i:02d}", good, "bench-1") for i in range(7)], at=OCTOBER)
        bad = [good | {"sensor_uF": 1.7}, good | {"sensor_uF": 1.8}, good | {"stroke_um": 180.0}]
        add(store, [judgement(f"A-{7 + i:02d}", v, "bench-1") for i, v in enumerate(bad)], at=OCTOBER)
        add(store, [judgement(f"B-{i:02d}", good, "bench-2") for i in range(5)], who="Bob", at=NOVEMBER)
        add(store, [judgement("A-07", good | {"stroke_um": 360.3}, "bench-2")], who="Bob", at=NOVEMBER)


def test_what_failed_this_month_and_why(bench, tmp_path):
    done = accept(
        "list", "--failed", "--all-attempts", "--since", "2026-10", "--until", "2026-10", "--json", tmp_path / "l"
    )
    assert done.exit_code == 0, done.output
    rows = json.loads((tmp_path / "l").read_text())
    assert [(r["serial"], r["causes"]) for r in rows] == [
        ("A-07", "sensor_uF"), ("A-08", "sensor_uF"), ("A-09", "stroke_um"),
    ]  # fmt: skip
    assert rows[0]["why"] == "Sensor stack 1.700 uF: fail (4.4 to 5.5)"
    assert rows[2]["why"] == "Stroke, three stacks 180.00 um: fail (at least 304)"
    assert len(json_list(tmp_path, "--failed")) == 2  # A-07 has been accepted since
    assert [r["serial"] for r in json_list(tmp_path, "--check", "stroke")] == ["A-09"]
    assert "there are: capacitance" in accept("list", "--check", "strok").output


def json_list(tmp_path, *words):
    assert accept("list", *words, "--json", tmp_path / "j").exit_code == 0
    return json.loads((tmp_path / "j").read_text())


def test_what_changed_significantly(bench, tmp_path):
    done = accept("history", "A-07", "--json", tmp_path / "h")
    assert done.exit_code == 0
    rows = [r for r in json.loads((tmp_path / "h").read_text()) if r["attempt"] == 2]
    changed = {r["quantity"]: (r["changed"], r["En"]) for r in rows}
    assert changed["sensor_uF"] == (True, pytest.approx(3.3 / np.hypot(0.02, 0.02)))
    assert changed["stroke_um"] == (False, pytest.approx(0.3 / np.hypot(0.5, 0.5)))
    assert "Sensor stack (sensor_uF) changed by +3.3 uF" in done.output
    assert "Stroke, three stacks (stroke_um) 360.30 0.50 um" in " ".join(done.output.split())  # to the digits of U
    assert accept("history", "Z").exit_code == 6


def test_tables_name_quantities_by_their_labels_and_leave_out_what_says_nothing(bench):
    shown = accept("list", "--failed", "--all-attempts").output
    assert "Sensor stack" in shown
    assert "sensor_uF" not in shown  # code names are in the files, and in `history` beside the label
    assert "unit_verdict" not in shown
    assert "En" not in accept("history", "A-01").output.split()  # one attempt: nothing changed
    assert "bench-1" in shown


def test_first_pass_yield_and_its_causes(bench):
    with open_store() as store:
        frame = measurements(store)
    made = yields(frame, "month").set_index("month")
    assert (made.at["2026-10", "units"], made.at["2026-10", "first"], made.at["2026-10", "last"]) == (10, 7, 8)
    assert made.at["2026-10", "lo"] == pytest.approx(0.3968, abs=1e-4)  # Wilson 1927, 7 of 10
    assert made.at["2026-10", "hi"] == pytest.approx(0.8922, abs=1e-4)
    causes = pareto(frame)
    assert list(zip(causes["quantity"], causes["units"], strict=True)) == [("sensor_uF", 2), ("stroke_um", 1)]
    assert "70.0%" in accept("yield", "--by", "month").output
    assert set(yields(frame, "bench")["bench"]) == {"bench-1", "bench-2"}
    assert set(yields(frame, "operator")["operator"]) == {"Ann", "Bob"}


def test_pictures_show_what_the_tables_say(bench, tmp_path):
    """Bars as long as the shares and counts; of a history the bars of U, and what changed apart from what did not."""
    for words in (("yield",), ("history", "A-07")):
        assert accept(*words, "--plot", tmp_path / "p.svg").exit_code == 0
        assert (tmp_path / "p.svg").read_bytes().startswith(b"<?xml")
        assert accept(*words, "--plot", tmp_path / "p.gif").exit_code == 6
    with open_store() as store:
        frame = measurements(store)
    made, causes = yields(frame, "month"), pareto(frame)
    passed, stopped = yield_panels(made, causes, "month")
    assert [item.x[1] for item in passed.items if isinstance(item, Band)] == list(100 * made["first_pass"])
    assert [item.x[1] for item in stopped.items if isinstance(item, Band)] == list(causes["units"])
    assert next(item.words for item in passed.items if isinstance(item, Text)) == "2026-10: 7 of 10"
    assert len(yield_panels(made, causes.head(0), "month")) == 1  # nothing stopped anything: no empty axes
    sensor, stroke = history_panels(changes(frame[frame["serial"] == "A-07"]))
    assert (sensor.title, stroke.x_label) == ("Sensor stack", "Stroke, three stacks [um]")
    assert [list(item.x) for item in sensor.items if isinstance(item, Line) and item.role == "bad"] == [[5.0]]
    assert not [item for item in stroke.items if isinstance(item, Line) and item.role == "bad"]
    assert list(sensor.items[0].x) == [1.68, 1.72]


@pytest.mark.parametrize(
    ("text", "first", "last"),
    [("2026-02", "2026-02-01", "2026-02-28"), ("9999-12", "9999-12-01", "9999-12-31"), ("2026-10-05",) * 3],
)
def test_days_and_months(text, first, last):
    assert (str(day(text)), str(day(text, last=True))) == (first, last)


def test_days_count_whole():
    frame = pd.DataFrame({"time": pd.to_datetime(["2026-10-31T23:59:59Z", "2026-11-01T00:00:00Z"], utc=True)})
    frame["measured"] = pd.Series([pd.NaT] * 2, dtype=frame["time"].dtype)
    assert is_between(frame, day("2026-10"), day("2026-10", last=True)).sum() == 1


@pytest.mark.parametrize(
    "words",
    [("list", "--since", "October"), ("trend", "nothing_um"), ("history", "x"), ("yield",), ("match",), ("rr",)],
)
def test_questions_that_have_no_answer_end_in_one_line(words):
    done = accept(*words)
    assert done.exit_code == 6
    assert done.output.startswith("accept: ")
    assert done.output.count("\n") == 1


def test_a_drift_rings_and_a_steady_process_does_not(tmp_path):
    rng = np.random.default_rng(1)
    with open_store() as store:
        steady = 360.0 + 2.0 * rng.permutation(ndtri((np.arange(40) + 0.5) / 40))  # no value is extreme
        drifting = 5.0 + 0.03 * rng.standard_normal(40) + np.linspace(0, 0.25, 40)
        values = zip(steady, drifting, strict=True)
        add(store, [judgement(f"T-{i:02d}", {"stroke_um": s, "sensor_uF": c}) for i, (s, c) in enumerate(values)])
    quiet = accept("trend", "stroke_um", "--plot", tmp_path / "t.svg", "--json", tmp_path / "t.json")
    assert quiet.exit_code == 0, quiet.output
    assert (tmp_path / "t.svg").read_text().startswith("<?xml")
    (row,) = json.loads((tmp_path / "t.json").read_text())
    assert row["Cpk_lo"] < row["Cpk"] < row["Cpk_hi"]
    assert row["Ppk"] == pytest.approx((steady.mean() - 304.0) / (3.0 * steady.std(ddof=1)))
    assert row["mean"] == pytest.approx(steady.mean())
    assert [p["serial"] for p in row["points"]] == [f"T-{i:02d}" for i in range(40)]
    rang = accept("trend", "sensor_uF", "--json", tmp_path / "t.json")
    assert rang.exit_code == 4
    (row,) = json.loads((tmp_path / "t.json").read_text())
    (alarm,) = row["alarms"]
    assert alarm["rule"] in ("drift", "shift")
    assert alarm["direction"] == "up"
    assert not row["in_control"]
    assert any("not in control" in words for words in row["cautions"])
    assert accept("trend", "sensor_uF", "--rules", "9").exit_code == 6


def test_a_unit_judged_by_a_short_spec_first_is_attempted_once_for_each_quantity():
    """Fourteen units whose capacitance was judged first, the whole unit later; two are rejected then."""
    with open_store() as store:
        add(store, [judgement(f"S-{i:02d}", {"sensor_uF": 5.0, "stroke_um": None}) for i in range(14)], at=OCTOBER)
        values = [{"sensor_uF": 5.0, "stroke_um": 360.0 if i > 1 else 180.0} for i in range(14)]
        add(store, [judgement(f"S-{i:02d}", v) for i, v in enumerate(values)], at=NOVEMBER)
        frame = measurements(store)
    made = yields(frame, "kind").set_index("kind")
    assert (made.at["apa", "units"], made.at["apa", "first"]) == (14, 12)
    assert [t.rows.shape[0] for t in trends(frame, "stroke_um", "all")] == [14]
    assert list(pareto(frame)["quantity"]) == ["stroke_um"]


def test_a_period_makes_no_retest_a_first_attempt(bench):
    """A-07 failed in October and passed in November: November has the five units of its own."""
    with open_store() as store:
        frame = measurements(store)
    asked = frame["time"].dt.month == 11
    made = yields(frame, "month", asked).set_index("month")
    assert (made.at["2026-11", "units"], made.at["2026-11", "first"]) == (5, 5)
    assert pareto(frame, asked).empty
    assert accept("yield", "--since", "2026-11", "--kind", "apa").exit_code == 0


def test_charts_do_not_depend_on_which_worker_was_done_first():
    """Forty units stored in two orders, with their place in the batch: the same chart."""
    values = 360.0 + 2.0 * np.random.default_rng(3).standard_normal(40)
    made = []
    for order in (np.arange(40), np.random.default_rng(4).permutation(40)):
        with open_store() as store:
            events = [judgement(f"O-{i:02d}", {"stroke_um": values[i]}) for i in order]
            placed = [
                replace(e, payload={**e.payload, "batch": {"seq": 1, "place": int(i)}})
                for e, i in zip(events, order, strict=True)
            ]
            add(store, placed, at=OCTOBER)
            frame = measurements(store)
        frame = frame[frame["seq"] > 40 * len(made)].assign(attempt=1)
        (trend,) = trends(frame, "stroke_um", "all")
        made.append(trend.rows["value"].to_numpy())
    assert (made[0] == values).all()
    assert (made[1] == values).all()


def month_with_a_step(at_bench_2: float) -> None:
    """Twenty days, ten units a day at two benches; from the eleventh day on bench-2 reads this much more."""
    rng = np.random.default_rng(12)
    with open_store() as store:
        for d in range(20):
            at = datetime.datetime(2026, 10, 1 + d, 9, tzinfo=datetime.UTC)
            step = at_bench_2 if d >= 10 else 0.0
            for n in range(10):
                bench = f"bench-{1 + n % 2}"
                value = 360.0 + 2.0 * rng.standard_normal() + (step if bench == "bench-2" else 0.0)
                lot = {"origin": {"lot": f"L{d // 5}"}}
                event = judgement(f"M-{d:02d}-{n}", {"stroke_um": value}, bench)
                result = {**event.payload["result"], **lot}
                add(store, [replace(event, payload={**event.payload, "result": result})], at=at)


def test_a_baseline_is_kept_and_what_leaves_it_is_named_with_its_place(tmp_path):
    """A step of 2 sigma at one bench: named with direction, size, first day and bench; nothing rings at the other. The
    baseline's limits are frozen: they are those of the first eight days however many units follow."""
    month_with_a_step(4.0)
    days = ("--baseline", "2026-10-01..2026-10-08")
    assert accept("trend", "stroke_um", "--by", "bench", *days, "--json", tmp_path / "t.json").exit_code == 4
    one, two = json.loads((tmp_path / "t.json").read_text())
    assert one["alarms"] == []
    (alarm,) = [a for a in two["alarms"] if a["rule"] == "shift"]
    assert alarm["direction"] == "up"
    assert alarm["size"] == pytest.approx(4.0, abs=alarm["U"])
    assert "2026-10-10" <= alarm["since"] <= "2026-10-12"  # it began on the 11th
    assert two["baseline"]["n"] == 40
    assert accept("trend", "stroke_um", *days).exit_code == 4
    assert accept("trend", "stroke_um", "--json", tmp_path / "t.json").exit_code == 4  # kept for the next question
    (row,) = json.loads((tmp_path / "t.json").read_text())
    assert row["baseline"]["until"] == "2026-10-08"
    assert any("only at bench bench-2" in a["words"] for a in row["alarms"])
    assert accept("trend", "stroke_um", *days).exit_code == 6  # a revision needs its reason
    assert accept("trend", "stroke_um", *days, "--reason", "new probe").exit_code == 4
    assert accept("trend", "stroke_um", "--baseline", "October").exit_code == 6


def test_the_reference_of_an_instrument_has_a_chart(tmp_path):
    """40 days of `accept hw check lcr`; from the 25th on the instrument reads 3 sigma more: a shift, with its day."""
    rng = np.random.default_rng(21)
    with open_store() as store:
        for d in range(40):
            value = 10.0 + 0.01 * rng.standard_normal() + (0.03 if d >= 25 else 0.0)
            time = f"{datetime.date(2026, 8, 1) + datetime.timedelta(d)}T08:00:00+00:00"
            E_n = (value - 10.0) / np.hypot(0.05, 0.02)
            checked = InstrumentChecked(
                "lcr", "E912", time, "capacitance standard", "C-7", "uF", 10.0, 0.02, value, 0.05, (value,), E_n,
                bool(abs(E_n) <= 1.0), {},
            )  # fmt: skip
            store.write(checked, who="Ann")
    done = accept("trend", "check:lcr", "--json", tmp_path / "t", "--plot", tmp_path / "t.svg")
    assert done.exit_code == 4, done.output
    (row,) = json.loads((tmp_path / "t").read_text())
    (alarm,) = row["alarms"]
    assert (alarm["rule"], alarm["direction"], row["n"]) == ("shift", "up", 40)
    assert "2026-08-25" <= alarm["since"] <= "2026-08-27"
    assert alarm["size"] == pytest.approx(0.03, abs=alarm["U"])
    done = accept("trend", "check:probe")
    assert (done.exit_code, "lcr" in done.output) == (6, True)


def test_lots_can_be_grouped_by(tmp_path):
    month_with_a_step(0.0)
    assert accept("yield", "--by", "lot", "--json", tmp_path / "y.json").exit_code == 0
    rows = json.loads((tmp_path / "y.json").read_text())
    assert {row["lot"]: row["units"] for row in rows} == {f"L{i}": 50 for i in range(4)}


def test_an_unknown_verdict_is_refused_and_lists_nothing(bench):
    assert accept("list", "--verdict", "reject").exit_code == 2


def test_benches_and_operators_have_charts_of_their_own(tmp_path):
    """Two benches that differ by five sigma, and an operator at each, unit by unit in turn: apart, each is a process in
    control about its own mean; the mean of both together is neither's."""
    steady = 2.0 * np.random.default_rng(1).permutation(ndtri((np.arange(40) + 0.5) / 40))
    with open_store() as store:
        for i, z in enumerate(steady):
            for mean, bench, who in ((355.0, "bench-1", "Ann"), (365.0, "bench-2", "Bob")):
                add(store, [judgement(f"{who}-{i:02d}", {"stroke_um": mean + z}, bench)], who=who)
    for by, names in (("bench", ("bench-1", "bench-2")), ("operator", ("Ann", "Bob"))):
        done = accept("trend", "stroke_um", "--by", by, "--json", tmp_path / "t.json")
        assert done.exit_code == 0, done.output
        rows = {row["group"]: (row["mean"], row["n"]) for row in json.loads((tmp_path / "t.json").read_text())}
        assert rows == {name: (pytest.approx(m + steady.mean()), 40) for name, m in zip(names, (355, 365), strict=True)}


def test_nothing_from_a_serial_runs_in_a_spreadsheet_or_a_terminal(tmp_path):
    with open_store() as store:
        add(store, [judgement("=cmd|'/c calc'!A1\x1b[31m", {"sensor_uF": 5.0})])
    done = accept("list", "--csv", tmp_path / "l.csv")
    assert "\x1b" not in done.output
    assert "'=cmd" in (tmp_path / "l.csv").read_text()
