"""Golden units stop a bench that has changed; a gauge study says what the measurement adds."""

import dataclasses
import datetime
import json
import shutil

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from accept.base.home import home
from accept.batch import services
from accept.certificate.trust import keys
from accept.fleet import gauge, golden
from accept.fleet.golden import BenchStopped
from accept.fleet.golden import check as check_goldens
from accept.fleet.golden_chart import golden_trends
from accept.fleet.measurements import measurements
from accept.fleet.trend import trends
from accept.fleet.yields import yields
from accept.pictures.draw import figure_of
from accept.pictures.items import settings
from accept.store import open_store
from accept.store.decisions import DecisionError, Signer
from accept.store.payloads import BenchStated, GoldenResolved
from accept.store.seal import Sealer
from checks.picture import Line, Text
from tests.accept.fleet.judgements import add, judgement
from tests.accept.fleet.process_control.test_gauge_bias import BIAS, LINEARITY
from tests.accept.fleet.process_control.test_gauge_study import AIAG
from tests.accept.units.units import make_unit
from tests.shared.command_line import accept

GOOD = {"sensor_uF": 5.0, "stroke_um": 360.0}
BEFORE = datetime.datetime(2026, 1, 5, 8, tzinfo=datetime.UTC)


@pytest.fixture
def store(monkeypatch):
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    with open_store() as opened:
        add(opened, [judgement("GOLD", GOOD), judgement("BAD", GOOD | {"stroke_um": 100.0})], at=BEFORE)
        golden.name_golden(opened, "GOLD", "accepted", "Ann")
        golden.name_golden(opened, "BAD", "rejected", "Ann", signer=signer())
        yield opened


def today(store, **changed):
    add(store, [judgement("GOLD", GOOD | changed), judgement("BAD", GOOD | {"stroke_um": 100.1})])
    return accept("golden", "check")


def test_a_bench_as_before_goes_on(store):
    assert today(store, sensor_uF=5.01).exit_code == 0
    golden.check_may_judge(store, "A-01")


@pytest.mark.parametrize("changed", [{"sensor_uF": 5.1}, {"stroke_um": None}, {"stroke_um": 200.0}])
@pytest.mark.slow
def test_a_bench_that_has_changed_judges_nothing_until_it_is_resolved(store, changed, tmp_path):
    done = today(store, **changed)
    assert done.exit_code == 3
    assert next(iter(changed)) in done.output
    with pytest.raises(BenchStopped, match="A-01: not judged"):
        golden.check_may_judge(store, "A-01")
    golden.check_may_judge(store, "GOLD")  # how else could it be shown to be right again
    make_unit(tmp_path / "u", "U-1")
    refused = accept("batch", tmp_path / "u", "--out", tmp_path / "out", "--no-certificates")
    assert refused.exit_code == 6, refused.output
    assert "golden resolve" in refused.output
    assert accept("report", tmp_path / "u", "--out", tmp_path / "u.pdf").exit_code == 6
    assert not (tmp_path / "u.pdf").exists()
    assert accept("golden", "resolve", "--reason", " ").exit_code == 6
    assert accept("golden", "resolve", "--reason", "the probe was loose").exit_code == 0
    golden.check_may_judge(store, "A-01")


def test_a_batch_that_is_under_way_stores_no_verdict_either(store, tmp_path, monkeypatch):
    today(store, sensor_uF=5.1)
    make_unit(tmp_path / "u", "U-1")
    monkeypatch.setattr(services, "missed", lambda _: None)  # when the batch began
    done = accept("batch", tmp_path / "u", "--out", tmp_path / "out", "--no-certificates")
    assert done.exit_code == 6, done.output
    assert "U-1: not judged" in done.output
    assert store.latest("U-1", "unit_judged") is None


def test_a_known_bad_unit_that_passes_stops_the_bench_too(store):
    add(store, [judgement("GOLD", GOOD), judgement("BAD", GOOD)])
    assert accept("golden", "check").exit_code == 3
    assert golden.missed(store)


def test_a_golden_unit_that_was_not_judged_is_neither(store):
    add(store, [judgement("GOLD", GOOD)])
    assert accept("golden", "check").exit_code == 4
    golden.check_may_judge(store, "A-01")


