"""A control chart for each quantity of each golden unit, and the units that were judged while one was off.

A golden unit is compared with its reference within two stated uncertainties, which include what is common to both. Its
own comparisons repeat far better: a chart of them finds a drift of the bench long before those limits do.
"""

import datetime
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from accept.fleet.golden import Golden, goldens
from accept.fleet.measurements import VOIDED, counted, in_order_of_measurement, measurements, when
from accept.fleet.process_control.control_chart import FALSE_ALARM, SHIFT, Alarm, Chart
from accept.fleet.process_control.self_starting import BEFORE, FEWEST, findable_change, part_chart
from accept.fleet.rings import GOLDEN, ringing, shared_chance
from accept.fleet.trend import limits_of_one_value, sums_panel
from accept.pictures.labels import label_of
from accept.store import Store
from accept.store.payloads import GoldenNamed, Reference
from checks.picture import Line, Mark, Panel
from checks.rounding import with_U

OF_A_DOUBT = ["serial", "day", "operator", "bench", "quantity", "value", "verdict", "why"]


@dataclass(frozen=True)
class Doubt:
    """Days in which a bench is in doubt: from the last day on which the golden unit was good, which may have been good
    in the morning only, to the day before it was good again; until: None if it was not good since."""

    golden: str
    bench: str
    quantity: str
    since: pd.Timestamp
    until: pd.Timestamp | None

    def is_between(self, since: datetime.date | None, until: datetime.date | None) -> bool:
        """Return whether some of these days are in doubt."""
        begun = until is None or self.since.date() <= until
        return begun and (since is None or self.until is None or self.until.date() > since)

    @property
    def days(self) -> str:
        return f"{self.since:%Y-%m-%d}" + ("" if self.until is None else f", good again on {self.until:%Y-%m-%d}")

    @property
    def words(self) -> str:
        return (
            f"judged since the last good day of the golden unit {self.golden} ({label_of(self.quantity)}, {self.days})"
        )


@dataclass(frozen=True, eq=False)
class GoldenTrend:
    """One quantity of a golden unit at one bench. rows: its judgements in the order of measurement."""

    serial: str
    bench: str
    quantity: str
    unit: str
    rows: pd.DataFrame
    chart: Chart
    reference: Reference | None

    @property
    def good(self) -> NDArray[np.bool_]:
        """Return which comparisons no alarm is about."""
        good = np.ones(len(self.rows), dtype=bool)
        for alarm in self.chart.alarms:
            good[alarm.first : alarm.last + 1] = False
        return good

    @property
    def doubts(self) -> list[Doubt]:
        return [self._doubt(alarm) for alarm in self.chart.alarms]

    def _doubt(self, alarm: Alarm) -> Doubt:
        days, good = self.rows["day"], self.good
        before, after = np.flatnonzero(good[: alarm.first]), np.flatnonzero(good[alarm.last + 1 :])
        until = days.iloc[alarm.last + 1 + after[0]] if after.size else None
        return Doubt(self.serial, self.bench, self.quantity, days.iloc[before[-1]], until)

    @property
    def reach(self) -> str:
        """Return what the chart can find, in words."""
        n, sigma = len(self.rows), self.chart.baseline.sigma
        if sigma == 0.0 or (found := findable_change(n)) is None:
            return (
                f"{self.serial}: {n} comparisons find no change: {FEWEST} are needed, taken each shift if that can be"
            )
        step, drift = (
            f"{size * sigma:.2g} {self.unit} ({100 * size * sigma / abs(self.chart.baseline.mean):.2g} %)"
            for size in found
        )
        return (
            f"{self.serial}: with {n} comparisons that repeat within {sigma:.2g} {self.unit} (1 sd) a shift of the "
            f"later half below {step}, or a drift over it below {drift}, is found in fewer than nine of ten charts"
        )

    def words(self, alarm: Alarm) -> str:
        """Return an alarm in words: since when, direction, size, and the last good day."""
        first, last = (self.rows["day"].iloc[i] for i in (alarm.first, alarm.last))
        size = f"{'+' if alarm.size > 0 else ''}{with_U(alarm.size, alarm.U)} {self.unit}"
        on = f"{first:%Y-%m-%d}" if alarm.rule != SHIFT else f"{first:%Y-%m-%d} to {last:%Y-%m-%d}"
        return (
            f"{self.serial}, {label_of(self.quantity)}: {on} ({alarm.units} comparisons): {size} from the mean of the "
            f"good ones; last good day {self._doubt(alarm).days}"
        )


def golden_trends(store: Store, serial: str | None = None, quantity: str | None = None) -> list[GoldenTrend]:
    """Return the charts of the golden units of a store, of one of them or of one quantity. All quantities of a golden
    unit at a bench share the chance of a false alarm, all charts that of a ring. Raises StoreError."""
    parts = [part for golden in goldens(store).values() for part in _parts(store, golden)]
    shared = shared_chance(GOLDEN, len(parts))
    return [_chart(*part, shared) for part in parts if serial in (None, part[0].serial) and quantity in (None, part[2])]


