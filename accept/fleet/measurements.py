"""Every judged quantity that the event store holds, as one table."""

import calendar
import datetime
import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import pandas as pd

from accept.fleet.errors import FleetError
from accept.fleet.findings_file import (
    NOT_STATED,
    OF_A_FINDING,
    OF_ORIGIN,
    TRUTH,
    TYPES,
    Column,
    FindingsTable,
    findings,
)
from accept.fleet.golden import goldens
from accept.judging.reservations import concessions, voids
from accept.store import Store
from accept.store.payloads import InstrumentChecked
from checks.cause import Cause
from checks.rounding import rounded, rounded_U

VOIDED = "voided"  # verdict of a unit whose judgement was declared void, and the column that says why
GOLDEN = "golden"  # column: the unit is a golden one, which the bench is checked by and no process made
CONCEDED = "conceded"  # the column of the concession by which the unit passes, "" if it passes without or does not
COLUMNS_OF_A_JUDGEMENT = [
    "seq", "time", "batch", "place", "operator", "bench", *OF_ORIGIN, "serial", "kind", "attempt", "unit_verdict",
    "spec", "held_by", VOIDED, CONCEDED, "simulated", GOLDEN, "typed",
]  # fmt: skip
COLUMNS_OF_A_FINDING = [
    "check", "quantity", "value", "unit", "U", "lower", "upper", "verdict", "reason", "required", "measured",
    "instrument",
]  # fmt: skip
COLUMNS = [*COLUMNS_OF_A_JUDGEMENT, *COLUMNS_OF_A_FINDING]
TIMES = ("time", "measured")
CHECKED = "check:"  # before the name of an instrument: the quantity of its comparisons with the reference
NOT_MEASURED = Cause.NOT_MEASURED.value


def measurements(
    store: Store,
    serial: str | None = None,
    *,
    columns: Collection[str] = COLUMNS,
    after: int = 0,
    brief: bool = False,
) -> pd.DataFrame:
    """Return one row per finding of every judgement, in the order of the store. serial: of this unit alone; columns: of
    `COLUMNS`, these; after: number of an event, for judgements behind it; brief: without findings that passed, but the
    first one of each judgement and of each day of measurement. Texts are categories.

    attempt: how often the serial was judged up to then. bench: name of the bench file, if one was used. batch, place:
    the batch in which it was judged and the unit's place in it. measured: the day stated for the check, else NaT.
    held_by: of `HELD_BY`, what holds the whole unit, "" for nothing. voided: why quality assurance declared the
    judgement void, "" if it did not; unit_verdict is "voided" then. conceded: what quality assurance conceded, and why,
    if the unit passes by that. simulated: whether no instrument measured the unit. typed: whether the operator's name
    was only typed. Raises StoreError.
    """
    if serial is None:
        wanted = {"seq", "findings", *columns} - {VOIDED, GOLDEN, CONCEDED}
        wanted |= ({"verdict", "measured"} if brief else set()) | ({"serial"} if GOLDEN in columns else set())
        found = findings(store, wanted)
    else:
        of_unit = FindingsTable()
        of_unit.add(store.events(serial))
        found = of_unit.arrays(TYPES)
    void = {seq: each.words for seq, each in voids(store, serial).items()}
    if GOLDEN in columns:
        codes, words = found["serial"]
        named = goldens(store)
        found[GOLDEN] = np.isin(codes, [i for i, each in enumerate(words or ()) if each in named]), None
    found = {**found, **_of_voids(found, void)}
    if CONCEDED in columns:
        found[CONCEDED] = _words_of_judgements(found["seq"][0], concessions(store, serial))
    return _frame(found, columns, after, brief)


def _frame(found: Mapping[str, Column], columns: Collection[str], after: int, brief: bool) -> pd.DataFrame:
    """Return the rows of the findings; what is stated once for a judgement is repeated."""
    judgement = np.repeat(np.arange(found["seq"][0].size, dtype=np.int32), found["findings"][0])
    chosen: np.ndarray | slice = slice(None)
    if brief:
        chosen = _is_brief(judgement, found["measured"][0], found["verdict"])
    elif after:
        chosen = found["seq"][0][judgement] > after
    judgement = judgement[chosen]
    typed = {
        name: _typed_column(name, found[name][0][chosen if name in OF_A_FINDING else judgement], found[name][1])
        for name in columns
    }
    return pd.DataFrame(typed, copy=False)


