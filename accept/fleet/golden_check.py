"""The golden units of a shift against their own history."""

import datetime
from dataclasses import dataclass

import numpy as np
import pandas as pd

from accept.fleet.errors import FleetError
from accept.fleet.measurements import measurements
from accept.judging.golden import goldens
from accept.store import Store
from accept.store.payloads import GoldenMet, GoldenMissed

LEAST_BEFORE = 1  # earlier judgements that today's is compared with


@dataclass(frozen=True)
class Checked:
    """The comparison of one golden unit with its history. problems: empty if it is as before; measured: whether it was
    judged since `since`."""

    serial: str
    expected: str
    measured: bool
    problems: tuple[str, ...]


def check(store: Store, since: datetime.datetime, who: str) -> list[Checked]:
    """Compare every golden unit's judgement since `since` (UTC) with its history, and store what came of it.

    Raises FleetError where no unit is golden."""
    named = goldens(store)
    if not named:
        raise FleetError("no golden unit is named: accept golden name SERIAL --expect accepted")
    found = [compared(serial, expected, measurements(store, serial), since) for serial, expected in named.items()]
    missed = {c.serial: c.problems for c in found if c.problems}
    if missed:
        store.write(GoldenMissed(tuple(sorted(missed)), missed), who=who)
    elif all(c.measured for c in found):
        store.write(GoldenMet(tuple(sorted(named))), who=who)
    return found


def compared(serial: str, expected: str, frame: pd.DataFrame, since: datetime.datetime) -> Checked:
    """Compare one golden unit with its own earlier judgements: the verdict, and every value within the
    uncertainties."""
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
    """Return what is wrong with a value, in words. A value that is missing now and was there before is a difference."""
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
    unit = row["unit"]
    return (
        f"{row['quantity']}: {row['value']:.6g} {unit}, {middle:.6g} {unit} before; "
        f"they differ by {distance:.2g} {unit}, both uncertainties together allow {U:.2g} {unit}"
    )
