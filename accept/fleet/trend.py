"""One quantity over time: control charts of every group against a baseline, alarms in words, capability."""

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from accept.fleet.errors import FleetError, statistics
from accept.fleet.findings_file import NOT_STATED
from accept.fleet.measurements import counted, first_attempts, in_order_of_measurement, of_quantity
from accept.fleet.process_control.capability import Capability, Index, capability
from accept.fleet.process_control.control_chart import (
    DRIFT,
    EQUAL,
    FALSE_ALARM,
    LEAST,
    NELSON,
    SHIFT,
    VALUE,
    Alarm,
    Baseline,
    Chart,
    estimate_baseline,
    false_alarm_rate,
)
from accept.fleet.process_control.equal_runs import EqualRun, Place
from accept.fleet.process_control.places import chart_by_place, same_places
from accept.fleet.process_control.scale import as_measured, from_scale, scale_of, scales_of, to_scale
from accept.fleet.reading_alarms import (
    METERS,
    PLACES,
    coarse_meters,
    equal_values,
    labels_of,
    mixture,
    offset,
    unlike_values,
)
from accept.fleet.rings import (
    OF_CHART,
    OF_EQUAL,
    OF_OFFSET,
    count_of_quantities,
    findable_shift,
    ringing,
    shared_chance,
)
from accept.pictures.labels import label_of
from accept.store import Store
from accept.store.decisions import Signer, problem_here, sign_decision
from accept.store.payloads import BaselineSet
from checks.arrays import Array
from checks.picture import Line, Mark, Panel
from checks.rounding import with_U

WORDS_OF_PLACES = {"bench": "at", "operator": "by", "instrument": "with"}
DOUBT = "doubt"  # column, if there is one: why the bench was in doubt, as `golden_chart.in_doubt` says


@dataclass(frozen=True)
class StoredBaseline:
    """A baseline of the store, by whom and when it was set. problem: why quality assurance did not sign it, or None."""

    stated: BaselineSet
    who: str
    time: str
    problem: str | None

    @property
    def process(self) -> Baseline:
        return Baseline(self.stated.mean, self.stated.sigma, self.stated.n, self.stated.left_out)


@dataclass(frozen=True, eq=False)
class Trend:
    """One group. rows: first attempts in the order of measurement; compared (K,): indices of those that the chart
    compares, all but equal values in a row; chart, capability: None if there are too few values or the limits differ,
    and `why` then; alarms: of the chart and of equal values, by the indices of rows; stages: if the limits changed, a
    document for each revision; baseline: the stored one, if there is one; scale: on which the values are compared
    (`accept.fleet.process_control.scale`); findable: a shift of half of the values that nine of ten such charts find,
    and one that rings, None for too few values."""

    name: str
    quantity: str
    unit: str
    rows: pd.DataFrame
    compared: NDArray[np.intp]
    chart: Chart | None
    alarms: tuple[Alarm, ...]
    capability: Capability | None
    stages: tuple[dict[str, Any], ...]
    baseline: StoredBaseline | None
    false_alarms: float
    findable: tuple[float | None, float | None]
    scale: str
    why: tuple[str, ...]


def trends(
    frame: pd.DataFrame,
    quantity: str,
    by: str,
    baselines: Mapping[str, StoredBaseline] | None = None,
    nelson_rules: Collection[int] = (),
    chosen: pd.Series | None = None,
    unlike: Mapping[str, Mapping[str, Alarm]] | None = None,
) -> list[Trend]:
    """Return the trends of a quantity by group. Only first attempts count: a repair does not describe the process.

    frame: the whole history; chosen (rows of frame): the rows to show. baselines: group -> its baseline. unlike: by
    `unlike_values` of the chosen rows, if that is known: it is the same for every quantity. Raises FleetError if the
    store holds no value or a group mixes units of measure."""
    first = first_attempts(of_quantity(frame, quantity))
    if chosen is not None:  # a repair is told by the whole history
        first = first[chosen.reindex(first.index, fill_value=False)]
        frame = frame[chosen.reindex(frame.index, fill_value=False)]
    if first.empty:
        raise FleetError(f"'{quantity}' has no value at any first attempt")
    ordered = in_order_of_measurement(first)
    if unlike is None:
        unlike = unlike_values(frame)
    of_units = unlike.get(quantity, {})
    parts = [("all", ordered)] if by == "all" else ordered.groupby(by, observed=True)
    groups, known = [(str(name), rows) for name, rows in parts], baselines or {}
    rules = tuple(sorted(nelson_rules))
    shared = shared_chance(by, len(groups) * count_of_quantities(counted(frame)))
    return [_trend(name, quantity, rows, known.get(name), rules, of_units, shared) for name, rows in groups]


