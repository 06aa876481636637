"""The chart of a golden unit by command: a drift that two stated uncertainties let pass, and the units meanwhile."""

import datetime
import json

import numpy as np
import pandas as pd
import pytest

from accept.fleet.golden import name_golden
from accept.fleet.golden_chart import golden_trends
from accept.fleet.site.page_data import document
from accept.store import open_store
from accept.store.payloads import InstrumentChecked
from tests.accept.fleet.judgements import add, judgement
from tests.shared.command_line import accept

FIRST = datetime.date(2026, 7, 6)
GOLDEN = "APA-GOLD"


def day(n: int) -> datetime.date:
    return FIRST + datetime.timedelta(days=n)


@pytest.fixture(autouse=True)
def drifted():
    """Sixty days, the golden unit at the start of each: repeatability 0.3 um; from day 30 on 0.1 um more each day,
    to day 45; two benches, the other one is as it was."""
    rng = np.random.default_rng(5)
    with open_store() as store:
        for n in range(60):
            off = 0.1 * (n - 29) if 30 <= n < 45 else 0.0
            at = datetime.datetime.combine(day(n), datetime.time(16), datetime.UTC)
            values = {"stroke_um": 360.0 + 0.3 * rng.standard_normal() + off, "sensor_uF": 5.0}
            made = [judgement(GOLDEN, values, "B1", day=day(n))]
            made += [judgement(f"A-{n:02d}{k}", {"stroke_um": 358.0 + k}, f"B{k}", day=day(n)) for k in (1, 2)]
            add(store, made, at=at)
            if n == 0:
                name_golden(store, GOLDEN, "accepted", "Grace")


def test_it_finds_the_drift_its_end_and_the_units_in_between(tmp_path):
    done = accept(
        "golden", "chart", "--json", tmp_path / "c", "--csv", tmp_path / "u.csv", "--plot", tmp_path / "c.svg"
    )
    assert done.exit_code == 4, done.output
    charts = {each["quantity"]: each for each in json.loads((tmp_path / "c").read_text())}
    assert charts["sensor_uF"]["alarms"] == []
    (alarm,) = charts["stroke_um"]["alarms"]
    # The sum leaves zero within the first days of the drift, of 0.3 um in three days, and ends with it.
    assert f"{day(30)}" <= alarm["first"] <= f"{day(36)}"
    assert (alarm["last"], alarm["good_again"]) == (f"{day(44)}", f"{day(45)}")
    assert alarm["direction"] == "up"
    assert charts["stroke_um"]["repeatability"] == pytest.approx(0.3, rel=0.35)  # 45 values: 3 sd
    units = pd.read_csv(tmp_path / "u.csv")
    since = datetime.date.fromisoformat(alarm["last_good"])
    expected = [f"A-{n:02d}1" for n in range((since - FIRST).days, 45)]
    assert list(units["serial"]) == expected
    assert f"{len(expected)} units judged since the last good day" in done.output
    assert units["why"].str.contains(GOLDEN).all()
    assert (tmp_path / "c.svg").stat().st_size > 5000


def test_the_check_of_a_shift_and_the_trend_say_so():
    assert "chart of APA-GOLD" in " ".join(accept("golden", "check").output.split())
    done = accept("trend", "stroke_um", "--by", "bench")
    assert "B1: " in done.output
    assert "judged since the last good day of the golden unit APA-GOLD" in " ".join(done.output.split())


def test_the_page_marks_them():
    with open_store() as store:
        page = document(store, {})
        (chart,) = golden_trends(store, quantity="stroke_um")
    since = str(chart.doubts[0].since.date())
    marked = {j["serial"] for j in page["judgements"] if j["doubt"]}
    assert marked == {f"A-{n:02d}1" for n in range(60) if since <= str(day(n)) < str(day(45))}
    assert [words for words in page["goldens"]["stroke_um"] if GOLDEN in words]


def test_the_drift_is_among_what_happened_on_these_days_and_rings():
    with open_store() as store:
        pages = {n: document(store, {}, since=day(n), until=day(n + 2)) for n in (5, 40, 50)}
        whole = document(store, {})
    rows = {n: [r for r in page["happenings"] if r["kind"] == "alarm"] for n, page in pages.items()}
    assert {n: len(found) for n, found in rows.items()} == {5: 0, 40: 1, 50: 0}
    (row,) = rows[40]
    assert (row["unit"], row["day"]) == (GOLDEN, str(day(40)))  # a page of these days shows it on the first of them
    assert row["words"].startswith(f"golden unit {GOLDEN}")
    assert pages[40]["rings"]["goldens"] == [row["words"].removeprefix("golden unit ")]
    assert (pages[40]["rings"]["alarms"], pages[5]["rings"]["alarms"]) == (1, 0)
    (note,) = whole["golden_notes"]["stroke_um"]
    assert "with 60 comparisons that repeat within" in note


def test_no_golden_unit_no_chart(tmp_path, monkeypatch):
    done = accept("golden", "chart", "APA-9")
    assert done.exit_code == 6
    assert "golden units: APA-GOLD" in " ".join(done.output.split())


def test_the_page_of_other_days_has_no_alarm_of_a_golden_unit_that_was_good_then():
    with open_store() as store:
        pages = {n: document(store, {}, since=day(n), until=day(n + 2)) for n in (5, 40, 50)}
    assert {n: len(page["goldens"]["stroke_um"]) for n, page in pages.items()} == {5: 0, 40: 1, 50: 0}


def test_a_missed_reference_of_an_instrument_without_serial_number_is_no_less_listed():
    checked = InstrumentChecked(
        "lcr", None, "2026-09-07T08:00:00+00:00", "capacitance standard", "C-7", "uF", 10.0, 0.02, 10.2, 0.05,
        (10.2,), 3.7, False, {},
    )  # fmt: skip
    with open_store() as store:
        store.write(checked, who="Ann")
        (row,) = [row for row in document(store, {})["happenings"] if row["kind"] == "recall"]
    assert row["unit"] == "lcr"
    assert "it states no serial number" in row["words"]