def test_only_what_was_judged_so_can_be_golden(store):
    for serial, expected, words in (("NEW", "accepted", "never judged"), ("BAD", "accepted", "rejected, not")):
        with pytest.raises(golden.GoldenError, match=words):
            golden.name_golden(store, serial, expected, "Ann")


def read_as(store, stroke_um):
    """A golden unit judged by this bench, and what the check says of it."""
    payload = judgement("GOLD", GOOD | {"stroke_um": stroke_um})
    add(store, [dataclasses.replace(payload, payload=payload.payload | {"bench": store.bench})])
    return accept("golden", "check", "--hours", "1").exit_code


def signer():
    credential = keys.unlock(home(), "qa", "battery staple")
    return Signer(credential.key, credential.certificate)


@pytest.fixture
def alone(store):
    """One golden unit, of 360 um."""
    golden.retire(store, "BAD", "it broke", signer)
    return store


def test_a_missed_golden_unit_never_teaches_its_error(alone):
    """A bench that is 20 um off, tried again and again, and right in between: stopped until QA signs."""
    for stroke in (340.0, 340.3, 360.0, 340.6, 340.45):
        assert read_as(alone, stroke) == 3
        with pytest.raises(BenchStopped):
            golden.check_may_judge(alone, "A-01")
    golden.resolve(alone, "the probe was loose", signer)
    golden.check_may_judge(alone, "A-01")
    assert read_as(alone, 360.1) == 0  # the right value, and nothing of before
    assert read_as(alone, 340.0) == 3


def test_a_unit_that_is_made_golden_after_the_stop_is_not_judged(alone):
    """Else a rejected unit is named a golden one, and judged on a bench that measures wrongly."""
    add(alone, [judgement("X-01", GOOD | {"stroke_um": 265.5})])
    assert read_as(alone, 340.0) == 3
    golden.name_golden(alone, "X-01", "rejected", "Ann", signer=signer())
    assert read_as(alone, 340.0) == 3  # the stop is stated once more
    with pytest.raises(BenchStopped):
        golden.check_may_judge(alone, "X-01")
    golden.name_golden(alone, "GOLD", "accepted", "Ann", "again", signer=signer())
    golden.check_may_judge(alone, "GOLD")


def test_each_bench_of_a_store_is_stopped_for_itself(alone, tmp_path, monkeypatch):
    """Two homes on one store, in both orders."""
    url = f"sqlite:///{home() / 'store.sqlite'}"
    first = home()
    second = tmp_path / "second"
    shutil.copytree(first / "keys", second / "keys")
    (second / "bench.key").write_text("11" * 32 + "\n")
    monkeypatch.setenv("ACCEPT_STORE_URL", url)
    assert read_as(alone, 340.0) == 3
    monkeypatch.setenv("ACCEPT_HOME", str(second))
    (second / "store.sqlite").symlink_to(first / "store.sqlite")
    with open_store(url) as shared:
        other = type(shared)(shared.engine, "", None, Sealer(second / "x.seal", second / "bench.key"))
        golden.check_may_judge(other, "A-01")  # the other bench goes on
        payload = judgement("GOLD", GOOD)
        add(alone, [dataclasses.replace(payload, payload=payload.payload | {"bench": other.bench})])
        since = datetime.datetime.now(datetime.UTC) - datetime.timedelta(hours=1)
        assert check_goldens(other, since, "Ann")[0].problems == ()
        with pytest.raises(BenchStopped):
            golden.check_may_judge(alone, "A-01")  # which lifts nothing here
        golden.resolve(alone, "the probe was loose", signer)
        golden.check_may_judge(alone, "A-01")