def _trend(
    name: str,
    quantity: str,
    rows: pd.DataFrame,
    baseline: StoredBaseline | None,
    nelson_rules: tuple[int, ...],
    unlike: Mapping[str, Alarm],
    shared: float,
) -> Trend:
    units = rows["unit"].unique()
    if len(units) > 1:
        raise FleetError(f"{quantity}: values in {' and '.join(map(str, units))}; choose one kind or spec")
    runs, before = equal_values(rows, OF_EQUAL * shared), rows[:0]
    equal = np.isin(np.arange(len(rows)), [i for run in runs for i in run.at])
    if baseline is not None:
        since, until = (pd.Timestamp(day, tz="UTC") for day in (baseline.stated.since, baseline.stated.until))
        before = rows[(rows["day"] >= since) & (rows["day"] <= until) & ~equal]
        gone = int((rows["day"] <= until).sum())  # the rows are in the order of their days
        rows, equal = rows[gone:], equal[gone:]
        runs = [replace(run, at=run.at[run.at >= gone] - gone) for run in runs if run.at[-1] >= gone]
    compared = np.flatnonzero(~equal)
    values, unit = rows["value"].to_numpy()[compared], str(units[0])
    everywhere, found, why = labels_of(rows), list[Alarm](), list[str]()
    control, cap, rate = None, None, 0.0
    findable: tuple[float | None, float | None] = None, None
    scale = baseline.stated.scale if baseline is not None else scale_of(values)
    if equal.any():
        why.append(f"{equal.sum()} equal values are not used for the limits")
    if values.size >= LEAST or (baseline is not None and values.size):
        labels = {column: of[compared] for column, of in everywhere.items()}
        process, of_places = baseline.process if baseline else None, _baselines_of_places(before, scale)
        made = _chart(values, scale, labels, process, nelson_rules, of_places, OF_CHART * shared)
        findable = _findable(made.baseline, values.size, process is not None, scale, shared)
        control = as_measured(made, values, scale)
        rate = false_alarm_rate(values.size, process.n if process else None, nelson_rules)
        why += coarse_meters(values, labels, unit)
        mixed = mixture(values, control.level, scale, labels, unit, OF_CHART * shared)
        if mixed is not None and mixed.by in METERS:  # two meters that differ are two charts
            why.append(mixed.alarm.evidence)
        elif mixed is not None:
            found.append(replace(mixed.alarm, first=int(compared[0]), last=int(compared[-1])))
        part = np.zeros(values.size, dtype=np.intp) if mixed is None else mixed.part
        if off := offset(rows.iloc[compared], control.level, scale, part, labels, OF_OFFSET * shared):
            found.append(replace(off, first=int(compared[off.first]), last=int(compared[off.last])))
    elif baseline is not None:
        why.append(f"no unit since the baseline ended on {baseline.stated.until}")
    else:
        why.append(f"{values.size} values: a control chart needs {LEAST}")
    found += _alarms(control, compared, runs, rows["value"].to_numpy())
    found = _with_unlike(found, rows["serial"].astype(object).tolist(), unlike)
    placed = (replace(alarm, same=same_places(alarm.place, everywhere)) for alarm in found)
    alarms = tuple(sorted(placed, key=lambda a: (a.first, a.rule)))
    revisions = [part for _, part in rows.groupby(["lower", "upper"], sort=False, dropna=False)]
    stages = tuple(map(_stage, revisions)) if len(revisions) > 1 and not equal.any() else ()
    if equal.any():
        why.append(f"no capability: {equal.sum()} of {equal.size} values are runs of equal ones, not a spread")
    elif stages:
        why.append("the limits changed: no capability over both")
    elif revisions:
        try:
            cap = capability(values, **_limits(rows))
        except ValueError as e:
            why.append(f"no capability: {e}")
    if cap is not None:
        why += _cautions(cap, alarms)
    chances, said = (rate, findable), tuple(why)
    return Trend(name, quantity, unit, rows, compared, control, alarms, cap, stages, baseline, *chances, scale, said)


