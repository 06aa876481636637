"""A quarter as quality assurance works it: copied numbers ring and make no limits, each stopped unit counts once, and a
golden unit is no part of the process."""

import datetime
import json
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import Result

from accept.fleet.measurements import measurements
from accept.fleet.process_control.capability import capability
from accept.fleet.site.page_data import document
from accept.fleet.trend import chart_panels, trends
from accept.fleet.yields import panels, pareto, yields
from accept.store import NewEvent, open_store
from accept.store.payloads import Disposition, GoldenMet, GoldenMissed, InstrumentChecked, NonconformanceDecided
from checks.picture import Line, Mark
from tests.accept.fleet.judgements import add, judgement
from tests.accept.fleet.quarter import COPIED, COPY, FAILED, GOLDEN, HELD, NOT_MEASURED, fill
from tests.shared.command_line import accept

UNITS = 520
COPIES = 160 - 1  # Ben's units from then on; one of them failed with a value of its own
STOPPED = len(FAILED) + len(HELD) + 2


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    place = tmp_path_factory.mktemp("quarter")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACCEPT_HOME", str(place))
        with open_store() as store:
            fill(store)
    return place


@dataclass(frozen=True)
class Asked:
    """What is asked of the quarter as it was filled, once for all tests."""

    frame: pd.DataFrame
    page: Mapping[str, Any]

    @classmethod
    def of(cls, home: Path) -> "Asked":
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("ACCEPT_HOME", str(home))
            with open_store() as store:
                return cls(measurements(store), document(store, {}))


@pytest.fixture(scope="module")
def asked(filled: Path, tmp_path_factory: pytest.TempPathFactory) -> Asked:
    """Not to be changed. (Of a copy: an open store writes beside itself.)"""
    return Asked.of(shutil.copytree(filled, tmp_path_factory.mktemp("asked") / "bench"))


