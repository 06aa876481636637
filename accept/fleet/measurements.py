"""Every judged quantity that the event store holds, as one table."""

import calendar
import datetime
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import pandas as pd

from accept.base.documents.results import UnitEntry
from accept.fleet.errors import FleetError
from accept.judging.voids import Void, voids
from accept.store import Event, Store
from accept.store.payloads import InstrumentChecked, UnitJudged
from checks.cause import Cause

OF_A_JUDGEMENT = [
    "seq", "time", "batch", "place", "operator", "bench", "lot", "supplier", "order", "shift", "study", "serial",
    "kind", "attempt", "unit_verdict", "spec", "voided",
]  # fmt: skip
OF_A_FINDING = [
    "check", "quantity", "value", "unit", "U", "lower", "upper", "verdict", "reason", "required", "measured",
]  # fmt: skip
COLUMNS = [*OF_A_JUDGEMENT, *OF_A_FINDING]
OF_ORIGIN = ("lot", "supplier", "order", "shift", "study")
NOT_STATED = "not stated"
CHECKED = "check:"  # before the name of an instrument: the quantity of its comparisons with the reference
VOIDED = "voided"  # verdict of a unit whose judgement was declared void
NOT_MEASURED = Cause.NOT_MEASURED.value


def measurements(store: Store, serial: str | None = None) -> pd.DataFrame:
    """Return one row per finding of every judgement, columns `COLUMNS`, in the order of the store.

    attempt: how often the serial was judged up to then. bench: name of the bench file, if one was used. batch, place:
    the batch in which it was judged and the unit's place in it. measured: the day stated for the check, else NaT.
    voided: why quality assurance declared the judgement void, "" if it did not; unit_verdict is "voided" then. Raises
    StoreError.
    """
    return _typed(pd.DataFrame(rows(store.events(serial, UnitJudged.KIND), voids(store, serial)), columns=COLUMNS))


def _typed(frame: pd.DataFrame) -> pd.DataFrame:
    for name in ("time", "measured"):
        frame[name] = pd.to_datetime(frame[name], utc=True, format="ISO8601").dt.as_unit("us")
    frame["required"] = frame["required"].fillna(True).astype(bool)
    numbers = ["value", "U", "lower", "upper"]
    frame[numbers] = frame[numbers].astype(float)
    return frame


def rows(events: Iterable[Event], void: Mapping[int, Void]) -> Iterator[dict[str, Any]]:
    """Yield the findings of each event of a judgement."""
    attempts: Counter[str] = Counter()
    for event in events:
        judged = UnitJudged.of(event)
        result, batch = judged.result, judged.batch
        attempts[event.subject] += 1
        common = {
            "seq": event.seq,
            "time": event.time,
            "batch": batch.seq if batch else event.seq,
            "place": batch.place if batch else 0,
            "operator": event.who,
            "bench": bench_of(result),
            **{name: result.origin.get(name, NOT_STATED) for name in OF_ORIGIN},
            "serial": event.subject,
            "kind": result.kind,
            "attempt": attempts[event.subject],
            "unit_verdict": VOIDED if event.seq in void else str(result.verdict),
            "spec": event.spec.split("@")[0],
            "voided": void[event.seq].words if event.seq in void else "",
        }
        for finding in result.findings:
            own = {name: getattr(finding, name, None) for name in OF_A_FINDING}
            yield common | own | {"verdict": str(finding.verdict), "measured": result.measured.get(finding.check)}