def _chart(
    values: NDArray[np.float64],
    scale: str,
    labels: Mapping[str, NDArray[np.object_]],
    process: Baseline | None,
    nelson_rules: tuple[int, ...],
    of_places: Mapping[Place, Baseline],
    rare: float,
) -> Chart:
    """Return the chart of values on a scale. An alarm rings if charts with the chance `rare` show it too, on every
    scale that the values do not contradict."""
    made = chart_by_place(to_scale(values, scale), labels, process, nelson_rules, of_places)
    strict = (
        chart_by_place(to_scale(values, each), labels, process, (), of_places, rare).alarms
        for each in ((scale,) if process else scales_of(values))
    )
    return replace(made, alarms=ringing(made.alarms, [*strict])) if made.alarms else made


def _findable(base: Baseline, n: int, frozen: bool, scale: str, shared: float) -> tuple[float | None, float | None]:
    """Return the shifts that a chart of n values finds and that ring, as measured."""
    at = float(from_scale(np.array(base.mean), scale))
    sizes = (findable_shift(base, n, frozen, chance) for chance in (FALSE_ALARM, OF_CHART * shared))
    own, ring = (size and float(from_scale(np.array(base.mean + size), scale)) - at for size in sizes)
    return own, ring


def _with_unlike(found: Sequence[Alarm], serials: Sequence[str], unlike: Mapping[str, Alarm]) -> list[Alarm]:
    """Return alarms with those of values that are unlike the others of their unit; a value that is gross as well has
    one alarm."""
    at = {i: unlike[serial] for i, serial in enumerate(serials) if serial in unlike}
    gross = {a.first for a in found if a.rule == VALUE}
    said = [
        replace(a, evidence=at[a.first].evidence, rings=True) if a.rule == VALUE and a.first in at else a for a in found
    ]
    return said + [replace(alarm, first=i, last=i) for i, alarm in at.items() if i not in gross]


def _limits(rows: pd.DataFrame) -> dict[str, float | None]:
    return {name: None if np.isnan(rows[name].iloc[0]) else float(rows[name].iloc[0]) for name in ("lower", "upper")}


def _stage(rows: pd.DataFrame) -> dict[str, Any]:
    """Return the units that one revision of the limits judged as a document: from their first to their last day, by
    which specs, with which limits; capability: null for too few, or without limits."""
    since, until = (f"{rows['day'].iloc[i]:%Y-%m-%d}" for i in (0, -1))
    limits, indices = _limits(rows), None
    with suppress(ValueError):
        indices = _indices(capability(rows["value"].to_numpy(), **limits))
    spec = ", ".join(sorted(set(rows["spec"])))
    return {"since": since, "until": until, "spec": spec, "n": len(rows), **limits, "capability": indices}


def _alarms(made: Chart | None, compared: NDArray[np.intp], runs: Sequence[EqualRun], values: Array) -> list[Alarm]:
    """Return the alarms of a chart and of runs of equal values, by the indices of all values (N,)."""
    found = [
        replace(a, first=int(compared[a.first]), last=int(compared[a.last]), units=a.units or a.last - a.first + 1)
        for a in (made.alarms if made else ())
    ]
    for run in runs:
        size = float(values[run.at[0]] - (made.baseline.mean if made else values.mean()))
        ends = int(run.at[0]), int(run.at[-1])
        found.append(Alarm(EQUAL, *ends, size, 0.0, run.at.size, run.place, run.usual, rings=run.rings))
    return found