def _is_brief(judgement: np.ndarray, days: np.ndarray, verdict: Column) -> np.ndarray:
    """Return which findings did not pass, or are the first of their judgement or of a day in it."""
    codes, words = verdict
    first = np.ones(judgement.size, dtype=bool)
    first[1:] = (judgement[1:] != judgement[:-1]) | (days[1:] != days[:-1])
    passed = (words or []).index("pass") if "pass" in (words or ()) else -1
    return np.asarray(first | (codes != passed))


def _of_voids(found: Mapping[str, Column], void: Mapping[int, str]) -> dict[str, Column]:
    """Return the columns `voided` and, if it is asked for, `unit_verdict` with the judgements that are void."""
    is_void = np.isin(found["seq"][0], list(void))
    made = {VOIDED: _words_of_judgements(found["seq"][0], void)}
    if "unit_verdict" in found and is_void.any():
        values, verdicts = found["unit_verdict"]
        made["unit_verdict"] = np.where(is_void, len(verdicts or ()), values), [*(verdicts or ()), VOIDED]
    return made


def _words_of_judgements(seqs: np.ndarray, said: Mapping[int, str]) -> Column:
    """Return a column of text: the words about some judgements, "" for the others."""
    where, words = np.flatnonzero(np.isin(seqs, list(said))), sorted({"", *said.values()})
    codes = np.zeros(seqs.size, np.int32)  # "" is the first
    codes[where] = [words.index(said[seq]) for seq in seqs[where].tolist()]
    return codes, words


def _typed_column(name: str, values: np.ndarray, words: list[str] | None) -> Any:
    """Return a column as pandas types it: texts as categories in order, times in UTC."""
    if words is not None:
        return pd.Categorical.from_codes(values, dtype=pd.CategoricalDtype(pd.Index(words, dtype=object)))
    if name in TIMES:
        return pd.Series(values.view("M8[us]")).dt.tz_localize("UTC")
    return values.astype(bool) if TYPES.get(name) == TRUTH else values


def instrument_checks(store: Store, name: str) -> pd.DataFrame:
    """Return the comparisons of an instrument with its reference (`accept hw check`) as rows with the columns
    `COLUMNS`: serial is the time of the comparison, bench the instrument with its serial number, |E_n| is 1 at the
    limits. Raises FleetError if the instrument was never compared, StoreError."""
    events = [(event, InstrumentChecked.of(event)) for event in store.events(what=InstrumentChecked.KIND)]
    found = [(event, each) for event, each in events if each.instrument == name]
    if not found:
        names = ", ".join(sorted({each.instrument for _, each in events})) or "none"
        raise FleetError(f"no comparison of an instrument '{name}' with its reference; there are of: {names}")
    rows = [
        {
            **dict.fromkeys(COLUMNS, NOT_STATED),
            "seq": event.seq, "time": event.time, "batch": event.seq, "place": 0, "operator": event.who,
            "bench": f"{name} {each.serial or ''}".strip(), "serial": each.time[:19], "kind": each.what, "attempt": 1,
            "held_by": "", "voided": "", CONCEDED: "", "simulated": False, GOLDEN: False, "typed": each.typed,
            "check": "reference", "quantity": f"{CHECKED}{name}",
            "value": each.value, "unit": each.unit, "U": each.U,
            "lower": each.reference - math.hypot(found[0][1].U, each.U_reference),
            "upper": each.reference + math.hypot(found[0][1].U, each.U_reference),
            "verdict": "pass" if each.passed else "fail", "reason": None, "required": True, "measured": each.time,
        }
        for event, each in found
    ]  # fmt: skip
    frame = pd.DataFrame(rows, columns=COLUMNS).astype(dict.fromkeys(("value", "U", "lower", "upper"), float))
    times = {name: pd.to_datetime(frame[name], utc=True, format="ISO8601").dt.as_unit("us") for name in TIMES}
    return frame.assign(**times)