def instrument_checks(store: Store, name: str) -> pd.DataFrame:
    """Return the comparisons of an instrument with its reference (`accept hw check`) as rows with the columns
    `COLUMNS`: serial is the time of the comparison, bench the instrument with its serial number, |E_n| is 1 at the
    limits. Raises FleetError if the instrument was never compared, StoreError."""
    events = [(event, InstrumentChecked.of(event)) for event in store.events(what=InstrumentChecked.KIND)]
    found = [(event, each) for event, each in events if each.instrument == name]
    if not found:
        known = ", ".join(sorted({each.instrument for _, each in events})) or "none"
        raise FleetError(f"no comparison of an instrument '{name}' with its reference; there are of: {known}")
    rows = [
        {
            **dict.fromkeys(COLUMNS, NOT_STATED),
            "seq": event.seq, "time": event.time, "batch": event.seq, "place": 0, "operator": event.who,
            "bench": f"{name} {each.serial or ''}".strip(), "serial": each.time[:19], "kind": each.what, "attempt": 1,
            "voided": "", "check": "reference", "quantity": f"{CHECKED}{name}", "value": each.value, "unit": each.unit,
            "U": each.U, "lower": each.reference - math.hypot(found[0][1].U, each.U_reference),
            "upper": each.reference + math.hypot(found[0][1].U, each.U_reference),
            "verdict": "pass" if each.passed else "fail", "reason": None, "required": True, "measured": each.time,
        }
        for event, each in found
    ]  # fmt: skip
    return _typed(pd.DataFrame(rows, columns=COLUMNS))


def when(frame: pd.DataFrame) -> pd.Series:
    """Return when each row was measured: the stated day, else the time of judging."""
    return frame["measured"].fillna(frame["time"])


def in_order_of_measurement(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows by the day of measurement (of judging, if none is stated), then as they stood in their batch.

    The order in which judgements were stored is no part of it: that depends on which worker was done first.
    """
    return frame.assign(day=when(frame).dt.floor("D")).sort_values(["day", "batch", "place", "seq"], kind="stable")


def not_void(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of judgements that were not declared void."""
    return frame[frame["voided"] == ""]


def counted(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of judgements that say something of the process: not void, and of no study of the gauge."""
    return frame[(frame["voided"] == "") & (frame["study"] == NOT_STATED)]


def first_attempts(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the first attempt at every quantity of every unit: one row for each, of the whole history in frame.

    A quantity that was not measured has not been attempted: a unit that was judged by a short spec first is attempted
    again only for what that spec asked. A judgement that was declared void, or is of a study, is no attempt.
    """
    frame = counted(frame)
    attempted = frame[(frame["verdict"] != "no_result") | (frame["reason"] != NOT_MEASURED)]
    return attempted.sort_values("seq", kind="stable").drop_duplicates(["serial", "quantity"])


def bench_of(result: UnitEntry) -> str:
    """Return the name of the bench file that a result was judged with."""
    calibration = result.calibration or {}
    return str(calibration.get("bench") or NOT_STATED)


def attempts(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per judgement: seq, time, operator, bench, serial, kind, attempt, verdict, spec, causes."""
    bad = frame[frame["verdict"] != "pass"]
    causes = {seq: ", ".join(dict.fromkeys(names)) for seq, names in bad.groupby("seq")["quantity"]}
    return frame.drop_duplicates("seq")[OF_A_JUDGEMENT].assign(
        causes=lambda f: [causes.get(seq, "") for seq in f["seq"]]
    )


def latest(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the last judgement of every serial."""
    return frame[frame["seq"] == frame.groupby("serial")["seq"].transform("max")]


def between(frame: pd.DataFrame, since: datetime.date | None, until: datetime.date | None) -> pd.DataFrame:
    """Return the rows of these days, both included (UTC): of measurement if it is stated, else of judging."""
    days = when(frame).dt.date
    keep = pd.Series(True, index=frame.index)
    if since is not None:
        keep &= days >= since
    if until is not None:
        keep &= days <= until
    return frame[keep]


def day(text: str | None, *, last: bool = False) -> datetime.date | None:
    """Return a day as people write it: 2026-10-05, or a month 2026-10: its first or last day. Raises FleetError."""
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
    """Return the rows of one quantity that have a value. Raises FleetError naming what the store holds instead."""
    found = frame[frame["quantity"] == quantity]
    if found.empty:
        held = ", ".join(sorted(frame["quantity"].unique())) or "none"
        raise FleetError(f"no judged unit has a quantity '{quantity}'; the store holds: {held}")
    known = found[found["value"].notna()]
    if known.empty:
        raise FleetError(f"'{quantity}' has no value in any of {found['seq'].nunique()} judgements")
    return known
