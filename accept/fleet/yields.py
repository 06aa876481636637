"""How many units pass, at the first attempt and in the end, and what stops the others."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd

from accept.fleet.findings_file import HELD_BY
from accept.fleet.measurements import (
    CONCEDED,
    GOLDEN,
    VOIDED,
    counted,
    first_attempts,
    held,
    in_order_of_the_store,
    latest,
    of_production,
    when,
)
from accept.pictures.labels import label_of
from checks.picture import Band, Line, Panel, Text

PERIODS = {"month": "%Y-%m", "week": "%G-W%V", "day": "%Y-%m-%d"}
COLUMNS = (  # what a yield and its causes are made of
    "seq", "time", "measured", "kind", "study", "held_by", VOIDED, CONCEDED, "serial", "attempt", "unit_verdict",
    "check", "quantity", "verdict", "reason", "required", "simulated", GOLDEN,
)  # fmt: skip
Z_95 = 1.959963984540054  # of the interval of a yield: 95 %, two-sided
WORST_FIRST = ("fail", "no_result", "conditional", VOIDED)
VOID = "void judgement"
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
    in_the_end, by_concession = (first["serial"].astype(object).map(each).astype(bool) for each in (last, conceded))
    units = first.assign(first=passed, finally_=in_the_end, conceded=by_concession)
    grouped = units.groupby(by, sort=True, observed=True).agg(
        units=("serial", "size"), first=("first", "sum"), last=("finally_", "sum"), conceded=("conceded", "sum")
    )
    lo, hi = wilson(grouped["first"].to_numpy(), grouped["units"].to_numpy())
    share = grouped["first"] / grouped["units"]
    return grouped.assign(first_pass=share, lo=lo, hi=hi).reset_index()


def _first_judgements(frame: pd.DataFrame, chosen: pd.Series | None) -> pd.DataFrame:
    """Return a row of every unit's first judgement that counts, of the whole history, if it is among the chosen."""
    first = in_order_of_the_store(counted(frame)).drop_duplicates("serial")
    return first if chosen is None else first[chosen.reindex(first.index, fill_value=False)]


def stops(frame: pd.DataFrame, chosen: pd.Series | None = None) -> pd.DataFrame:
    """Return a row for each unit that did not pass at its first attempt: serial; quantity, the one that stopped it, or
    in its place what holds the whole unit; verdict; also, the others that would have stopped it, in words.

    frame, chosen: as in `yields`, so that both count the same units. Of several findings the worst counts, then the
    first.
    """
    made = yields(frame, "serial", chosen)
    stopped = frame[frame["serial"].isin(made.loc[made["first"] == 0, "serial"])]
    bad = _not_passed(first_attempts(stopped))
    last = latest(of_production(stopped[~stopped["serial"].isin(bad["serial"])]))  # not measured to this day, or void
    void = last[last[VOIDED] != ""].drop_duplicates("serial").assign(held_by=VOID, verdict=VOIDED)
    rows = pd.concat([bad, _not_passed(last[last[VOIDED] == ""]), void], ignore_index=True)
    held = rows["held_by"].astype(object)
    order = np.where(held != "", -1, rows["verdict"].map({v: i for i, v in enumerate(WORST_FIRST)}).astype(float))
    name = held.where(held != "", rows["quantity"].astype(object))
    ordered = rows.assign(name=name, order=order).sort_values("order", kind="stable")
    found = []
    for serial, of in ordered.groupby("serial", sort=False, observed=True):
        verdict = "held" if of["held_by"].iloc[0] == HELD_BY[0] else str(of["verdict"].iloc[0])
        found.append((serial, of["name"].iloc[0], verdict, _also(of)))
    return pd.DataFrame(found, columns=["serial", "quantity", "verdict", "also"])


def cause_label(cause: str) -> str:
    """Return the label of a quantity, and what holds a whole unit as it is called."""
    return cause.capitalize() if cause in (*HELD_BY, VOID) else label_of(cause)


def _not_passed(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the required rows that did not pass, and all of a unit that a nonconformance holds: its findings may."""
    return rows[rows["required"] & ((rows["verdict"] != "pass") | (rows["held_by"] == HELD_BY[0]))]


def _also(of_unit: pd.DataFrame) -> list[str]:
    """Return the findings of a unit beside the one that stopped it; of a unit that is held, those that failed."""
    held = of_unit["held_by"].iloc[0] != ""
    rows = of_unit[of_unit["verdict"] == "fail"] if held else of_unit.iloc[1:]
    pairs = zip(rows["quantity"], rows["verdict"], strict=True)
    return [f"{label_of(quantity)} {verdict.replace('_', ' ')}" for quantity, verdict in pairs]


def pareto(frame: pd.DataFrame, chosen: pd.Series | None = None) -> pd.DataFrame:
    """Return what stopped units at the first attempt, each unit once, as `stops` has it: quantity, verdict, number of
    units, share, what else those units have; most frequent first."""
    each = stops(frame, chosen)
    table = each.groupby(["quantity", "verdict"])["also"].agg([len, _counted_words]).reset_index()
    table.columns = pd.Index(["quantity", "verdict", "units", "also"])
    table.insert(3, "share", table["units"] / max(1, len(_first_judgements(frame, chosen))))
    return table.sort_values(["units", "quantity", "verdict"], ascending=[False, True, True], ignore_index=True)


def _counted_words(of_units: pd.Series) -> str:
    counts = Counter(word for words in of_units for word in words)
    return ", ".join(f"{word} {count}" for word, count in counts.most_common())


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
    shares = bars(share, words, "good")
    pairs = enumerate(zip(lo, hi, strict=True))
    ends = [Line(np.array(pair), np.full(2, len(share) - 1.0 - i), role="data") for i, pair in pairs]
    across = "passed at their first attempt [%], with the 95 % interval"
    shown = [row_panel("first-pass yield", across, [*shares, *ends], len(share), 100.0)]
    if len(causes):
        worst = causes.head(MOST_CAUSES)
        counted = worst["units"].to_numpy(dtype=float)
        named = [
            f"{cause_label(row['quantity'])}: {row['verdict'].replace('_', ' ')}, {row['units']}"
            for row in worst.to_dict("records")
        ]
        title = "what stopped units at their first attempt"
        shown.append(row_panel(title, "units", bars(counted, named, "bad"), len(counted), 1.05 * float(counted.max())))
    return shown


def bars(values: np.ndarray, words: list[str], role: str) -> list[Band | Line | Text]:
    """Return a bar each, the first one above, with its words on it."""
    items: list[Band | Line | Text] = []
    for i, (value, label) in enumerate(zip(values, words, strict=True)):
        row = len(values) - 1.0 - i
        items.append(Band(np.array([0.0, value]), np.full(2, row - 0.35), np.full(2, row + 0.35), role=role))
        items.append(Text(0.0, row - 0.15, label, "limit"))
    return items


def row_panel(title: str, across: str, items: Sequence[Band | Line | Text], rows: int, most: float | None) -> Panel:
    """Return a panel of rows whose names stand in it. most: end of its axis from zero; None: as the items reach."""
    x_range = None if most is None else (0.0, most)
    return Panel(title, across, "", tuple(items), x_range=x_range, y_range=(-0.6, rows - 0.4), y_names=("",) * rows)