@pytest.mark.parametrize("seed", range(4))
def test_a_bench_that_drifted_is_stopped_at_every_check_in_any_order_of_tries(alone, tmp_path, seed):
    """Bench 1 reads 20 um too little, at some tries it is right; bench 2 is right. They judge the golden unit and check
    in any order: from the first wrong reading that was checked on, bench 1 is stopped at every check, bench 2 never."""
    (tmp_path / "second.key").write_text("22" * 32 + "\n")
    other = type(alone)(alone.engine, "", None, Sealer(tmp_path / "x.seal", tmp_path / "second.key"))
    rng = np.random.default_rng(seed)
    for _ in range(2):  # once more after quality assurance signed
        wrong = stopped = False
        for choice in [*rng.integers(0, 5, 12), 1, 3]:
            bench = other if choice in (0, 4) else alone
            if choice < 3:
                stroke = 340.0 + rng.normal(0.0, 0.2) if choice == 1 else 360.0 + rng.normal(0.0, 0.1)
                event = judgement("GOLD", GOOD | {"stroke_um": stroke})
                add(alone, [dataclasses.replace(event, payload=event.payload | {"bench": bench.bench})])
                wrong |= choice == 1
                continue
            since = datetime.datetime.now(datetime.UTC) - datetime.timedelta(hours=1)
            (found,) = check_goldens(bench, since, "Ann")
            stopped |= bench is alone and wrong
            assert bool(found.problems) == (bench is alone and wrong)
            assert (golden.missed(alone) is not None) == stopped
            assert golden.missed(other) is None
        assert stopped
        golden.resolve(alone, "the probe was loose", signer)
        golden.check_may_judge(alone, "A-01")


def test_only_a_signature_of_quality_assurance_lifts_a_stop(alone, monkeypatch):
    assert read_as(alone, 340.0) == 3
    stop = golden.stopped_by(alone)
    alone.write(GoldenResolved("typed", alone.bench, stop.seq), who="Grace")  # nobody signed
    technician = keys.unlock(home(), "technician", "correct horse")
    with pytest.raises(DecisionError, match="not of quality assurance"):
        golden.resolve(alone, "typed", lambda: Signer(technician.key, technician.certificate))
    for key, value in (("ACCEPT_QA_PASSPHRASE", "wrong horse"),):
        monkeypatch.setenv(key, value)
        assert accept("golden", "resolve", "--reason", "x").exit_code == 6
    golden.resolve(alone, "the probe was loose", signer)
    *_, lifted = alone.events(what=GoldenResolved.KIND)
    assert read_as(alone, 340.0) == 3
    alone.append(GoldenResolved.KIND, "", lifted.data, who="Grace")  # the signature of before, once more
    with pytest.raises(BenchStopped):
        golden.check_may_judge(alone, "A-01")


def test_a_reference_is_changed_with_a_reason_only(alone):
    with pytest.raises(golden.GoldenError, match="--reason"):
        golden.name_golden(alone, "GOLD", "accepted", "Ann")
    add(alone, [judgement("GOLD", GOOD | {"stroke_um": 361.0})])
    golden.name_golden(alone, "GOLD", "accepted", "Ann", "lapped anew", last=2, signer=signer())
    reference = golden.goldens(alone)["GOLD"].reference["stroke_um"]
    assert (reference.value, reference.U, reference.n) == (360.5, 0.5, 2)
    listed = accept("golden", "list")
    assert listed.exit_code == 0, listed.output
    assert "360.5" in listed.output
    assert accept("golden", "retire", "GOLD", "--reason", "worn").exit_code == 0
    assert golden.goldens(alone) == {}


def test_a_golden_unit_of_an_earlier_program_has_its_values_of_then():
    """Its events without signatures count, until this program has stored one."""
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    with open_store() as early:
        add(early, [judgement("GOLD", GOOD), judgement("OLD", GOOD)], at=BEFORE)
        for serial in ("OLD", "GOLD", "GOLD"):
            early.append("golden_named", serial, {"expect": "accepted"}, who="Ann")
        early.append("golden_retired", "OLD", {"reason": "worn"}, who="Ann")
        assert list(golden.goldens(early)) == ["GOLD"]
        assert golden.goldens(early)["GOLD"].reference["stroke_um"].value == 360.0
        assert read_as(early, 340.0) == 3
        assert golden.goldens(early)["GOLD"].reference["stroke_um"].value == 360.0
        early.append("golden_named", "GOLD", {"expect": "accepted"}, who="Ann")  # this program had checked
        early.append("golden_retired", "GOLD", {"reason": "x"}, who="Ann")
        assert golden.goldens(early)["GOLD"].reference["stroke_um"].value == 360.0


