"""Golden units: known good and known bad ones that show, at the start of a shift, that the bench measures as before.

A bench whose golden units differ from their history judges nothing else until a person has said why. All of it is
events of the store: golden_named {expect}, golden_met {serials}, golden_missed {serials, reasons}, golden_resolved
{reason}.
"""

import datetime
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from accept.fleet.measurements import FleetError, measurements
from accept.store import Store

EXPECTED = ("accepted", "rejected")
NAMED, MET, MISSED, RESOLVED = "golden_named", "golden_met", "golden_missed", "golden_resolved"
LEAST_BEFORE = 1  # earlier judgements that today's is compared with


class BenchStopped(FleetError):
    """The golden units were missed: nothing is judged until this is resolved."""


@dataclass(frozen=True)
class Checked:
    """Of one golden unit. problems: empty where it is as before; measured: whether it was judged since `since`."""

    serial: str
    expected: str
    measured: bool
    problems: tuple[str, ...]


def name_golden(store: Store, serial: str, expected: str, who: str) -> None:
    """Make a judged unit a golden one. Raises FleetError where it has not been judged as expected."""
    if expected not in EXPECTED:
        raise FleetError(f"'{expected}' is not a verdict of a golden unit; write {' or '.join(EXPECTED)}")
    last = store.latest(serial, "unit_judged")
    if last is None:
        raise FleetError(f"{serial} was never judged: judge it first, on a bench that is known to be right")
    verdict = last.data["result"]["verdict"]
    if verdict != expected:
        raise FleetError(f"{serial} was last {verdict}, not {expected}")
    store.append(NAMED, serial, {"expect": expected}, who=who)


def goldens(store: Store) -> dict[str, str]:
    """Serial -> expected verdict of every golden unit."""
    return {event.subject: str(event.data["expect"]) for event in store.events(what=NAMED)}


def check(store: Store, since: datetime.datetime, who: str) -> list[Checked]:
    """Compare every golden unit's judgement since `since` (UTC) with its history, and store what came of it.

    Raises FleetError where no unit is golden."""
    named = goldens(store)
    if not named:
        raise FleetError("no golden unit is named: accept golden name SERIAL --expect accepted")
    found = [compared(serial, expected, measurements(store, serial), since) for serial, expected in named.items()]
    missed = {c.serial: list(c.problems) for c in found if c.problems}
    if missed:
        store.append(MISSED, "", {"serials": sorted(missed), "reasons": missed}, who=who)
    elif all(c.measured for c in found):
        store.append(MET, "", {"serials": sorted(named)}, who=who)
    return found


def compared(serial: str, expected: str, frame: pd.DataFrame, since: datetime.datetime) -> Checked:
    """One golden unit against its own earlier judgements: the verdict, and every value within the uncertainties."""
    recent = frame[frame["time"] >= pd.Timestamp(since)]
    if recent.empty:
        return Checked(serial, expected, measured=False, problems=())
    last = recent[recent["seq"] == recent["seq"].max()]
    before = frame[frame["seq"] < last["seq"].iloc[0]]
    problems = []
    if (verdict := last["unit_verdict"].iloc[0]) != expected:
        problems.append(f"{verdict}, expected {expected}")
    if before["seq"].nunique() < LEAST_BEFORE:
        problems.append("has no earlier judgement to be compared with")
    problems += [words for _, row in last.iterrows() if (words := _differs(row, before))]
    return Checked(serial, expected, measured=True, problems=tuple(problems))


def _differs(row: pd.Series, before: pd.DataFrame) -> str | None:
    """What is wrong with a value, in words. A value that is missing now and was there before is a difference."""
    earlier = before[before["quantity"] == row["quantity"]].dropna(subset=["value"])
    if earlier.empty:
        return None
    middle = float(earlier["value"].median())
    if not np.isfinite(row["value"]):
        return f"{row['quantity']}: no value, {middle:.6g} {row['unit']} before"
    if not np.isfinite(row["U"]):
        return None
    U = float(np.hypot(row["U"], earlier["U"].median()))
    distance = abs(row["value"] - middle)
    if np.isfinite(U) and distance <= U:
        return None
    return f"{row['quantity']}: {row['value']:.6g}, {middle:.6g} {row['unit']} before; they differ by more than {U:.2g}"


def resolve(store: Store, reason: str, who: str) -> None:
    """Let the bench judge again. Raises FleetError without a reason or where nothing is to be resolved."""
    if not reason.strip():
        raise FleetError("say what was wrong with the bench and what was done: --reason")
    if stopped(store) is None:
        raise FleetError("nothing to resolve: the golden units were not missed")
    store.append(RESOLVED, "", {"reason": reason.strip()}, who=who)


def stopped(store: Store) -> Mapping[str, list[str]] | None:
    """Serial -> what was missed, where the last word on the golden units is that they were; else None."""
    last = max(
        (e for what in (MET, MISSED, RESOLVED) if (e := store.latest("", what))), key=lambda e: e.seq, default=None
    )
    return dict(last.data["reasons"]) if last is not None and last.what == MISSED else None


def may_judge(store: Store, serial: str) -> None:
    """Raises BenchStopped where the bench has missed its golden units and `serial` is none of them."""
    missed = stopped(store)
    if missed is None or serial in goldens(store):
        return
    words = "; ".join(f"{golden}: {', '.join(problems)}" for golden, problems in missed.items())
    raise BenchStopped(
        f"{serial}: not judged, because the bench missed its golden units ({words}); accept golden resolve"
    )
