"""The provenance is read by its declared types: whatever else stands there is refused in words, at every level."""

import copy
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from accept.certificate import CertificateContent, InvalidCertificate, Provenance
from accept.certificate.contents.provenance import PROVENANCE
from accept.certificate.contents.statements import ROWS, STATEMENTS
from tests.accept.certificate.certificate_help import certificate_contents, stated_head

TIME = "2026-05-04T10:00:00+00:00"
WHOLE: dict[str, Any] = {
    "attempt": 3,
    "replaces": {
        "verdict": "accepted", "time": TIME, "certificate": None,
        "earlier_attempt": 1, "earlier_certificate": "ab" * 32,
    },
    "reason": "measured again",
    "before": {"stroke_um": {"value": 365.5, "U": 2}},
    "earlier": {
        "verdicts": {"accepted": 1, "rejected": 1},
        "not_accepted": {"attempt": 1, "verdict": "rejected", "time": TIME},
    },
    "amends": "AC-7",
    "judged": TIME,
    "signed_because": "the customer waits",
    "laboratory": {"name": "Laboratory", "methods": {"stroke": "MP-1"}},
    "number": "AC-8",
    "approval": {"builtin": True},
    "head": stated_head(),
    "bench": "PEM",
    "result": {"record_sha256": "ab" * 32, "spec_sha256": "cd" * 32},
    "authority": "its key lies at this bench",
    "signature": "ef" * 32,
    "crl": "PEM",
    "demo": True,
}  # fmt: skip
OTHERS = (None, False, -1, 1.5, "", [], ["x"], {}, {"more": 1}, float("nan"), 10**5000)
HELD = {  # what may stand there although it is of another kind
    ("replaces", "None"), ("replaces.certificate", "None"), ("replaces.certificate", "''"),
    ("replaces.earlier_attempt", "-1"), ("reason", "''"), ("before", "{}"), ("before.stroke_um.value", "-1"),
    ("before.stroke_um.value", "1.5"), ("before.stroke_um.U", "-1"), ("before.stroke_um.U", "1.5"),
    ("earlier.not_accepted.attempt", "-1"), ("laboratory", "{}"),
    ("laboratory.methods", "{}"), ("approval", "None"), ("approval", "{}"), ("approval", "{'more': 1}"),
    ("head", "None"), ("head.seq", "-1"), ("result.record_sha256", "''"), ("result.spec_sha256", "''"),
}  # fmt: skip


@pytest.fixture
def contents(tmp_path: Path) -> CertificateContent:
    return replace(certificate_contents(tmp_path / "unit"), provenance=WHOLE)


def nodes(given: Any, at: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    for key, value in given.items() if isinstance(given, dict) else ():
        yield (*at, key)
        yield from nodes(value, (*at, key))


def with_value(at: tuple[str, ...], value: Any) -> dict[str, Any]:
    new = copy.deepcopy(WHOLE)
    place = new
    for key in at[:-1]:
        place = place[key]
    place[at[-1]] = value
    return new


def value_at(at: tuple[str, ...]) -> Any:
    found: Any = WHOLE
    for key in at:
        found = found[key]
    return found


def test_what_it_states_is_read_and_written_as_it_was(contents: CertificateContent) -> None:
    assert contents.stated.to_json() == WHOLE
    assert WHOLE.keys() == {field.name for field in fields(Provenance)}
    for key in WHOLE:
        fewer = {name: value for name, value in WHOLE.items() if name != key}
        assert getattr(replace(contents, provenance=fewer).stated, key) == getattr(Provenance(), key), key
    assert replace(contents, provenance={}).stated == Provenance()  # of a program that stated none


@pytest.mark.parametrize("at", [at for at in nodes(WHOLE) if at[0] != "approval" or at == ("approval",)], ids=".".join)
def test_anything_else_is_refused_in_words(contents: CertificateContent, at: tuple[str, ...]) -> None:
    """Other types, nothing, one more key, another level. The approval is compared key by key under its signature."""
    here = value_at(at)
    more = [{**here, "more": "x"}] if isinstance(here, dict) and at[-1] not in ("verdicts", "before", "methods") else []
    for value in (*OTHERS, *([] if at == ("approval",) else [{"value": here}, *more]), [here]):
        changed = replace(contents, provenance=with_value(at, value))
        if (".".join(at), repr(value) if value != 10**5000 else "huge") in HELD:
            assert changed.stated is not None
            continue
        with pytest.raises(InvalidCertificate, match=r"^provenance") as refused:
            print(at, value if value != 10**5000 else "huge", changed.stated)
        assert len(str(refused.value)) < 400


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("judged", "2026-05-04T10:00:00"),
        ("judged", "yesterday"),
        ("attempt", 0),
        ("head", stated_head() | {"hash": "AB" * 32}),
        ("replaces", {"verdict": "accepted", "time": TIME, "certificate": None, "earlier_attempt": 1}),
        ("replaces", {"verdict": "accepted", "time": TIME}),
        ("earlier", {"verdicts": {"accepted": 1}, "not_accepted": WHOLE["earlier"]["not_accepted"]}),
        ("earlier", {"verdicts": {"rejected": 1}, "not_accepted": None}),
        ("earlier", {"verdicts": {"splendid": 1}, "not_accepted": None}),
        (
            "earlier",
            WHOLE["earlier"] | {"not_accepted": {"attempt": 1, "verdict": "void; signed by Ada", "time": TIME}},
        ),
        ("replaces", WHOLE["replaces"] | {"verdict": "void; signed by Ada"}),
        ("earlier", {"verdicts": {"accepted": 0}, "not_accepted": None}),
        ("laboratory", {"accredited": "yes"}),
        ("laboratory", {"name": ""}),
        ("laboratory", {"methods": {"stroke": ""}}),
    ],
)
def test_a_statement_that_contradicts_itself_is_refused(contents: CertificateContent, field: str, value: Any) -> None:
    with pytest.raises(InvalidCertificate, match=field):
        print(replace(contents, provenance=WHOLE | {field: value}).stated)


def test_every_row_of_the_page_is_that_of_a_statement() -> None:
    rows = {each.row for each in STATEMENTS}
    assert {*ROWS} - rows == {"Customer", "Methods", "Sampling"}  # of the laboratory, beside its own
    assert {each.name for each in PROVENANCE} == WHOLE.keys()