def test_unsigned_changes_of_an_earlier_program_end_where_this_one_began():
    """Else an earlier program beside this one retires a golden unit, or gives it the values of a bench that drifted."""
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")
    with open_store() as early:
        add(early, [judgement("GOLD", GOOD)], at=BEFORE)
        early.append("golden_named", "GOLD", {"expect": "accepted"}, who="Ann")
        early.append("golden_named", "GOLD", {"expect": "accepted"}, who="Ann")
        early.write(BenchStated(early.bench, None, True, None), who="Ann")  # with its first certificate
        add(early, [judgement("GOLD", GOOD | {"stroke_um": 340.0})])
        early.append("golden_named", "GOLD", {"expect": "accepted"}, who="Ann")
        assert golden.goldens(early)["GOLD"].reference["stroke_um"].value == 360.0
        early.append("golden_retired", "GOLD", {"reason": "worn"}, who="Ann")
        assert list(golden.goldens(early)) == ["GOLD"]


def test_a_stop_that_an_earlier_program_lifted_without_a_signature_stands(alone):
    assert read_as(alone, 340.0) == 3
    with pytest.raises(BenchStopped) as before:
        golden.check_may_judge(alone, "A-01")
    alone.append("golden_resolved", "", {"reason": "the probe was loose"}, who="Grace")
    with pytest.raises(BenchStopped) as since:
        golden.check_may_judge(alone, "A-01")
    assert "without a signature" in str(since.value)
    assert "without a signature" not in str(before.value)


def test_a_reference_is_changed_by_a_signature_of_quality_assurance_only(alone, monkeypatch):
    """Else a bench that has drifted gets its drifted values as a reference."""
    monkeypatch.delenv("ACCEPT_QA_PASSPHRASE")
    add(alone, [judgement("GOLD", GOOD | {"stroke_um": 340.0}), judgement("X-01", GOOD)])
    assert accept("golden", "name", "GOLD", "--reason", "x").exit_code == 6
    assert accept("golden", "name", "X-01").exit_code == 6
    assert accept("golden", "retire", "GOLD", "--reason", "x").exit_code == 6
    with pytest.raises(golden.GoldenError, match="quality assurance signs"):
        golden.name_golden(alone, "GOLD", "accepted", "Ann", "x")
    technician = keys.unlock(home(), "technician", "correct horse")
    with pytest.raises(DecisionError, match="not of quality assurance"):
        golden.retire(alone, "GOLD", "x", lambda: Signer(technician.key, technician.certificate))

    def present():
        return {serial: each.reference["stroke_um"].value for serial, each in golden.goldens(alone).items()}

    golden.name_golden(alone, "GOLD", "accepted", "Ann", "lapped anew", signer=signer())
    assert present() == {"GOLD": 340.0}
    *_, drifted = alone.events("GOLD", "golden_named")
    add(alone, [judgement("GOLD", GOOD)])
    golden.name_golden(alone, "GOLD", "accepted", "Ann", "lapped again", signer=signer())
    assert present() == {"GOLD": 360.0}
    alone.append("golden_named", "GOLD", drifted.data, who="Grace")  # the signature of before, once more
    alone.append("golden_named", "X-01", drifted.data, who="Grace")  # and for another unit
    alone.append("golden_retired", "GOLD", {"reason": "x"}, who="Grace")
    assert present() == {"GOLD": 360.0}


def test_a_golden_unit_that_was_retired_and_is_named_again_begins_a_new_chart(alone):
    """Its judgements of before belong to another reference: 340 um, then lapped to 360 um."""

    def read() -> int:
        (charted,) = golden_trends(alone, quantity="stroke_um")
        return len(charted.rows)

    for stroke in (360.0, 360.2, 359.9, 360.1):
        add(alone, [judgement("GOLD", GOOD | {"stroke_um": stroke})])
    before = read()
    assert before >= 5
    golden.retire(alone, "GOLD", "it is lapped", signer)
    for stroke in (340.0, 340.2):
        add(alone, [judgement("GOLD", GOOD | {"stroke_um": stroke})])
    golden.name_golden(alone, "GOLD", "accepted", "Ann", last=2, signer=signer())
    assert read() == 2  # those of its reference
    add(alone, [judgement("GOLD", GOOD | {"stroke_um": 340.1})])
    assert read() == 3


