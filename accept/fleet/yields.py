"""How many units pass, at the first attempt and in the end, and what stops the others."""

import numpy as np
import pandas as pd

from accept.fleet.measurements import (
    CONCEDED,
    VOIDED,
    counted,
    first_attempts,
    held,
    in_order_of_the_store,
    of_production,
    when,
)
from accept.pictures.labels import label_of
from checks.picture import Band, Line, Panel, Text

PERIODS = {"month": "%Y-%m", "week": "%G-W%V", "day": "%Y-%m-%d"}
COLUMNS = (  # what a yield and its causes are made of
    "seq", "time", "measured", "kind", "study", VOIDED, CONCEDED, "serial", "attempt", "unit_verdict", "check",
    "quantity", "verdict", "reason", "required", "simulated",
)  # fmt: skip
Z_95 = 1.959963984540054  # of the interval of a yield: 95 %, two-sided
MOST_CAUSES = 12  # of a picture: the others are in the table


def yields(frame: pd.DataFrame, by: str, chosen: pd.Series | None = None) -> pd.DataFrame:
    """Return per group: units, passed at the first attempt, passed in the end, those of them that passed by concession,
    share of the first with its interval.

    frame: the whole history. chosen (rows of frame): which of the units are counted: those whose first judgement is
    among them, so a re-test is never a first attempt. A unit counts in the group of its first judgement; it passed at
    its first attempt if the first attempt at each of its quantities did, and no nonconformance held it. Wilson's
    interval holds for few units too.
    """
    first = _first_judgements(frame, chosen)
    if by in PERIODS:
        days = when(first).dt.floor("D")
        first = first.assign(**{by: days.map({day: day.strftime(PERIODS[by]) for day in days.unique()})})
    attempted = first_attempts(frame)
    stopped = set(attempted.loc[attempted["required"] & (attempted["verdict"] != "pass"), "serial"])
    stopped |= set(attempted.loc[attempted["seq"].isin(held(frame)) | (attempted[CONCEDED] != ""), "serial"])
    tried = set(attempted["serial"])
    # Void ones too: a unit whose last judgement is void has not passed in the end.
    judged = in_order_of_the_store(of_production(frame))
    newest = judged.drop_duplicates("serial", keep="last").set_index("serial")
    conceded = newest[CONCEDED] != ""
    last = newest["unit_verdict"].eq("accepted") | conceded
    missing = set(last.index[~last]) - stopped  # incomplete to this day, though nothing that was attempted failed
    passed = [serial in tried and serial not in stopped | missing for serial in first["serial"]]
    units = first.assign(
        first=passed,
        **{
            name: first["serial"].astype(object).map(each).astype(bool)
            for name, each in (("finally_", last), ("conceded", conceded))
        },
    )
    grouped = units.groupby(by, sort=True, observed=True).agg(
        units=("serial", "size"), first=("first", "sum"), last=("finally_", "sum"), conceded=("conceded", "sum")
    )
    lo, hi = wilson(grouped["first"].to_numpy(), grouped["units"].to_numpy())
    share = grouped["first"] / grouped["units"]
    return grouped.assign(first_pass=share, lo=lo, hi=hi).reset_index()


def _first_judgements(frame: pd.DataFrame, chosen: pd.Series | None) -> pd.DataFrame:
    """Return a row of the first judgement of every unit that counts, of the whole history, if it is among the
    chosen rows."""
    first = in_order_of_the_store(counted(frame)).drop_duplicates("serial")
    return first if chosen is None else first[chosen.reindex(first.index, fill_value=False)]


def pareto(frame: pd.DataFrame, chosen: pd.Series | None = None) -> pd.DataFrame:
    """Return what stopped units at the first attempt: check, quantity, verdict, number of units; most frequent first.

    frame, chosen: as in `yields`, so that both count the same units.
    """
    first = _first_judgements(frame, chosen)
    attempted = first_attempts(frame[frame["serial"].isin(first["serial"])])
    bad = attempted[attempted["verdict"] != "pass"]
    of_unit = attempted[attempted["seq"].isin(held(frame) - set(bad["seq"]))].drop_duplicates("serial")
    whole = {"check": "unit", "quantity": "nonconformance", "verdict": "held"}
    bad = pd.concat([bad, of_unit.assign(**whole)]).astype(dict.fromkeys(whole, object))
    counted = (
        bad.groupby(["check", "quantity", "verdict"], observed=True)["serial"].nunique().rename("units").reset_index()
    )
    ordered = counted.sort_values(["units", "check", "quantity"], ascending=[False, True, True], ignore_index=True)
    return ordered.assign(share=ordered["units"] / max(1, len(first)))


def wilson(hits: np.ndarray, of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the interval of a share by Wilson's score ([Wilson])."""
    z = Z_95
    n = np.maximum(of, 1).astype(float)
    p = hits / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return np.clip(middle - half, 0, 1), np.clip(middle + half, 0, 1)


def panels(made: pd.DataFrame, causes: pd.DataFrame, by: str) -> list[Panel]:
    """Return two pictures: the yield of every group with its interval, and what stopped the others in order.

    made : as `yields` gives it. causes : as `pareto`."""
    share, lo, hi = (100.0 * made[name].to_numpy(dtype=float) for name in ("first_pass", "lo", "hi"))
    words = [f"{row[by]}: {row['first']} of {row['units']}" for row in made.to_dict("records")]
    bars = _bars(share, words, "good")
    ends = [
        Line(np.array(pair), np.full(2, len(share) - 1.0 - i), role="data")
        for i, pair in enumerate(zip(lo, hi, strict=True))
    ]
    across = "passed at their first attempt [%], with the 95 % interval"
    shown = [_panel("first-pass yield", across, [*bars, *ends], len(share), 100.0)]
    if len(causes):
        worst = causes.head(MOST_CAUSES)
        counted = worst["units"].to_numpy(dtype=float)
        named = [
            f"{label_of(row['quantity'])}: {row['verdict'].replace('_', ' ')}, {row['units']}"
            for row in worst.to_dict("records")
        ]
        title = "what stopped units at their first attempt"
        shown.append(_panel(title, "units", _bars(counted, named, "bad"), len(counted), 1.05 * float(counted.max())))
    return shown


def _bars(values: np.ndarray, words: list[str], role: str) -> list[Band | Line | Text]:
    """Return a bar each, the first one above, with its words on it."""
    items: list[Band | Line | Text] = []
    for i, (value, label) in enumerate(zip(values, words, strict=True)):
        row = len(values) - 1.0 - i
        items.append(Band(np.array([0.0, value]), np.full(2, row - 0.35), np.full(2, row + 0.35), role=role))
        items.append(Text(0.0, row - 0.15, label, "limit"))
    return items


def _panel(title: str, across: str, items: list[Band | Line | Text], rows: int, most: float) -> Panel:
    return Panel(title, across, "", tuple(items), x_range=(0.0, most), y_range=(-0.6, rows - 0.4), y_names=("",) * rows)