@pytest.fixture(autouse=True)
def quarter(filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_HOME", str(shutil.copytree(filled, tmp_path / "bench")))


def said(done: Result) -> str:
    return " ".join(done.output.split())


def trend_of(path: Path, *words: object) -> dict[str, dict]:
    assert accept("trend", "sensor_uF", *words, "--json", path).exit_code == 4
    return {group["group"]: group for group in json.loads(path.read_text())}


def test_copied_numbers_ring_in_the_chart_of_all_and_in_that_of_who_copied_them(tmp_path):
    for by, group in (("all", "all"), ("operator", "Ben"), ("bench", "LCR-2")):
        found = trend_of(tmp_path / "t", "--by", by)[group]
        equal = [alarm for alarm in found["alarms"] if alarm["rule"] == "equal"]
        assert sum(alarm["units"] for alarm in equal) == COPIES
        assert equal[0]["since"] == "2026-08-10"
        assert all(alarm["place"] == {"operator": "Ben"} for alarm in equal)
        assert f"{equal[0]['units']} equal values of {COPIED:g} uF in a row by operator Ben" in equal[0]["words"]
        assert f"{COPIES} equal values are not used for the limits" in found["cautions"]
        # The only other alarm is the one value that is far off; none of the values before the copied ones.
        assert [a["first"] for a in found["alarms"] if a["rule"] != "equal"] == ["APA-0404"]


def test_copied_numbers_make_neither_limits_nor_a_capability(tmp_path):
    groups = trend_of(tmp_path / "t", "--by", "operator")
    ben, ann = groups["Ben"], groups["Ann"]
    # 100 readings of 0.13 uF know their standard deviation to 9 %: 3 sd; the copied ones made it 0.05.
    assert ben["baseline"]["sigma"] == pytest.approx(0.13, rel=0.27)
    assert ben["Cpk"] is ben["Ppk"] is ben["sigma_within"] is None
    assert any("no capability: 159 of 260 values are runs of equal ones" in words for words in ben["cautions"])
    values = [p["value"] for p in ann["points"]]
    assert ann["Cpk"] == pytest.approx(capability(values, 4.4, 5.5).Cpk.value)


def test_a_month_of_copied_numbers_alone_rings_as_such_and_by_no_rounding_error(tmp_path):
    ben = trend_of(tmp_path / "t", "--by", "operator", "--since", "2026-09", "--until", "2026-09")["Ben"]
    # beside them the one value that he measured, which the other quantities of its unit contradict
    assert {alarm["rule"] for alarm in ben["alarms"]} == {"equal", "unlike"}
    assert [alarm["first"] for alarm in ben["alarms"] if alarm["rule"] == "unlike"] == ["APA-0404"]
    assert ben["limits"] is None
    assert not ben["in_control"]


def test_a_baseline_is_made_of_measured_values(asked):
    days = ("--baseline", "2026-07-06..2026-09-20")
    (made,) = trends(asked.frame[asked.frame["operator"] == "Ben"], "sensor_uF", "all")
    done = accept("trend", "sensor_uF", "--by", "operator", *days)
    assert done.exit_code == 4, done.output
    with open_store() as store:
        stated = [e.data for e in store.events(what="baseline_set") if e.data["group"] == "operator: Ben"]
    assert stated[0]["sigma"] == pytest.approx(made.chart.baseline.sigma)


def test_sets_of_copied_numbers_are_no_best_match():
    done = accept("match", "--kind", "apa", "--by", "sensor_uF", "--by", "stroke_um", "--n", 3, "--sets", 1)
    assert done.exit_code == 0, done.output
    assert f"equal values of sensor_uF in a row: {COPIED:g} uF, by operator Ben" in said(done)
    assert f"{COPIED:g} " not in said(done).partition("set serial")[2].partition("median U")[0]


def test_each_stopped_unit_counts_once_under_its_cause(asked):
    frame, page = asked.frame, asked.page
    made, causes = yields(frame, "kind"), pareto(frame)
    assert (made["units"].sum(), made["first"].sum()) == (UNITS, UNITS - STOPPED)
    found = {(row["quantity"], row["verdict"]): (row["units"], row["also"]) for row in causes.to_dict("records")}
    assert found == {
        ("flatness_um", "fail"): (2, ""),
        ("nonconformance", "held"): (2, ""),
        ("stroke_um", "fail"): (2, "Flatness, half of the zone fail 1"),
        ("copied recording", "no_result"): (1, ""),
        ("sensor_uF", "fail"): (1, ""),
        ("stroke_um", "no_result"): (1, ""),
    }
    assert sum(units for units, _ in found.values()) == STOPPED
    stops = {j["serial"]: j["stop"] for j in page["judgements"] if j["stop"]}
    assert (
        set(stops)
        == {*FAILED, *HELD, COPY, NOT_MEASURED}
        == {j["serial"] for j in page["judgements"] if j["first"] and not j["passed"]}
    )
    assert stops["APA-0101"] == ["Nonconformance", "held", []]
    assert stops["APA-0151"] == ["Stroke, three stacks", "fail", ["Flatness, half of the zone fail"]]
    shown = said(accept("yield"))
    assert "nonconformance held 2" in shown
    assert "copied recording no result 1" in shown
    assert len(panels(made, causes, "kind")) == 2


def test_what_stopped_the_units_of_a_month_is_of_that_month(asked):
    frame = asked.frame
    july = frame["measured"] < "2026-08-01"
    assert pareto(frame, july)["units"].sum() == 160 - yields(frame, "kind", july)["first"].sum() == 3


def test_a_golden_unit_is_in_no_count_and_is_said(asked):
    frame, page = asked.frame, asked.page
    assert yields(frame, "kind")["units"].sum() == UNITS
    assert GOLDEN not in set(trends(frame, "stroke_um", "all")[0].rows["serial"])
    of_golden = [j for j in page["judgements"] if j["serial"] == GOLDEN]
    assert (page["golden"], len(of_golden)) == (13, 13)
    assert not any(j["first"] or any(f[page["finding"].index("first")] for f in j["findings"]) for j in of_golden)
    words = "13 judgements of golden units are not counted: APA-GOLD"
    for question in (("yield",), ("trend", "stroke_um"), ("match", "--kind", "apa", "--by", "stroke_um", "--n", 2)):
        done = accept(*question)
        assert words in said(done), question
        assert f" {GOLDEN} " not in done.output


def test_a_golden_unit_is_recalled_by_nobody(tmp_path, monkeypatch):
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "empty"))
    row = {"check": "stroke", "name": "probe", "serial": "G-77", "problem": None}
    with open_store() as store:
        for serial in ("APA-1", GOLDEN):
            made = judgement(serial, {"stroke_um": 360.0}, "B1")
            made.payload["result"]["calibration"]["instruments"] = [row]
            add(store, [made])
        accept("golden", "name", GOLDEN)
    done = accept("recall", "--instrument", "G-77", "--since", "2020-01-01", "--json", tmp_path / "r")
    assert json.loads((tmp_path / "r").read_text())["units"] == ["APA-1"]
    assert "1 judgements of golden units are not counted: APA-GOLD" in said(done)


