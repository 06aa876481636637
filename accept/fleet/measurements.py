"""Every judged quantity that the event store holds, as one table."""

import calendar
import datetime
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import pandas as pd

from accept.fleet.errors import FleetError
from accept.store import Event, Store

COLUMNS = [
    "seq", "time", "operator", "bench", "serial", "kind", "attempt", "unit_verdict", "spec", "check", "quantity",
    "value", "unit", "U", "lower", "upper", "verdict", "reason",
]  # fmt: skip
NOT_STATED = "not stated"


def measurements(store: Store, serial: str | None = None) -> pd.DataFrame:
    """One row per finding of every judgement, columns `COLUMNS`, in the order of the store. Raises StoreError.

    attempt: how often the serial was judged up to then. bench: name of the bench file, where one was used.
    """
    frame = pd.DataFrame(rows(store.events(serial, "unit_judged")), columns=COLUMNS)
    frame["time"] = pd.to_datetime(frame["time"], utc=True, format="ISO8601")
    numbers = ["value", "U", "lower", "upper"]
    frame[numbers] = frame[numbers].astype(float)
    return frame


def rows(events: Iterable[Event]) -> Iterator[dict[str, Any]]:
    """The findings of each event of a judgement."""
    attempts: Counter[str] = Counter()
    for event in events:
        result = event.data["result"]
        attempts[event.subject] += 1
        common = {
            "seq": event.seq,
            "time": event.time,
            "operator": event.who,
            "bench": bench_of(result),
            "serial": event.subject,
            "kind": result["kind"],
            "attempt": attempts[event.subject],
            "unit_verdict": result["verdict"],
            "spec": event.spec.split("@")[0],
        }
        for finding in result["findings"]:
            yield common | {name: finding.get(name) for name in COLUMNS[9:]}


def bench_of(result: Mapping[str, Any]) -> str:
    """Name of the bench file that a result was judged with."""
    calibration = result.get("calibration") or {}
    return str(calibration.get("bench") or NOT_STATED)


def attempts(frame: pd.DataFrame) -> pd.DataFrame:
    """One row per judgement: seq, time, operator, bench, serial, kind, attempt, unit_verdict, spec and its causes."""
    common = COLUMNS[:9]
    bad = frame[frame["verdict"] != "pass"]
    causes = {seq: ", ".join(dict.fromkeys(names)) for seq, names in bad.groupby("seq")["quantity"]}
    return frame.drop_duplicates("seq")[common].assign(causes=lambda f: [causes.get(seq, "") for seq in f["seq"]])


def latest(frame: pd.DataFrame) -> pd.DataFrame:
    """Only the rows of the last judgement of every serial."""
    return frame[frame["seq"] == frame.groupby("serial")["seq"].transform("max")]


def between(frame: pd.DataFrame, since: datetime.date | None, until: datetime.date | None) -> pd.DataFrame:
    """Judgements of these days, both included (UTC)."""
    days = frame["time"].dt.date
    keep = pd.Series(True, index=frame.index)
    if since is not None:
        keep &= days >= since
    if until is not None:
        keep &= days <= until
    return frame[keep]


def day(text: str | None, *, last: bool = False) -> datetime.date | None:
    """A day as people write it: 2026-10-05, or a month 2026-10, its first day or its last. Raises FleetError."""
    if text is None:
        return None
    try:
        if len(text) == 7:
            first = datetime.date.fromisoformat(f"{text}-01")
            return first.replace(day=calendar.monthrange(first.year, first.month)[1]) if last else first
        return datetime.date.fromisoformat(text)
    except ValueError as e:
        raise FleetError(f"'{text}' is not a day; write 2026-10-05, or 2026-10 for a month") from e


def of_quantity(frame: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """Rows of one quantity that have a value. Raises FleetError naming what the store holds instead."""
    found = frame[frame["quantity"] == quantity]
    if found.empty:
        held = ", ".join(sorted(frame["quantity"].unique())) or "none"
        raise FleetError(f"no judged unit has a quantity '{quantity}'; the store holds: {held}")
    known = found[found["value"].notna()]
    if known.empty:
        raise FleetError(f"'{quantity}' has no value in any of {found['seq'].nunique()} judgements")
    return known
