"""The file of findings answers as the events do; a file that is old, damaged or forged is made anew."""

import datetime
import json
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from accept.base.home import home
from accept.fleet import findings_file
from accept.fleet.findings_file import FindingsTable, keep_findings
from accept.fleet.measurements import COLUMNS, attempts, is_between, measurements
from accept.fleet.yields import yields
from accept.store import Store, StoreError, open_store
from accept.store.payloads import UnitJudged
from accept.store.seal import Sealer
from tests.accept.fleet.judgements import add, judgement

VALUES = {"sensor_uF": 5.0, "stroke_um": 360.0}


def stored(store: Store) -> Path:
    """Return the file of the store's findings, brought up to its end."""
    keep_findings(store)
    (file,) = home().glob("findings-*.columns")
    return file


def by_events(store: Store) -> list[tuple[object, ...]]:
    """Return serial, attempt, quantity, value, verdict and lot of every finding, straight from the events."""
    tries: dict[str, int] = {}
    rows = []
    for event in store.events(what=UnitJudged.KIND):
        tries[event.subject] = tries.get(event.subject, 0) + 1
        result = json.loads(event.payload)["result"]
        lot = result.get("origin", {}).get("lot", "not stated")
        rows += [
            (event.subject, tries[event.subject], f["quantity"], f["value"], f["verdict"], lot)
            for f in result["findings"]
        ]
    return rows


def answered(store: Store) -> list[tuple[object, ...]]:
    frame = measurements(store, columns=("serial", "attempt", "quantity", "value", "verdict", "lot"))
    return [tuple(row) for row in frame.astype(object).where(frame.notna(), None).itertuples(index=False)]


@pytest.fixture
def store(monkeypatch: pytest.MonkeyPatch):
    """Z-2 twice, A-1 and one without a value, all in the file; serials are not in the order of the alphabet."""
    monkeypatch.setattr(findings_file, "FEW", 0)
    with open_store() as opened:
        add(opened, [judgement("Z-2", VALUES), judgement("A-1", VALUES | {"stroke_um": 180.0})])
        add(opened, [judgement("Z-2", VALUES | {"sensor_uF": 5.1}), judgement("B-1", VALUES | {"sensor_uF": None})])
        keep_findings(opened)
        yield opened


def unread(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the serials of the judgements that are read from events from now on."""
    read: list[str] = []
    plain = FindingsTable.add
    monkeypatch.setattr(
        FindingsTable, "add", lambda self, events: plain(self, (read.append(e.subject) or e for e in events))
    )
    return read


def test_it_answers_as_the_events_do(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    read = unread(monkeypatch)
    assert answered(store) == by_events(store)
    assert read == []
    whole = measurements(store)
    (home() / stored(store).name).unlink()
    pd.testing.assert_frame_equal(measurements(store), whole)
    assert list(whole.columns) == COLUMNS


def test_what_is_judged_later_is_added(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    read = unread(monkeypatch)
    add(store, [judgement("A-1", VALUES), judgement("0-1", VALUES)])
    assert answered(store) == by_events(store)
    assert read == ["A-1", "0-1"]
    assert answered(store) == by_events(store)  # from the file that was written
    assert read == ["A-1", "0-1"]


def test_few_judgements_are_not_written(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    before = stored(store).read_bytes()
    monkeypatch.setattr(findings_file, "FEW", 1)
    add(store, [judgement("A-1", VALUES)])
    assert answered(store) == by_events(store)
    assert stored(store).read_bytes() == before


def other_value(file: Path) -> None:
    """Change the last byte of a number among the columns."""
    content = bytearray(file.read_bytes())
    header = content.index(b"\n") + 1
    value = json.loads(json.loads(content[:header])["sealed"])["columns"]["value"]
    content[header + value["at"] + 7] ^= 1
    file.write_bytes(content)


def other_key(file: Path) -> None:
    """Sign the header again with a key that is not the bench's."""
    content = file.read_bytes()
    line, rest = content.split(b"\n", 1)
    forger = Sealer(file, file.with_name("other.key"))
    file.write_bytes(forger.signed(json.loads(line)["sealed"]) + b"\n" + rest)


def other_head(file: Path) -> None:
    """State another end of the store under the bench's old signature."""
    content = file.read_bytes()
    line, rest = content.split(b"\n", 1)
    outer = json.loads(line)
    inner = json.loads(outer["sealed"])
    inner["head"] = f"1 {inner['head'].split()[1]}"
    file.write_bytes(json.dumps(outer | {"sealed": json.dumps(inner)}).encode() + b"\n" + rest)


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-20])


@pytest.mark.parametrize("forge", [other_value, other_key, other_head, cut])
def test_a_forged_file_is_not_used(store: Store, forge: Callable[[Path], None]) -> None:
    forge(stored(store))
    assert answered(store) == by_events(store)
    read = pd.DataFrame(answered(store))
    assert len(read) == len(by_events(store))


def test_a_file_of_another_store_is_not_used(store: Store, tmp_path: Path) -> None:
    """As after a backup was restored in its place."""
    file = stored(store)
    other = f"sqlite:///{tmp_path / 'other.sqlite'}"
    with open_store(other) as second:
        add(second, [judgement("X-1", VALUES), judgement("X-2", VALUES)])
        of_other = {*home().glob("findings-*")}
        keep_findings(second)
        ({*home().glob("findings-*")} - of_other).pop().write_bytes(file.read_bytes())
        assert answered(second) == by_events(second)


def test_it_is_made_anew_by_another_program(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(findings_file, "code", lambda: "f" * 64)
    read = unread(monkeypatch)
    assert answered(store) == by_events(store)
    assert read == ["Z-2", "A-1", "Z-2", "B-1"]


def test_it_hides_no_altered_event(store: Store) -> None:
    """The store is walked when it is opened, whatever the file says."""
    with store.engine.begin() as connection:
        connection.exec_driver_sql("DROP TRIGGER events_no_update")
        connection.exec_driver_sql("UPDATE events SET payload = replace(payload, '360.0', '361.0')")
    with pytest.raises(StoreError, match="altered"):
        open_store()


def test_findings_that_passed_are_left_out_of_a_brief_answer_only(store: Store) -> None:
    """A judgement stays, on each of its days of measurement, with all that stopped it."""
    mixed = judgement("M-1", VALUES | {"flatness_um": 2.0}, day=datetime.date(2026, 10, 1))
    mixed.payload["result"]["measured"]["stroke"] = "2026-10-02"
    add(store, [mixed, judgement("M-2", VALUES | {"flatness_um": 99.0, "stroke_um": None})])
    whole, brief = measurements(store), measurements(store, brief=True)
    assert len(brief) < len(whole)
    pd.testing.assert_frame_equal(attempts(brief).reset_index(drop=True), attempts(whole).reset_index(drop=True))
    for day in (datetime.date(2026, 10, 1), datetime.date(2026, 10, 2)):
        for frame in (whole, brief):
            assert set(frame[is_between(frame, day, day)]["serial"]) == {"M-1"}


def test_a_store_of_one_unit_has_a_yield() -> None:
    """A category of one word is mapped to a category: not a number that can be added."""
    with open_store() as one:
        add(one, [judgement("A-1", VALUES)])
        made = yields(measurements(one), "serial")
    assert made[["units", "first", "last"]].to_numpy().tolist() == [[1, 1, 1]]