def _baselines_of_places(before: pd.DataFrame, scale: str) -> dict[Place, Baseline]:
    """Return the baseline of every place that has values enough in the days of the baseline of all."""
    if before.empty:
        return {}
    parts = (
        (c, str(name), part) for c in PLACES for name, part in before.groupby(c, observed=True) if len(part) >= LEAST
    )
    made = ((c, name, estimate_baseline(to_scale(part["value"].to_numpy(), scale))) for c, name, part in parts)
    return {(c, name): base for c, name, base in made if base.sigma > 0.0}


def _cautions(cap: Capability, alarms: Collection[Alarm]) -> list[str]:
    """Return what to know before the indices are used."""
    out = []
    if any(alarm.rule in (VALUE, SHIFT, DRIFT) for alarm in alarms):
        out.append("not in control: Cp and Cpk describe no stable process; Pp and Ppk describe what was delivered")
    if not cap.normal:
        chance = f"p {cap.p_normal:.2g}" if cap.p_normal > 1e-6 else "p below 1e-6"  # the approximation ends at 0
        words = f"not normal (Anderson-Darling, {chance})"
        if cap.percentiles is None:
            out.append(f"{words}, and no distribution fits: the indices say little")
        else:
            fit = cap.percentiles
            out.append(f"{words}: Ppk by the percentiles of a fitted {fit.distribution} distribution is {fit.Ppk:.2f}")
    return out


def alarm_words(trend: Trend, alarm: Alarm) -> str:
    """Return an alarm in words: which units, since when, direction, size and where."""
    first, last = (trend.rows.iloc[i] for i in (alarm.first, alarm.last))
    units = str(first["serial"]) if alarm.first == alarm.last else f"{first['serial']} to {last['serial']}"
    size = f"{'+' if alarm.size > 0 else ''}{with_U(alarm.size, alarm.U)} {trend.unit}"
    since = f"{first['day']:%Y-%m-%d}"
    shown = f"{units} ({alarm.units} units, since {since})"
    same = f" (the same units: {', '.join(map(' '.join, alarm.same))})" if alarm.same else ""
    where = whose(alarm.place, ", only") + same
    match alarm.rule:
        case "equal":
            value = f"{first['value']:g} {trend.unit}"
            return (
                f"{units} (since {since}): {alarm.units} equal values of {value} in a row{whose(alarm.place)}{same}; "
                f"measured ones show more than {alarm.usual} in a row once in {1.0 / FALSE_ALARM:g} charts: was a "
                "number copied, did a reading stand still, or are the steps of the meter too coarse?"
            )
        case "offset":
            other = whose(alarm.place).strip()
            return (
                f"{shown}: what is measured {other}{same} reads {size} from what is measured beside it, on the same "
                "days and of the same lots, all the time: compare both with one part"
            )
        case "two populations" | "unlike":
            return f"{units} ({since}): {alarm.evidence}"
        case "value":
            there = "" if first["bench"] == NOT_STATED else f", at bench {first['bench']}"
            return f"{units} ({since}{there}): {size} from the mean{alarm.evidence and f'; {alarm.evidence}'}"
        case "shift":
            return f"{shown}: the mean moved {alarm.direction} by {size.lstrip('+-')}{where}"
        case "drift":
            return f"{shown}: drifts {alarm.direction}, by {size.lstrip('+-')} over these units{where}"
        case _:
            return f"{shown}: rule {alarm.rule}, {NELSON[int(alarm.rule)]}"


def whose(place: Place | None, only: str = "") -> str:
    """Return the place of values in words that follow others, "" if it is not known."""
    if place is None:
        return ""
    column, name = place
    return f"{only} {WORDS_OF_PLACES.get(column, 'of')} {column} {name}"