def test_the_plot_names_a_baseline_only_where_one_was_set(tmp_path, monkeypatch):
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "empty"))
    with open_store() as store:
        add(store, [judgement(f"A-{i}", {"stroke_um": 360.0 + i % 5}) for i in range(20)])
        frame = measurements(store)
    (made,) = trends(frame, "stroke_um", "all")
    labels = [item.label for item in chart_panels(made)[0].items if isinstance(item, Mark)]
    assert "mean of these units" in labels
    assert not any("baseline" in label for label in labels)
    assert not [item for item in chart_panels(made)[0].items if isinstance(item, Line) and "equal" in item.label]


def test_a_set_is_chosen_among_the_units_that_are_asked_about(tmp_path):
    by = ("match", "--kind", "apa", "--by", "stroke_um", "--n", 3, "--csv", tmp_path / "set.csv")
    these = tmp_path / "these.txt"
    these.write_text("APA-0001\nAPA-0003\n\nAPA-0005\nAPA-0007\nAPA-0101\nAPA-9999\n")
    done = accept(*by, "--units", these)
    assert done.exit_code == 0, done.output
    # 0101 is held, and 9999 is no unit
    assert "no accepted apa that is asked about by its last judgement: APA-0101, APA-9999" in said(done)
    assert set(pd.read_csv(tmp_path / "set.csv")["serial"]) <= {"APA-0001", "APA-0003", "APA-0005", "APA-0007"}
    shipped = tmp_path / "shipped"
    shipped.write_text("APA-0003\n")
    assert accept(*by, "--units", these, "--without", shipped).exit_code == 0
    assert set(pd.read_csv(tmp_path / "set.csv")["serial"]) == {"APA-0001", "APA-0005", "APA-0007"}
    assert accept(*by, "--lot", "L2").exit_code == 0  # weeks 4 to 6
    assert all(121 <= int(serial[4:]) <= 240 for serial in pd.read_csv(tmp_path / "set.csv")["serial"])
    assert accept(*by, "--since", "2026-09-28", "--until", "2026-10").exit_code == 0
    assert all(int(serial[4:]) > 480 for serial in pd.read_csv(tmp_path / "set.csv")["serial"])
    for wrong, words in (("--lot", "L99"), "asked about"), (("--units", tmp_path / "no"), "cannot be read"):
        done = accept(*by, *wrong)
        assert done.exit_code == 6
        assert words in said(done)


def test_the_log_is_asked_by_person_day_event_and_word(tmp_path):
    def asked(*words: object) -> list[dict]:
        assert accept("store", "log", *words, "--json", tmp_path / "log").exit_code == 0
        return json.loads((tmp_path / "log").read_text())["events"]

    ben = asked("--who", "ben", "--since", "2026-09-01", "--until", "2026-09-30")
    assert {event["who"] for event in ben} == {"Ben"}
    assert {event["time"][:7] for event in ben} == {"2026-09"}
    assert [event["subject"] for event in asked("--what", "golden")] == [GOLDEN]
    assert {event["subject"] for event in asked("--word", "a SCRATCH")} == {"APA-0101"}
    assert "no event of a unit 'APA-0001' that is asked for" in said(accept("store", "log", "APA-0001", "--who", "Zoe"))


