"""The golden units of a shift against their references."""

import datetime
import math
from collections.abc import Sequence
from typing import Any

from accept.base.documents.listings import GoldenCompared
from accept.fleet.errors import FleetError
from accept.fleet.golden import Golden, goldens, last_resolved, values_of
from accept.store import Store
from accept.store.payloads import GoldenMet, GoldenMissed, Reference, UnitJudged


def check(store: Store, since: datetime.datetime, who: str) -> list[GoldenCompared]:
    """Compare every golden unit's judgements by this bench since `since` (UTC) with its reference, and store the
    outcome. Every judgement counts, so that a further try does not hide a miss; after a decision only those that follow
    it.

    Raises FleetError if no unit is golden."""
    named = goldens(store)
    if not named:
        raise FleetError("no golden unit is named: accept golden name SERIAL --expect accepted")
    after, bench = last_resolved(store), store.bench
    found = [_check_golden(golden, _recent(store, golden.serial, since, after, bench)) for golden in named.values()]
    missed = {c.serial: c.problems for c in found if c.problems}
    if missed:
        store.write(GoldenMissed(tuple(sorted(missed)), missed, bench, signed_changes=True), who=who)
    elif all(c.measured for c in found):
        store.write(GoldenMet(tuple(sorted(named)), bench, signed_changes=True), who=who)
    return found


def _recent(store: Store, serial: str, since: datetime.datetime, after: int, bench: str) -> list[UnitJudged]:
    """Return the judgements of a unit by this bench since a time and after an event. Those of a program that did not
    store the bench count for every bench."""
    events = store.events(serial, UnitJudged.KIND, after=after)
    judged = (UnitJudged.of(e) for e in events if datetime.datetime.fromisoformat(e.time) >= since)
    return [each for each in judged if each.bench in ("", bench)]


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