def test_the_published_study_from_a_table(tmp_path):
    lines = ["part,operator,value"]
    lines += [f"P{p},O{o},{v}" for p in range(10) for o in range(3) for v in AIAG[p, o]]
    (tmp_path / "study.csv").write_text("\n".join(lines))
    done = accept("rr", tmp_path / "study.csv", "--tolerance", "8", "--json", tmp_path / "rr.json")
    assert done.exit_code == 4, done.output  # 27.9 % of the study and four categories: conditional
    told = json.loads((tmp_path / "rr.json").read_text())
    assert told["percent_of_study"] == pytest.approx(27.86, abs=0.005)
    assert told["percent_of_tolerance"] == pytest.approx(100 * 6 * 0.302373 / 8, rel=1e-5)
    assert (told["verdict"], told["distinct_categories"]) == ("conditional", 4)
    assert told["U"] == pytest.approx(0.6047, abs=1e-4)
    done = accept("rr", tmp_path / "study.csv", "--tolerance", "1")
    assert done.exit_code == 3
    last = "the measurement is not usable: gauge R&R is 181.4 % of the tolerance, at most 30 % is usable"
    assert last in done.output.splitlines()  # not 27.9 % of the study, which is conditional


def test_a_table_as_a_german_spreadsheet_writes_it(tmp_path):
    lines = ["Part;Operator;Value"]
    lines += [f"P{p} ;O{o};{v}".replace(".", ",") for p in range(10) for o in range(3) for v in AIAG[p, o]]
    (tmp_path / "study.csv").write_text("\n".join(lines))
    assert accept("rr", tmp_path / "study.csv", "--json", tmp_path / "rr.json").exit_code == 4
    told = json.loads((tmp_path / "rr.json").read_text())
    assert told["percent_of_study"] == pytest.approx(27.86, abs=0.005)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("part,value\n1,2\n", "operator"),
        ("part,operator,value\na,b,x\n", "line 2: column 'value' holds 'x'"),
        ("part,operator,value\na,b,1\na,b,2\nc,b,1\nc,b,2\n", "1 operator"),
        ("part,operator,value\na,x,1\na,x,2\na,y,1\nb,x,1\nb,x,2\nb,y,1\nb,y,2\n", "equally often"),
        ("part,operator,value\na,x,1\na,x,1\na,y,1\na,y,1\nb,x,1\nb,x,1\nb,y,1\nb,y,1\n", "all 8 readings are 1"),
        ("", "is empty"),
    ],
)
def test_tables_that_are_no_study(tmp_path, text, words):
    (tmp_path / "s.csv").write_text(text)
    done = accept("rr", tmp_path / "s.csv")
    assert done.exit_code == 6
    assert words in done.output


def test_the_six_pictures_of_a_study(tmp_path):
    lines = ["part,operator,value"]
    lines += [f"P{p},O{o},{v}" for p in range(10) for o in range(3) for v in AIAG[p, o]]
    (tmp_path / "s.csv").write_text("\n".join(lines))
    assert accept("rr", tmp_path / "s.csv", "--plot", tmp_path / "s.svg").exit_code == 4
    assert (tmp_path / "s.svg").read_text().startswith("<?xml")
    frame = gauge.read_table(tmp_path / "s.csv")
    pictures = gauge.panels(frame, gauge.study(frame))
    assert len(pictures) == 6
    assert pictures[1].items[1].at == pytest.approx(0.8787, abs=0.002)  # [AIAG-MSA]: upper limit of the ranges 0.88
    assert [item.label for item in pictures[5].items] == ["O0", "O1", "O2"]
    names = {item.words: item.y for item in pictures[4].items if isinstance(item, Text)}
    points, means = (item for item in pictures[4].items if isinstance(item, Line))
    for k, name in enumerate(("O0", "O1", "O2")):  # the name stands in the row of the operator's values
        row = round(names[name] - 0.2)
        assert means.x[list(means.y).index(row)] == pytest.approx(AIAG[:, k].mean())
        assert sorted(points.x[points.y == row]) == sorted(AIAG[:, k].ravel())
    assert pictures[4].y_names == ("",) * 3  # and no number beside it
    with mpl.rc_context(settings()):
        figure = figure_of(pictures, columns=2)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    whole = figure.bbox.padded(1.0)  # a pixel
    for axes in figure.axes:
        drawn = (*axes.texts, axes.xaxis, axes.yaxis)
        for box in filter(None, (each.get_tightbbox(canvas.get_renderer()) for each in drawn)):
            assert whole.contains(*box.min), axes.get_title()
            assert whole.contains(*box.max), axes.get_title()