def when(frame: pd.DataFrame) -> pd.Series:
    """Return when each row was measured: the stated day, else the time of judging."""
    return frame["measured"].fillna(frame["time"])


def in_order_of_measurement(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows by the day of measurement (of judging, if none is stated), then as they stood in their batch.

    The order of storage does not matter, because it depends on which worker finished first."""
    return frame.assign(day=when(frame).dt.floor("D")).sort_values(["day", "batch", "place", "seq"], kind="stable")


def in_order_of_the_store(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows as their judgements were stored; the frame itself if they are in order."""
    return frame if frame["seq"].is_monotonic_increasing else frame.sort_values("seq", kind="stable")


def of_production(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of units of the process: neither simulated nor golden nor part of a gauge study."""
    return frame[~frame["simulated"] & ~frame[GOLDEN] & (frame["study"] == NOT_STATED)]


def counted(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of judgements that describe the process: of production, and not void."""
    return of_production(frame[frame["voided"] == ""])


def first_attempts(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the first attempt at every quantity of every unit: one row for each, of the whole history in frame.

    A quantity that was not measured has not been attempted: after a short spec, only the quantities of that spec count
    as attempted. Void judgements, those of a study, of simulated and of golden units are not attempts."""
    frame = counted(frame)
    attempted = frame[(frame["verdict"] != "no_result") | (frame["reason"] != NOT_MEASURED)]
    return in_order_of_the_store(attempted).drop_duplicates(["serial", "quantity"])


def attempts(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per judgement, with the causes of its verdict."""
    bad = frame[frame["verdict"] != "pass"]
    causes: dict[Any, str] = dict.fromkeys(held(frame), "nonconformance")
    causes |= {seq: ", ".join(dict.fromkeys(names)) for seq, names in bad.groupby("seq")["quantity"]}
    stated = [name for name in COLUMNS_OF_A_JUDGEMENT if name in frame.columns]
    return frame.drop_duplicates("seq")[stated].assign(causes=lambda f: [causes.get(seq, "") for seq in f["seq"]])


def held(frame: pd.DataFrame) -> set[int]:
    """Return the judgements that a nonconformance holds: conditional, though each required finding passes."""
    conditional = frame[frame["unit_verdict"] == "conditional"]
    stopped = conditional.loc[conditional["required"] & (conditional["verdict"] != "pass"), "seq"]
    return set(conditional["seq"]) - set(stopped)


def latest(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the last judgement of every serial."""
    return frame[frame["seq"] == frame.groupby("serial", observed=True)["seq"].transform("max")]


def is_between(frame: pd.DataFrame, since: datetime.date | None, until: datetime.date | None) -> pd.Series:
    """Return which rows are of these days, both included (UTC): of measurement if it is stated, else of judging."""
    keep = pd.Series(True, index=frame.index)
    if since is not None:
        keep &= when(frame) >= pd.Timestamp(since, tz="UTC")
    if until is not None:
        keep &= when(frame) < pd.Timestamp(until, tz="UTC") + pd.Timedelta(days=1)
    return keep


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


def digits(value: float | None, U: float | None) -> tuple[str, str]:
    """Return a value and its U in the digits that U allows, "-" for one that is missing."""
    if value is None or math.isnan(value):
        return "-", "-"
    return (rounded(value, U), rounded_U(U)) if U is not None and U > 0.0 else (rounded(value, None), "-")


def of_quantity(frame: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """Return the rows of a quantity that have a value. Raises FleetError naming what the store holds instead."""
    found = frame[frame["quantity"] == quantity]
    if found.empty:
        held = ", ".join(sorted(frame["quantity"].unique())) or "none"
        raise FleetError(f"no judged unit has a quantity '{quantity}'; the store holds: {held}")
    valid = found[found["value"].notna()]
    if valid.empty:
        raise FleetError(f"'{quantity}' has no value in any of {found['seq'].nunique()} judgements")
    return valid
