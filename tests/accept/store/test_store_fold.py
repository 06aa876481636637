"""State is a fold over events: what the bench knows is what its events say, however they are cut into portions."""

import random
from dataclasses import replace

import pytest

from accept.store import Event, StoreError, UnitState, fold
from accept.store.event import GENESIS, NewEvent, sealed
from accept.store.payloads import CertificateSigned

TIME = "2026-01-01T00:00:00.000000+00:00"


def chain(*entries: NewEvent, who: str = "Ada") -> list[Event]:
    events: list[Event] = []
    for i, entry in enumerate(entries, start=1):
        events.append(sealed(i, TIME, who, entry, "code", events[-1].hash if events else GENESIS))
    return events


def judged(serial: str, verdict: str = "accepted", sha: str = "1", path: str = "") -> NewEvent:
    inputs = {"unit.toml": sha}
    result = {"serial": serial, "kind": "apa", "verdict": verdict, "findings": []}
    payload = {"path": path or f"units/{serial}", "inputs": inputs, "spec_sha256": "s", "code_sha256": "c"}
    return NewEvent("unit_judged", serial, payload | {"result": result}, "apa@s")


def written(serial: str, sha: str = "w") -> NewEvent:
    return NewEvent("certificate_written", serial, {"path": f"{serial}.pdf", "sha256": sha})


def signed(serial: str, role: str, sha: str, of: str | None = None, path: str = "") -> NewEvent:
    return CertificateSigned(path or f"{serial}.pdf", sha, role, before=of).about(serial)


def folded(events: list[Event]) -> UnitState:
    unit = fold(events)
    assert unit is not None
    return unit


def test_no_events_no_state() -> None:
    assert fold([]) is None


def test_the_last_judgement_counts_and_all_are_counted() -> None:
    unit = folded(chain(judged("U1", "rejected"), judged("U1", "accepted", sha="2")))
    assert (unit.verdict, unit.attempts, unit.seq, unit.judged.inputs) == ("accepted", 2, 2, {"unit.toml": "2"})
    assert (unit.result.serial, unit.result.verdict, unit.result.kind) == ("U1", "accepted", "apa")


@pytest.mark.parametrize(
    ("inputs", "spec", "code", "same"),
    [
        ({"unit.toml": "1"}, "s", "c", True),
        ({"unit.toml": "2"}, "s", "c", False),
        ({"unit.toml": "1", "new.mat": "3"}, "s", "c", False),
        ({}, "s", "c", False),
        ({"unit.toml": "1"}, "t", "c", False),
        ({"unit.toml": "1"}, "s", "d", False),
    ],
)
def test_unchanged_means_inputs_spec_and_code(inputs: dict[str, str], spec: str, code: str, same: bool) -> None:
    assert folded(chain(judged("U1"))).unchanged(inputs, spec, code) is same


def test_signatures_gather_on_a_certificate() -> None:
    events = chain(judged("U1"), written("U1"), signed("U1", "technician", "a"), signed("U1", "qa", "b"))
    certificate = folded(events).certificate
    assert certificate is not None
    assert (certificate.path, certificate.sha256) == ("U1.pdf", "b")
    assert [(s.role, s.who, s.time) for s in certificate.signatures] == [
        ("technician", "Ada", TIME),
        ("qa", "Ada", TIME),
    ]


def test_a_new_certificate_has_no_signatures_and_a_new_judgement_no_certificate() -> None:
    old = [judged("U1"), written("U1"), signed("U1", "technician", "a")]
    certificate = folded(chain(*old, written("U1", "new"))).certificate
    assert certificate is not None
    assert certificate.signatures == ()
    assert folded(chain(*old, judged("U1"))).certificate is None


def test_other_kinds_only_pass() -> None:
    assert fold(chain(NewEvent("batch_started", "", {"paths": []}), NewEvent("never_heard_of"))) is None


@pytest.mark.parametrize(
    "entry",
    [
        NewEvent("unit_judged", "U1", {"path": "x"}),
        NewEvent("unit_judged", "U1", dict(judged("U1").payload) | {"result": {}}),
        NewEvent("unit_judged", "U1", dict(judged("U1").payload) | {"result": None}),
        NewEvent("unit_judged", "U1", {**judged("U1").payload, "path": 7}),
        NewEvent("certificate_signed", "U1", {"path": "U1.pdf", "sha256": None, "role": "qa"}),
    ],
)
def test_an_unusable_payload_names_its_event(entry: NewEvent) -> None:
    with pytest.raises(StoreError, match=f"event 1 .{entry.what}"):
        fold(chain(entry))


def test_a_certificate_of_a_unit_judged_elsewhere_is_history() -> None:
    """At QA's own desk the store knows nothing of the unit whose certificate is countersigned there."""
    assert fold(chain(written("never-judged"), signed("never-judged", "qa", "a", of="0"))) is None


@pytest.mark.parametrize("of", ["first", None])  # None: from before events named the file
def test_a_countersignature_belongs_to_the_certificate_it_signs(of: str | None) -> None:
    """An accepted attempt's certificate is countersigned after a later attempt was rejected: the later one's own
    certificate is what a third attempt replaces."""
    events = [judged("U1"), signed("U1", "technician", "first", path="1.pdf")]
    events += [judged("U1", "rejected"), signed("U1", "technician", "second", path="2.pdf")]
    events += [signed("U1", "qa", "first and countersigned", of, path="1.pdf")]
    unit = folded(chain(*events))
    assert unit.certificate is not None
    assert (unit.certificate.sha256, [s.role for s in unit.certificate.signatures]) == ("second", ["technician"])
    assert unit.handed_out is not None
    assert (unit.handed_out.attempt, unit.handed_out.sha256) == (2, "second")
    again = folded(chain(*events, signed("U1", "qa", "both", "second", path="2.pdf")))
    assert again.certificate is not None
    assert (again.certificate.sha256, len(again.certificate.signatures)) == ("both", 2)


def test_a_countersignature_of_an_earlier_attempt_is_no_certificate_of_the_last() -> None:
    events = [judged("U1"), signed("U1", "technician", "first"), judged("U1", "rejected")]
    unit = folded(chain(*events, signed("U1", "qa", "countersigned", "first")))
    assert unit.certificate is None
    assert unit.handed_out is not None
    assert (unit.handed_out.attempt, unit.handed_out.sha256) == (1, "countersigned")


def test_folding_in_portions_is_folding_at_once() -> None:
    dice = random.Random(3)
    entries = [judged("U1")]
    for _ in range(60):
        entries.append(dice.choice([judged("U1"), written("U1"), signed("U1", "qa", "x")]))
    events = chain(*entries)
    whole = fold(events)
    for cut in range(len(events)):
        assert fold(events[cut:], fold(events[:cut])) == whole


def test_folding_leaves_the_state_before_alone() -> None:
    before = folded(chain(judged("U1")))
    kept = replace(before)
    fold(chain(judged("U1", "rejected")), before)
    assert before == kept