def test_bias_and_linearity_by_command(tmp_path):
    """The published examples of [AIAG-MSA], one written with semicolons and commas."""
    (tmp_path / "b.csv").write_text("value\n" + "\n".join(map(str, BIAS)))
    done = accept(
        "gauge", "bias", tmp_path / "b.csv", "--reference", 6, "--json", tmp_path / "b", "--plot", tmp_path / "b.svg"
    )
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "b").read_text())
    assert (found["bias"]["t"], found["bias"]["significant"]) == (pytest.approx(0.1218, abs=1e-4), False)
    assert accept("gauge", "bias", tmp_path / "b.csv", "--reference", 5, "--tolerance", 8).exit_code == 3
    assert accept("gauge", "bias", tmp_path / "b.csv", "--reference", 5).exit_code == 4
    rows = [f"{at:g};{v}".replace(".", ",") for at, values in LINEARITY.items() for v in values]
    (tmp_path / "l.csv").write_text("\n".join(["Reference;Value", *rows]))
    done = accept("gauge", "linearity", tmp_path / "l.csv", "--json", tmp_path / "l", "--plot", tmp_path / "l.svg")
    assert done.exit_code == 4, done.output
    assert json.loads((tmp_path / "l").read_text())["slope"]["value"] == pytest.approx(-0.131667, abs=5e-7)
    (tmp_path / "bad.csv").write_text("reference,value\n1,2\nx,3")
    done = accept("gauge", "linearity", tmp_path / "bad.csv")
    assert (done.exit_code, "line 3" in done.output) == (6, True)


def test_a_study_beside_production_has_a_tag(tmp_path):
    """Judgements with [origin] study are the study, and count in no yield or chart."""
    with open_store() as opened:
        for i in range(12):
            add(opened, [judgement(f"P-{i}", GOOD | {"stroke_um": 350.0 + i})])
        for p in range(4):
            for who in ("Ann", "Bo"):
                for r in range(2):
                    event = judgement(f"P-{p}", GOOD | {"stroke_um": 400.0 + 10.0 * p + 0.1 * r})
                    result = {**event.payload["result"], "origin": {"study": "rr-1"}}
                    add(opened, [dataclasses.replace(event, payload={**event.payload, "result": result})], who=who)
        frame = measurements(opened)
    done = accept("rr", "--quantity", "stroke_um", "--study", "rr-1", "--json", tmp_path / "r")
    assert done.exit_code in (0, 4), done.output
    assert json.loads((tmp_path / "r").read_text())["readings"] == 16
    assert accept("rr", "--quantity", "stroke_um", "--study", "rr-2").exit_code == 6
    (trend,) = trends(frame, "stroke_um", "all")
    assert (len(trend.rows), trend.rows["value"].max()) == (12, 361.0)
    assert yields(frame, "kind").set_index("kind").at["apa", "units"] == 12


def test_a_study_from_the_store_finds_the_repeatability_that_was_put_in(tmp_path):
    rng = np.random.default_rng(4)
    parts = 360.0 + 5.0 * rng.standard_normal(12)
    with open_store() as store:
        for who in ("Ann", "Bob", "Cy"):
            for _ in range(3):
                values = parts + 0.2 * rng.standard_normal(12)
                add(store, [judgement(f"S-{i}", {"stroke_um": v}) for i, v in enumerate(values)], who=who)
    done = accept("rr", "--quantity", "stroke_um", "--json", tmp_path / "rr.json")
    assert done.exit_code == 0, done.output
    told = json.loads((tmp_path / "rr.json").read_text())
    (row,) = [part for part in told["components"] if part["source"] == "repeatability"]
    assert row["sigma"] == pytest.approx(0.2, rel=0.25)  # 72 or more degrees of freedom: sd 8 %, three of them