def stored_baselines(store: Store, quantity: str, by: str) -> dict[str, StoredBaseline]:
    """Return group -> the baseline that was set last for a quantity; one that is not signed replaces none that is.
    Raises StoreError."""
    by_key = dict[str, StoredBaseline]()
    for event in store.events(what=BaselineSet.KIND):
        stated = BaselineSet.of(event)
        if stated.quantity == quantity:
            problem = problem_here(BaselineSet.KIND, _signed_content(stated), stated.signed)
            before = by_key.get(stated.group)
            if problem is None or before is None or before.problem is not None:
                by_key[stated.group] = StoredBaseline(stated, event.who, event.time, problem)
    parts = ((key.partition(": "), document) for key, document in by_key.items())
    return {name or column: document for (column, _, name), document in parts if column == by}


def _signed_content(stated: BaselineSet) -> dict[str, Any]:
    return replace(stated, signed=None, typed=False).to_json()


def set_baseline(
    store: Store, trend: Trend, by: str, reason: str, who: str, signer: Signer | None = None
) -> BaselineSet:
    """Store the process of a trend's values as the baseline of its group. signer: of quality assurance.

    Raises FleetError for too few or equal values, and for a revision without a reason; StoreError.
    """
    where = f"{trend.quantity}, {trend.name}"
    if trend.name in stored_baselines(store, trend.quantity, by) and not reason.strip():
        raise FleetError(f"{where}: has a baseline; say why it is revised: --reason")
    with statistics(f"{where}: no baseline: "):
        process = estimate_baseline(to_scale(trend.rows["value"].to_numpy()[trend.compared], trend.scale))
    if process.sigma == 0.0:
        raise FleetError(f"{where}: no baseline: all {process.n} values are {process.mean:g}")
    since, until = (f"{trend.rows['day'].iloc[i]:%Y-%m-%d}" for i in (0, -1))
    group = "all" if by == "all" else f"{by}: {trend.name}"
    stated = BaselineSet(trend.quantity, group, since, until, **vars(process), reason=reason.strip(), scale=trend.scale)
    if signer is not None:
        stated = replace(stated, signed=sign_decision(BaselineSet.KIND, _signed_content(stated), signer))
    store.write(stated, who=who if signer is None else signer.person)
    return stated


def summary(t: Trend, points: bool = True) -> dict[str, Any]:
    """Return a trend as a document: counts, spreads, indices with intervals, baseline, alarms and, if asked, points."""
    cap = t.capability
    fitted = cap.percentiles if cap else None
    return {
        "group": t.name,
        "unit": t.unit,
        "n": len(t.rows),
        "mean": float(t.rows["value"].mean()) if len(t.rows) else None,
        "sigma_within": cap.sigma_within if cap else None,
        "sigma_overall": cap.sigma_overall if cap else None,
        **_indices(cap),
        "stages": list(t.stages),
        "in_control": t.chart is not None and not t.alarms,
        "normal": cap.normal if cap else None,
        "p_normal": cap.p_normal if cap else None,
        "Ppk_percentiles": fitted.Ppk if fitted else None,
        "distribution": fitted.distribution if fitted else None,
        "baseline": _baseline_document(t),
        "limits": None if t.chart is None else {"lower": t.chart.lower, "upper": t.chart.upper},
        "false_alarm_rate": t.false_alarms if t.chart else None,
        "findable": dict(zip(("own", "ring"), t.findable, strict=True)),
        "alarms": _alarm_documents(t),
        "cautions": list(t.why),
        "points": _points(t.rows) if points else [],
    }


def _indices(cap: Capability | None) -> dict[str, float | None]:
    """Return the indices with the ends of their intervals."""
    indices: dict[str, float | None] = {}
    for name in ("Cp", "Cpk", "Pp", "Ppk"):
        index: Index | None = getattr(cap, name) if cap else None
        value, lo, hi = (index.value, index.lo, index.hi) if index else (None, None, None)
        indices |= {name: value, f"{name}_lo": lo, f"{name}_hi": hi}
    return indices


def _baseline_document(t: Trend) -> dict[str, Any] | None:
    """Return the baseline of the chart, and who stored it and why; None without a baseline."""
    base, stored = t.chart.baseline if t.chart else None, t.baseline
    if base is None:
        return None
    stated = stored.stated if stored else None
    return {
        **vars(base),
        "scale": t.scale or "as measured",
        "since": stated and stated.since,
        "until": stated and stated.until,
        "stored_by": stored and stored.who,
        "typed": stated and stated.typed,
        "stored_at": stored and stored.time,
        "signed": stored and stored.problem is None,
        "reason": stated and stated.reason,
    }


