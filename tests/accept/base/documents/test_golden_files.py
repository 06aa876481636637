"""Stores and documents of an earlier version are read, and written again byte for byte."""

import gzip
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from accept.base.documents.analyses import GapDocument, MisalignmentDocument
from accept.base.documents.document import Document, DocumentError
from accept.base.documents.manifest import Manifest
from accept.base.documents.results import ListedUnit, ResultsDocument, UnitRecord
from accept.models.model_file import effects_of, open_model_file
from accept.store import NewEvent, Store, StoreError, fold, open_store
from accept.store.event import Event, sealed
from accept.store.payloads import (
    KINDS,
    AttemptVoided,
    BaselineSet,
    BenchStated,
    GoldenMet,
    GoldenRetired,
    InstrumentChecked,
    KeysRevoked,
    NonconformanceDecided,
    Payload,
    RecordRefused,
    SerialConfirmed,
    SpecApproved,
    UnitJudged,
    UnitRefused,
    payload_of,
)
from accept.workflow.state.unit_state import fold_run
from checks.verdict import UnitVerdict

GOLDEN = Path(__file__).with_name("golden")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    (tmp_path / "store.sqlite").write_bytes(gzip.decompress((GOLDEN / "store.sqlite.gz").read_bytes()))
    (tmp_path / "store.head").write_bytes((GOLDEN / "store.head").read_bytes())
    with open_store(f"sqlite:///{tmp_path / 'store.sqlite'}") as opened:
        yield opened


def test_a_store_of_an_earlier_version_holds(store: Store) -> None:
    assert str(store.head()) == (GOLDEN / "store.head").read_text().strip()
    assert store.check() is None


def test_every_event_is_written_again_as_it_was(store: Store) -> None:
    kinds = set()
    for event in store.events():
        payload = payload_of(event)
        assert payload is not None, event.name
        assert payload.about(event.subject, event.spec).text() == event.payload
        kinds.add(type(payload))
    assert set(KINDS.values()) - kinds == {
        AttemptVoided,
        BaselineSet,
        BenchStated,
        GoldenMet,
        GoldenRetired,
        RecordRefused,
        InstrumentChecked,
        KeysRevoked,
        NonconformanceDecided,
        SerialConfirmed,
        SpecApproved,
    }  # which that store has none of


def test_the_state_of_an_earlier_store(store: Store) -> None:
    serials = dict.fromkeys(event.subject for event in store.events(what=UnitJudged.KIND))
    units = {serial: unit for serial in serials if (unit := fold(store.events(serial))) is not None}
    verdicts = {serial: (unit.verdict, unit.attempts) for serial, unit in units.items()}
    assert verdicts == {
        "APA-01": ("accepted", 1),
        "APA-02": ("rejected", 1),
        "APA-03": ("incomplete", 2),
        "APA-04": ("incomplete", 1),
        "APA-05": ("accepted", 1),
    }
    certificate = units["APA-02"].certificate
    assert certificate is not None
    assert [(s.who, s.role) for s in certificate.signatures] == [("Ann", "technician"), ("Quinn", "qa")]
    attempt = fold_run("APA-05", store.events("APA-05")).attempt
    assert attempt is not None
    readings = attempt.step("capacitance").readings("sensor_uF")
    assert [(r.value, r.U, r.day) for r in readings[:1]] == [(4.95, 0.02, "2026-11-20")]
    assert len(readings) == 2
    assert [e.value for e in attempt.step("stroke").entries] == [366]  # 300 was undone, then measured anew
    assert attempt.step("stroke").reasons == ("the clamp was loose",)
    assert [n.nonconformance for n in attempt.step("flatness").notes] == [True]
    assert attempt.gap == (1, {"verdict": "no_missing_effect", "notes": []})
    linked = fold_run("APA-06", store.events("APA-06")).attempt
    assert linked is not None
    assert linked.channels == {"V": "volt"}
    assert [entry.day for entry in linked.step("flatness").entries] == ["2026-11-21"]