def _parts(store: Store, golden: Golden) -> list[tuple[Golden, str, str, pd.DataFrame, int]]:
    """Return bench, quantity and rows of each chart of a golden unit, and how many it has at that bench."""
    frame = in_order_of_measurement(measurements(store, golden.serial))
    frame = frame[frame["value"].notna() & (frame[VOIDED] == "") & ~frame["simulated"]]
    if any(event.seq < golden.named.seq for event in store.events(golden.serial, GoldenNamed.KIND)):
        # Named again, retired meanwhile or not: the judgements of its reference are the first that count.
        n = max((reference.n for reference in golden.reference.values()), default=1)
        before = sorted(frame.loc[frame["seq"] < golden.named.seq, "seq"].unique())
        frame = frame[~frame["seq"].isin(before[:-n])]
    found = []
    for bench, of_bench in frame.groupby("bench", observed=True):
        parts = list(of_bench.groupby("quantity", observed=True, sort=False))
        found += [(golden, str(bench), str(name), rows, len(parts)) for name, rows in parts]
    return found


def _chart(golden: Golden, bench: str, name: str, rows: pd.DataFrame, beside: int, shared: float) -> GoldenTrend:
    values, own = rows["value"].to_numpy(), FALSE_ALARM / beside
    made = part_chart(values, own)
    strict = part_chart(values, min(shared, own)).alarms if made.alarms else ()
    made = replace(made, alarms=ringing(made.alarms, [strict]))
    unit, reference = str(rows["unit"].iloc[0]), golden.reference.get(name)
    return GoldenTrend(golden.serial, bench, name, unit, rows, made, reference)


def in_doubt(frame: pd.DataFrame, charts: Sequence[GoldenTrend]) -> pd.Series:
    """Return for each row of findings why its bench was in doubt when it was measured, "" if it was not."""
    words = pd.Series("", index=frame.index, dtype=object)
    days = when(frame).dt.floor("D")
    for doubt in (doubt for chart in charts for doubt in chart.doubts):
        within = (days >= doubt.since) & ((days < doubt.until) | (days == doubt.since) if doubt.until else True)
        words[within & (frame["bench"] == doubt.bench) & (frame["quantity"] == doubt.quantity)] = doubt.words
    return words


def judged_in_doubt(frame: pd.DataFrame, charts: Sequence[GoldenTrend]) -> pd.DataFrame:
    """Return the first row of every unit of the process that was judged while a bench was in doubt, as `OF_A_DOUBT`."""
    marked = in_order_of_measurement(counted(frame)).assign(why=lambda f: in_doubt(f, charts))
    found = marked[(marked["why"] != "") & marked["value"].notna()]
    return found.drop_duplicates(["serial", "quantity"])[OF_A_DOUBT]


def document(each: GoldenTrend) -> dict[str, Any]:
    """Return a chart as a document: counts, mean and repeatability of the good ones, limits, alarms, points."""
    chart, base, reference = each.chart, each.chart.baseline, each.reference
    days = [f"{day:%Y-%m-%d}" for day in each.rows["day"]]
    return {
        "golden": each.serial,
        "bench": each.bench,
        "quantity": each.quantity,
        "unit": each.unit,
        "n": len(each.rows),
        "mean": base.mean,
        "repeatability": base.sigma or None,
        "reference": reference and reference.value,
        "limits": {"lower": chart.lower, "upper": chart.upper} if base.sigma else None,
        "sums_limit": chart.sums_limit,
        "alarms": [
            {**alarm.document(days), "last_good": f"{doubt.since:%Y-%m-%d}",
             "good_again": doubt.until and f"{doubt.until:%Y-%m-%d}", "words": each.words(alarm)}
            for alarm, doubt in zip(chart.alarms, each.doubts, strict=True)
        ],
        "findable": each.reach,
        "cautions": [] if len(each.rows) > BEFORE else [f"{len(each.rows)} comparisons: the chart compares from the "
                                                        f"{BEFORE + 1}th on"],
        "points": [{"time": day, "value": value, "good": bool(good)}
                   for day, value, good in zip(days, chart.values.tolist(), each.good, strict=True)],
    }  # fmt: skip


def golden_panels(each: GoldenTrend) -> list[Panel]:
    """Return the chart: comparisons in order with their own limits and the reference, and the cumulative sums."""
    chart, x = each.chart, np.arange(1.0, len(each.rows) + 1)
    label, off = label_of(each.quantity), ~each.good
    items: list[Line | Mark] = [
        Line(x, chart.values, "comparison", "points", "data"),
        Line(x[off], chart.values[off], "not as before", "points", "bad"),
        Mark(chart.baseline.mean, "y", "mean of the good ones", "quiet"),
    ]
    if chart.baseline.sigma > 0.0:
        items += limits_of_one_value(chart)
    if each.reference is not None:
        items.append(Mark(each.reference.value, "y", "reference", "limit"))
    days = each.rows["day"]
    order = f"comparison, {days.iloc[0]:%Y-%m-%d} to {days.iloc[-1]:%Y-%m-%d}"
    title = f"{each.serial}, {label}"
    return [
        Panel(title, order, f"{label} [{each.unit}]", tuple(items)),
        *sums_panel(chart, x, title, order, "the mean"),
    ]
