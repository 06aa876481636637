"""One quantity over time: control charts of every group, alarms in words, capability against its limits."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from accept.fleet.errors import FleetError
from accept.fleet.measurements import of_quantity
from accept.pictures.labels import label_of
from checks.picture import Line, Mark, Panel
from checks.process_control.capability import Capability, capability
from checks.process_control.control_chart import LEAST, ROUTINE, RULES, Chart, chart


@dataclass(frozen=True, eq=False)
class Trend:
    """One group. rows: of the first attempts, in order; chart, capability: None where there are too few values or the
    limits differ, and `why` then."""

    name: str
    quantity: str
    unit: str
    rows: pd.DataFrame
    chart: Chart | None
    capability: Capability | None
    why: tuple[str, ...]


def trends(frame: pd.DataFrame, quantity: str, by: str) -> list[Trend]:
    """Trends of a quantity, a group each. First attempts only: what was repaired says nothing of the process.

    Raises FleetError where the store holds no value of it or a group of units mixes units of measure."""
    known = of_quantity(frame, quantity)
    first = known[known["attempt"] == 1].sort_values("seq")
    if first.empty:
        raise FleetError(f"'{quantity}' has no value at any first attempt")
    groups = [("all", first)] if by == "all" else [(str(name), rows) for name, rows in first.groupby(by)]
    return [_trend(name, quantity, rows) for name, rows in groups]


def _trend(name: str, quantity: str, rows: pd.DataFrame) -> Trend:
    units = rows["unit"].unique()
    if len(units) > 1:
        raise FleetError(f"{quantity}: values in {' and '.join(map(str, units))}; choose one kind or spec")
    values, why = rows["value"].to_numpy(), []
    made: Chart | None = None
    if values.size >= LEAST:
        made = chart(values)
    else:
        why.append(f"{values.size} values: a control chart needs {LEAST}")
    limits = rows[["lower", "upper"]].drop_duplicates()
    cap: Capability | None = None
    if len(limits) > 1:
        why.append("the limits changed: no capability over both")
    else:
        lower, upper = (None if np.isnan(v) else float(v) for v in limits.iloc[0])
        try:
            cap = capability(values, lower, upper)
        except ValueError as e:
            why.append(f"no capability: {e}")
    return Trend(name, quantity, str(units[0]), rows, made, cap, tuple(why))


def alarms(trend: Trend) -> Iterator[tuple[str, str]]:
    """(serial, words) of every alarm, in the order of the units: Nelson's routine rules, and the weighted mean where it
    leaves its limits."""
    if trend.chart is None:
        return
    serials = trend.rows["serial"].to_numpy()
    routine = {rule: at for rule, at in trend.chart.alarms.items() if rule in ROUTINE}
    found = [(int(i), f"rule {rule}: {RULES[rule]}") for rule, at in routine.items() for i in at]
    inside = np.zeros(serials.size + 1, dtype=bool)
    inside[1:] = np.isin(np.arange(serials.size), trend.chart.ewma_alarms)
    entered = np.flatnonzero(inside[1:] & ~inside[:-1])
    found += [(int(i), "the weighted mean (EWMA) leaves its limits") for i in entered]
    for i, words in sorted(found):
        yield str(serials[i]), words


def alarmed(trend: Trend) -> Iterator[tuple[str, str]]:
    """(which units, words): as `alarms`, a rule that rings at unit after unit told once for all of them."""
    place = {str(serial): i for i, serial in enumerate(trend.rows["serial"])}
    runs: dict[str, list[list[str]]] = {}
    for serial, words in alarms(trend):
        known = runs.setdefault(words, [])
        if known and place[known[-1][-1]] == place[serial] - 1:
            known[-1].append(serial)
        else:
            known.append([serial])
    told = [(place[run[0]], _which(run), words) for words, found in runs.items() for run in found]
    yield from ((which, words) for _, which, words in sorted(told))


def _which(serials: list[str]) -> str:
    return serials[0] if len(serials) == 1 else f"{serials[0]} to {serials[-1]} ({len(serials)} units)"


def hints(trend: Trend) -> dict[str, int]:
    """How often the rules rang that are no alarm by themselves."""
    if trend.chart is None:
        return {}
    return {f"rule {r}: {RULES[r]}": at.size for r, at in trend.chart.alarms.items() if r not in ROUTINE}


def panel(trend: Trend) -> Panel:
    """The chart: values in order, weighted mean, mean and limits."""
    x = np.arange(1.0, len(trend.rows) + 1)
    values = trend.rows["value"].to_numpy()
    items: list[Line | Mark] = [Line(x, values, "value", "points", "data")]
    if trend.chart is not None:
        items += [
            Line(x, trend.chart.ewma, "weighted mean", role="model"),
            Mark(trend.chart.mean, "y", "mean", "quiet"),
            Mark(trend.chart.lower, "y", "mean - 3 sigma", "bad"),
            Mark(trend.chart.upper, "y", "mean + 3 sigma", "bad"),
        ]
    for bound in ("lower", "upper"):
        limit = trend.rows[bound].to_numpy()
        if np.isfinite(limit).all() and np.ptp(limit) == 0.0:
            items.append(Mark(float(limit[0]), "y", f"{bound} limit", "limit"))
    label = label_of(trend.quantity)
    title = label if trend.name == "all" else f"{label}, {trend.name}"
    return Panel(title, "unit, in order of judging", f"{label} [{trend.unit}]", tuple(items))