def test_results_json_is_written_again_as_it_was() -> None:
    content = (GOLDEN / "results.json").read_bytes()
    results = ResultsDocument.from_text(content)
    assert [unit.verdict for unit in results.units] == ["accepted", "rejected", "accepted"]
    text = json.dumps(results.to_json(), indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False)
    assert text.encode() + b"\n" == content


@pytest.mark.parametrize(
    ("name", "kind", "layout"),
    [
        ("gap.json", GapDocument, {"indent": 1}),
        ("manifest.json", Manifest, {"indent": 1, "sort_keys": True, "ensure_ascii": False}),
        ("misalign.json", MisalignmentDocument, {"indent": 1}),
    ],
)
def test_a_document_is_written_again_as_it_was(name: str, kind: type[Document], layout: dict[str, Any]) -> None:
    text = (GOLDEN / name).read_text()
    assert json.dumps(kind.from_text(text).to_json(), allow_nan=False, **layout) == text.rstrip("\n")


def test_the_improved_model_of_an_earlier_version_opens() -> None:
    given = open_model_file(GOLDEN / "model.toml")
    assert given.model.name == "strut-S-4"
    assert effects_of(given.spec) == [("loop_delay", {"tau_us": pytest.approx(60.044, abs=0.001)})]


def unit(**changes: object) -> dict[str, object]:
    document = json.loads((GOLDEN / "results.json").read_bytes())
    return {**document["units"][1], **changes}


def test_keys_of_a_later_version_are_passed_over_and_those_of_an_earlier_one_may_lack() -> None:
    later = ListedUnit.from_json(unit(lot="7"))
    assert later == ListedUnit.from_json(unit())
    earlier = {key: value for key, value in unit().items() if key not in ("notes", "parts", "samples", "information")}
    assert UnitRecord.from_json(earlier).verdict is UnitVerdict.REJECTED


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"verdict": "good"}, "verdict"),
        ({"serial": 7}, "serial"),
        ({"findings": None}, "findings"),
        ({"inputs": {"unit.toml": 7}}, "inputs.unit.toml"),
        ({"findings": [{"check": "capacitance"}]}, "findings.0.quantity"),
    ],
)
def test_a_wrong_key_is_named(change: dict[str, object], key: str) -> None:
    with pytest.raises(DocumentError, match=rf"(?m)^\[{key}\]"):
        UnitRecord.from_json(unit(**change))


@pytest.mark.parametrize("number", ["NaN", "Infinity", '"4.4"', "true"])
def test_a_value_that_is_no_finite_number_is_refused(number: str) -> None:
    content = json.dumps(unit()).replace('"value": 1.72', f'"value": {number}')
    assert number in content
    with pytest.raises(DocumentError, match="value"):
        UnitRecord.from_text(content)


def test_a_cause_of_another_version_stays_as_words() -> None:
    document = unit()
    document["findings"][1]["cause"] = {"code": "tomorrows_cause", "value": 3}
    (finding,) = (f for f in UnitRecord.from_json(document).findings if f.quantity == "sensor_uF")
    assert finding.verdict == "fail"
    assert "tomorrows_cause" in str(finding.cause)


def event(payload: Payload | NewEvent) -> Event:
    entry = payload.about("U1") if isinstance(payload, Payload) else payload
    return sealed(1, "2026-01-01T00:00:00.000000+00:00", "Ada", entry, "code", "0" * 64)


def test_an_event_of_a_kind_that_is_unknown_here_is_passed_over() -> None:
    assert payload_of(event(NewEvent("of_a_later_version", "U1", {"x": 1}))) is None


def test_an_event_is_not_read_as_another_kind() -> None:
    with pytest.raises(StoreError, match=r"event 1 \(unit_refused U1\).*unit_judged"):
        UnitJudged.of(event(UnitRefused("a", "b")))


@pytest.mark.parametrize("reason", [7, None])
def test_what_has_another_type_is_not_written(reason: object) -> None:
    with pytest.raises(DocumentError, match="reason"):
        UnitRefused("a", reason).about()  # type: ignore[arg-type]


def test_a_path_with_bytes_that_are_not_utf8_is_read() -> None:
    assert UnitRefused.of(event(UnitRefused("a\udce4", "no unit.toml"))).reason == "no unit.toml"
