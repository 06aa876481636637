"""Batches of more units than results.json lists: nothing is lost, every file says the same, memory stays flat."""

import csv
import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pandas as pd
import pytest

from accept.batch import judge_batch, results
from accept.batch.judge_batch import BatchReport, BatchRequest, Roster, run
from accept.judging import load_spec
from accept.store import Event, NewEvent, open_store
from accept.units import unit_folder
from tests.accept.units.units import GOOD, make_unit

SERIALS = [f"T-{n}" for n in range(7)]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three units count as many, two are a part."""
    monkeypatch.setattr(judge_batch, "WHOLE", 3)
    monkeypatch.setattr(results, "WHOLE", 3)
    monkeypatch.setattr(results, "AT_ONCE", 2)
    monkeypatch.setattr(judge_batch, "HELD", 3)


@pytest.fixture
def units(tmp_path: Path) -> Path:
    for serial in SERIALS:
        make_unit(tmp_path / "units" / serial, serial, GOOD.replace("5.10", "1.72") if serial == "T-5" else GOOD)
    return tmp_path / "units"


def judged(units: Path, out: Path) -> BatchReport:
    order = BatchRequest([units], out, {"apa": load_spec("apa-basic")}, "Ada", workers=1)
    with open_store() as store:
        return run(order, store, lambda _: None)


def test_every_file_says_what_the_whole_one_would(
    units: Path, tmp_path: Path, few: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    many = judged(units, tmp_path / "many")
    assert (many.units, many.verdicts) == ([], {"accepted": 6, "rejected": 1})
    document = json.loads((tmp_path / "many" / "results.json").read_text())
    assert "units" not in document  # not an empty list, which would pass for nothing judged
    assert document["verdicts"] == {"accepted": 6, "rejected": 1}
    findings = pd.read_parquet(tmp_path / "many" / document["datasets"]["findings"])
    entries = pd.read_parquet(tmp_path / "many" / document["datasets"]["units"])
    monkeypatch.setattr(judge_batch, "WHOLE", 100)
    monkeypatch.setattr(results, "WHOLE", 100)
    whole = judged(units, tmp_path / "whole")
    assert whole.unchanged == len(SERIALS)
    assert [json.loads(text) for text in entries["entry"]] == [unit.to_json() for unit in whole.units]
    for frame in (findings, entries):
        assert set(frame["attempt"]) == {1}
        assert set(frame["operator"]) == {"Ada"}
        assert str(frame["time"].dtype) == "datetime64[us, UTC]"
    rows = [(u.serial, f.quantity, f.value, f.verdict) for u in whole.units for f in u.findings]
    assert list(zip(*(findings[n] for n in ("serial", "quantity", "value", "verdict")), strict=True)) == rows
    for name in ("results.csv", "junit.xml"):
        assert (tmp_path / "many" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    with (tmp_path / "many" / "results.csv").open() as file:
        assert [row["serial"] for row in csv.DictReader(file)] == [row[0] for row in rows]
    suites = ET.parse(tmp_path / "many" / "junit.xml").getroot()
    assert [suite.get("name") for suite in suites] == SERIALS


def test_data_sets_of_an_earlier_batch_do_not_stay(units: Path, tmp_path: Path, few: None) -> None:
    judged(units, tmp_path / "out")
    assert (tmp_path / "out" / results.FINDINGS).is_dir()
    judged(units / "T-5", tmp_path / "out")
    assert not list((tmp_path / "out").glob("*.parquet"))
    assert [u["serial"] for u in json.loads((tmp_path / "out" / "results.json").read_text())["units"]] == ["T-5"]


def test_clashing_serials_are_refused_however_many_there_are(units: Path, tmp_path: Path, few: None) -> None:
    make_unit(units / "again", "t-4", GOOD)
    report = judged(units, tmp_path / "out")
    assert {Path(row["path"]).name for row in report.refused} == {"T-4", "again"}
    assert report.judged == len(SERIALS) - 1
    with Roster() as one:
        for path in (units / "T-1", units / "T-1", units / ".." / "units" / "T-1"):
            one.add(unit_folder.read(path))
        assert not list(one.clashes())
        assert one.count() == 1


def test_a_full_store_is_not_read_for_one_unit(units: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One unit more costs what it costs on an empty store: its own events are read, not those of the others."""
    judged(units / "T-1", tmp_path / "first")  # what is loaded once is loaded
    with open_store() as store:
        like = list(store.events(what="unit_judged"))[-1]
        others = [NewEvent(like.what, f"F-{n}", like.data, like.spec) for n in range(1000)]
        store.append_many(others, who="Ada")
    read = events_read(monkeypatch)
    judged(units / "T-2", tmp_path / "second")
    assert 0 < len(read) < 50  # some are read again at each append: the end of the chain


def test_a_unit_that_was_judged_often_is_read_once(
    units: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A golden unit has an attempt for every shift: what came before is counted as it is read, and not read again for
    the results. The number of the attempt is right for a new judgement and for one that stays."""
    judged(units / "T-1", tmp_path / "first")
    with open_store() as store:
        like = store.latest("T-1", "unit_judged")
        assert like is not None
        worn = NewEvent(like.what, "T-1", like.data | {"spec_sha256": "0" * 64}, like.spec)
        store.append_many([worn] * 300, who="Ada")
    read = events_read(monkeypatch)
    for n in range(2):
        judged(units / "T-1", tmp_path / str(n))
        assert set(pd.read_csv(tmp_path / str(n) / "results.csv")["attempt"]) == {302}
    assert 600 < len(read) < 700


def events_read(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of the events whose hash is taken, as they are read."""
    read: list[int] = []
    whole = Event.intact.fget
    assert whole is not None

    def counted(event: Event) -> bool:
        read.append(event.seq)
        return bool(whole(event))

    monkeypatch.setattr(Event, "intact", property(counted))
    return read