def test_units_are_recalled_since_the_golden_unit_was_right(tmp_path, monkeypatch):
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "empty"))
    days = [datetime.date(2026, 8, 3), datetime.date(2026, 8, 5), datetime.date(2026, 8, 7)]
    recall = ("recall", "--instrument", "G-77", "--json", tmp_path / "r")
    with open_store() as store:
        for n, day in enumerate(days):
            made = judgement(f"APA-{n}", {"stroke_um": 360.0}, store.bench, day=day)
            made.payload["result"]["calibration"]["instruments"] = [
                {"check": "stroke", "name": "probe", "serial": "G-77", "problem": None}
            ]
            at = datetime.datetime.combine(day, datetime.time(16), datetime.UTC)
            add(store, [made], at=at)
            if n == 0:
                assert "name the day with --since" in said(accept(*recall, "--since-good"))
            if n == 1:
                bench = store.bench
                for of in (bench, "elsewhere"):
                    later = datetime.timedelta(hours=1 if of == bench else 30)
                    add(store, [NewEvent(GoldenMet.KIND, "", GoldenMet((GOLDEN,), of).to_json())], at=at + later)
    assert accept(*recall, "--since-good", "--csv", tmp_path / "r.csv").exit_code == 0
    assert json.loads((tmp_path / "r").read_text())["units"] == ["APA-1", "APA-2"]
    assert list(pd.read_csv(tmp_path / "r.csv")["unit"]) == ["APA-1", "APA-2"]
    accept(*recall, "--since", "2026-08-03", "--until", "2026-08-05")
    assert json.loads((tmp_path / "r").read_text())["units"] == ["APA-0", "APA-1"]
    # what no instrument of the bench file measured was judged here as well, and what another bench judged was not
    with open_store() as store:
        for bench_of, serial in ((bench, "TYPED-1"), ("", "TYPED-2"), ("elsewhere", "TYPED-3")):
            made = judgement(serial, {"stroke_um": 360.0}, day=days[2])
            made.payload["bench"] = bench_of
            add(store, [made], at=datetime.datetime.combine(days[2], datetime.time(17), datetime.UTC))
    here = ("recall", "--json", tmp_path / "r")
    assert accept(*here, "--since-good", "--csv", tmp_path / "r.csv").exit_code == 0
    told = json.loads((tmp_path / "r").read_text())
    assert (told["instrument"], told["units"]) == ("", ["APA-1", "APA-2", "TYPED-1", "TYPED-2"])
    assert set(pd.read_csv(tmp_path / "r.csv")["what"]) == {"judged: accepted"}
    assert "APA-0, APA-1" in said(accept(*here, "--since", "2026-08-03", "--until", "2026-08-05"))
    for wrong in ((), ("--since", "2026-08-03", "--since-good")):
        assert "either --since YYYY-MM-DD or --since-good" in said(accept(*recall, *wrong))


def test_the_page_of_a_month_has_what_happened_in_it_and_nothing_else(asked):
    """Alarms, golden units, decisions and recalls beside the judgements of these days."""
    september = datetime.date(2026, 9, 1), datetime.date(2026, 9, 30)
    checked = InstrumentChecked(
        "lcr", "LCR-2", "2026-09-07T08:00:00+00:00", "capacitance standard", "C-7", "uF", 10.0, 0.02, 10.2, 0.05,
        (10.2,), 3.7, False, {},
    )  # fmt: skip
    decided = NonconformanceDecided(("stroke: scratch",), Disposition("use-as-is", "harmless"))
    with open_store() as store:
        first = store.write(checked, who="Ann")
        store.write(decided, min(HELD), who="Grace")
        store.write(GoldenMissed((GOLDEN,), {GOLDEN: ("stroke_um: 366.8",)}, store.bench), who="Ann")
        month = document(store, {}, since=september[0], until=september[1])
        today = datetime.date.fromisoformat(first.time[:10])
        now = document(store, {}, since=datetime.date(2026, 7, 1), until=today)
    days = {judged["at"][:7] for judged in month["judgements"]}
    assert days == {"2026-09"}
    assert len(month["judgements"]) == sum(judged["at"][:7] == "2026-09" for judged in asked.page["judgements"])
    alarms = [row for row in month["happenings"] if row["kind"] == "alarm"]
    assert alarms
    assert {row["day"][:7] for row in month["happenings"]} == {"2026-09"}
    assert {row["words"] for row in alarms} == {
        alarm["words"] for groups in month["trends"].values() for alarm in groups["all"][0]["alarms"]
    }
    others = {row["kind"]: row for row in now["happenings"] if row["kind"] != "alarm" and row["day"] == str(today)}
    assert others["recall"]["unit"] == "LCR-2"
    assert "it was never right before" in others["recall"]["words"]
    assert others["decision"]["words"].startswith("concession by nobody, without a signature: use as it is: harmless")
    assert others["golden unit"]["words"] == "the bench was stopped: stroke_um: 366.8"


def test_the_command_takes_a_month(tmp_path):
    assert "judgements: open" in said(
        accept("site", "--out", tmp_path / "page", "--since", "2026-09", "--until", "2026-09")
    )
    assert accept("site", "--out", tmp_path / "page", "--since", "September").exit_code == 6
    assert accept("site", "--out", tmp_path / "page", "--since", "2031-01").exit_code == 6
