"""State is a fold over events: what the bench knows is what its events say, however they are cut into portions."""

import random

import pytest

from accept.store import BenchState, Event, StoreError, UnitState, fold
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


def test_no_events_no_state() -> None:
    assert fold([]) == BenchState()


def test_the_last_judgement_counts_and_all_are_counted() -> None:
    state = fold(chain(judged("U1", "rejected"), judged("U2"), judged("U1", "accepted", sha="2")))
    unit = state.units["U1"]
    assert (unit.verdict, unit.attempts, unit.seq, unit.inputs) == ("accepted", 2, 3, {"unit.toml": "2"})
    assert (unit.result.serial, unit.result.verdict, unit.result.kind) == ("U1", "accepted", "apa")
    assert (state.units["U2"].attempts, state.seq) == (1, 3)


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
    assert fold(chain(judged("U1"))).units["U1"].unchanged(inputs, spec, code) is same


def test_signatures_gather_on_a_certificate() -> None:
    events = chain(judged("U1"), written("U1"), signed("U1", "technician", "a"), signed("U1", "qa", "b"))
    certificate = fold(events).units["U1"].certificate
    assert certificate is not None
    assert (certificate.path, certificate.sha256) == ("U1.pdf", "b")
    assert [(s.role, s.who, s.time) for s in certificate.signatures] == [
        ("technician", "Ada", TIME),
        ("qa", "Ada", TIME),
    ]


def test_a_new_certificate_has_no_signatures_and_a_new_judgement_no_certificate() -> None:
    old = [judged("U1"), written("U1"), signed("U1", "technician", "a")]
    certificate = fold(chain(*old, written("U1", "new"))).units["U1"].certificate
    assert certificate is not None
    assert certificate.signatures == ()
    assert fold(chain(*old, judged("U1"))).units["U1"].certificate is None


def test_a_refused_folder_is_remembered_until_it_is_judged() -> None:
    refused = NewEvent("unit_refused", "", {"path": "units/U1", "reason": "no unit.toml"})
    assert fold(chain(refused)).refused == {"units/U1": "no unit.toml"}
    assert fold(chain(refused, judged("U1"))).refused == {}


def test_other_kinds_only_pass() -> None:
    state = fold(chain(NewEvent("batch_started", "", {"paths": []}), NewEvent("never_heard_of")))
    assert state == BenchState(seq=2)


@pytest.mark.parametrize(
    "entry",
    [
        NewEvent("unit_judged", "U1", {"path": "x"}),
        NewEvent("unit_judged", "U1", dict(judged("U1").payload) | {"result": {}}),
        NewEvent("unit_judged", "U1", dict(judged("U1").payload) | {"result": None}),
        NewEvent("unit_refused", "", {}),
        NewEvent("unit_judged", "U1", {**judged("U1").payload, "path": 7}),
        NewEvent("certificate_signed", "U1", {"path": "U1.pdf", "sha256": None, "role": "qa"}),
    ],
)
def test_an_unusable_payload_names_its_event(entry: NewEvent) -> None:
    with pytest.raises(StoreError, match=f"event 1 .{entry.what}"):
        fold(chain(entry))


def test_a_certificate_of_a_unit_judged_elsewhere_is_history() -> None:
    """At QA's own desk the store knows nothing of the unit whose certificate is countersigned there."""
    state = fold(chain(written("never-judged"), signed("never-judged", "qa", "a", of="0"), judged("U1")))
    assert set(state.units) == {"U1"}


@pytest.mark.parametrize("of", ["first", None])  # None: from before events named the file
def test_a_countersignature_belongs_to_the_certificate_it_signs(of: str | None) -> None:
    """An accepted attempt's certificate is countersigned after a later attempt was rejected: the later one's own
    certificate is what a third attempt replaces."""
    events = [judged("U1"), signed("U1", "technician", "first", path="1.pdf")]
    events += [judged("U1", "rejected"), signed("U1", "technician", "second", path="2.pdf")]
    events += [signed("U1", "qa", "first and countersigned", of, path="1.pdf")]
    unit = fold(chain(*events)).units["U1"]
    assert unit.certificate is not None
    assert (unit.certificate.sha256, [s.role for s in unit.certificate.signatures]) == ("second", ["technician"])
    assert unit.handed_out is not None
    assert (unit.handed_out.attempt, unit.handed_out.sha256) == (2, "second")
    again = fold(chain(*events, signed("U1", "qa", "both", "second", path="2.pdf"))).units["U1"]
    assert again.certificate is not None
    assert (again.certificate.sha256, len(again.certificate.signatures)) == ("both", 2)


def test_a_countersignature_of_an_earlier_attempt_is_no_certificate_of_the_last() -> None:
    events = [judged("U1"), signed("U1", "technician", "first"), judged("U1", "rejected")]
    unit = fold(chain(*events, signed("U1", "qa", "countersigned", "first"))).units["U1"]
    assert unit.certificate is None
    assert unit.handed_out is not None
    assert (unit.handed_out.attempt, unit.handed_out.sha256) == (1, "countersigned")


def test_folding_in_portions_is_folding_at_once() -> None:
    dice = random.Random(3)
    entries = [judged("U0"), judged("U1"), judged("U2")]
    for _ in range(60):
        serial = f"U{dice.randrange(3)}"
        entries.append(dice.choice([judged(serial), written(serial), signed(serial, "qa", "x")]))
    events = chain(*entries)
    whole = fold(events)
    for cut in range(len(events)):
        assert fold(events[cut:], fold(events[:cut])) == whole


def test_folding_leaves_the_state_before_alone() -> None:
    before = fold(chain(judged("U1")))
    kept: dict[str, UnitState] = dict(before.units)
    fold(chain(judged("U1", "rejected"), judged("U2")), before)
    assert before.units == kept
