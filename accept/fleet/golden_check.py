"""The golden units of a shift against their references."""

import datetime
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from accept.base.documents.listings import GoldenCompared
from accept.base.documents.results import TYPED
from accept.fleet.errors import FleetError
from accept.fleet.golden import Golden, goldens, last_resolved, values_of
from accept.judging.reservations import same_recording
from accept.store import Store
from accept.store.payloads import GoldenMet, GoldenMissed, Reference, UnitJudged


def check(store: Store, since: datetime.datetime, who: str) -> list[GoldenCompared]:
    """Compare every golden unit's judgements by this bench since `since` (UTC) with its reference, and store the
    outcome. Every judgement counts, so that a further try does not hide a miss; after a decision only those that follow
    it. One of recordings or readings from before that is no measurement.

    Raises FleetError if no unit is golden."""
    named = goldens(store)
    if not named:
        raise FleetError("no golden unit is named: accept golden name SERIAL --expect accepted")
    after, bench = last_resolved(store), store.bench
    found = []
    for golden in named.values():
        judged, before = _recent(store, golden.serial, since, after, bench)
        new = any(not _is_of(each, before) for each in judged)
        found.append(replace(_check_golden(golden, judged), measured=new))
    missed = {c.serial: c.problems for c in found if c.problems}
    if missed:
        store.write(GoldenMissed(tuple(sorted(missed)), missed, bench, signed_changes=True), who=who)
    elif all(c.measured for c in found):
        store.write(GoldenMet(tuple(sorted(named)), bench, signed_changes=True), who=who)
    return found


def _recent(
    store: Store, serial: str, since: datetime.datetime, after: int, bench: str
) -> tuple[list[UnitJudged], list[UnitJudged]]:
    """Return the judgements of a unit by this bench since a time and after an event, and all before these. Those of a
    program that did not store the bench count for every bench."""
    judged, before = list[UnitJudged](), list[UnitJudged]()
    for event in store.events(serial, UnitJudged.KIND):
        each, is_recent = UnitJudged.of(event), datetime.datetime.fromisoformat(event.time) >= since
        (judged if is_recent and event.seq > after and each.bench in ("", bench) else before).append(each)
    return judged, before


def _is_of(judged: UnitJudged, before: Sequence[UnitJudged]) -> bool:
    """Return whether one of the recordings of a judgement, or without any all of its readings, are of earlier ones."""
    samples = judged.result.samples
    told = {name: own for name, own in samples.items() if not name.endswith(f"/{TYPED}")} or samples
    return any(
        same_recording(own, each.result.samples[name])
        for each in before
        for name, own in told.items()
        if name in each.result.samples
    )


def _check_golden(golden: Golden, judged: Sequence[UnitJudged]) -> GoldenCompared:
    problems: list[str] = []
    for each in judged:
        verdict, rows = each.result.verdict, values_of(each)
        wrong = [] if verdict == golden.expected else [f"{verdict}, expected {golden.expected}"]
        wrong += [words for name, r in golden.reference.items() if (words := _difference(name, r, rows.get(name)))]
        problems += [words for words in wrong if words not in problems]
    return GoldenCompared(golden.serial, golden.expected, bool(judged), tuple(problems))


def _difference(name: str, reference: Reference, row: Any) -> str | None:
    """Return what is wrong with a value, None if it is the reference within both uncertainties. A missing value is
    wrong; a quantity without reference has nothing to be compared with."""
    unit = reference.unit
    if row is None or row.value is None or not math.isfinite(row.value):
        return f"{name}: no value, {reference.value:.6g} {unit} is its reference"
    U = math.hypot(row.U or 0.0, reference.U or 0.0)
    if row.U is None and reference.U is None:
        return None  # neither is known: nothing to compare by
    distance = abs(row.value - reference.value)
    if distance <= U:
        return None
    return (
        f"{name}: {row.value:.6g} {unit}, {reference.value:.6g} {unit} is its reference; "
        f"they differ by {distance:.2g} {unit}, both uncertainties together allow {U:.2g} {unit}"
    )