def _alarm_documents(t: Trend) -> list[dict[str, Any]]:
    serials = t.rows["serial"].array
    return [
        {**alarm.document(serials), "since": f"{t.rows['day'].iloc[alarm.first]:%Y-%m-%d}", "units": alarm.units,
         "place": dict([alarm.place]) if alarm.place else None, "words": alarm_words(t, alarm)}
        for alarm in t.alarms
    ]  # fmt: skip


def _points(rows: pd.DataFrame) -> list[dict[str, Any]]:
    names = ("serial", "value", "U", "bench", "operator")
    days = rows["day"].map({day: f"{day:%Y-%m-%d}" for day in rows["day"].unique()}).tolist()
    columns = [[None if v != v else v for v in rows[name].tolist()] for name in names]
    return [dict(zip((*names, "time"), row, strict=True)) for row in zip(*columns, days, strict=True)]


def chart_panels(trend: Trend) -> list[Panel]:
    """Return the chart: values in order, those that ring marked, the level that lasting alarms give, mean and limits;
    after a baseline the cumulative sums with their limit too."""
    x = np.arange(1.0, len(trend.rows) + 1)
    values = trend.rows["value"].to_numpy()
    rang, begun = ([a.first for a in trend.alarms if a.rule in rules] for rules in ((VALUE,), (SHIFT, DRIFT)))
    aside = np.delete(np.arange(x.size), trend.compared)
    items: list[Line | Mark] = [Line(x[trend.compared], values[trend.compared], "value", "points", "data")]
    if aside.size:
        items.append(Line(x[aside], values[aside], "equal values in a row", "points", "bad"))
    if DOUBT in trend.rows and (off := np.flatnonzero(trend.rows[DOUBT] != "")).size:
        items.append(Line(x[off], values[off], "judged while a golden unit was off", "points", "auto"))
    if (control := trend.chart) is not None:
        at = x[trend.compared]
        items += [
            Line(x[rang], values[rang], "beyond the limits", "points", "bad"),
            Line(at, control.level, "level", role="model"),
            Mark(control.baseline.mean, "y", f"mean of {'the baseline' if trend.baseline else 'these units'}", "quiet"),
            *limits_of_one_value(control),
            *(Mark(float(x[i]), "x", "a shift begins", "bad") for i in begun),
        ]
    for bound in ("lower", "upper"):
        limit = trend.rows[bound].to_numpy()
        if limit.size and np.isfinite(limit).all() and np.ptp(limit) == 0.0:
            items.append(Mark(float(limit[0]), "y", f"{bound} limit", "limit"))
    label = label_of(trend.quantity)
    days = trend.rows["day"]
    span = f", {days.iloc[0]:%Y-%m-%d} to {days.iloc[-1]:%Y-%m-%d}" if len(days) else ""
    title = label if trend.name == "all" else f"{label}, {trend.name}"
    order = f"unit, in order of measurement{span}"
    drawn = Panel(title, order, f"{label} [{trend.unit}]", tuple(items))
    return [drawn] if control is None else [drawn, *sums_panel(control, at, title, order, "the baseline")]


def limits_of_one_value(made: Chart) -> list[Mark]:
    """Return the marks of both limits of a chart."""
    return [Mark(made.lower, "y", "limits of one value", "bad"), Mark(made.upper, "y", "", "bad")]


def sums_panel(made: Chart, at: Array, title: str, order: str, of: str) -> list[Panel]:
    """Return the panel of the cumulative sums of a chart, none if it has no sums. of: what they are above or below."""
    if made.sums is None or made.sums_limit is None:
        return []
    ways = [Line(at, sums, way) for sums, way in zip(made.sums.T, (f"above {of}", "below it"), strict=True)]
    limit = Mark(made.sums_limit, "y", "a shift", "bad")
    return [Panel(f"{title}: cumulative sums", order, "sum [standard deviations]", (*ways, limit))]
