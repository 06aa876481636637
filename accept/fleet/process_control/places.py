"""The place of a change in a process: a shift or drift that shows at one bench, operator or lot and at no other.

A chart of values of two benches in turn shows a shift of one bench half as large, and late. A change that shows in the
chart of one place alone, and that the values of the other places contradict, is named with that place, and the chart of
all is made again without it."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from accept.fleet.process_control.control_chart import (
    DRIFT,
    FALSE_ALARM,
    GROSS_SIGMAS,
    LEAST,
    SHIFT,
    SHORTEST,
    Alarm,
    Baseline,
    Chart,
    chart,
)
from accept.fleet.process_control.equal_runs import Labels, Place
from checks.arrays import Array

STILL = 3.0  # standard errors: the other places must not have changed by more,
ONLY_THERE = 4.0  # and must differ from the change by more
NEARLY = 4.0  # a place begins and ends where a shift does, within what its values show with 95 % (chi-square of 1)
MOST_CHANGES = 8  # places that are sought: more are no single causes


def chart_by_place(
    values: Array,
    places: Mapping[str, Labels],
    baseline: Baseline | None = None,
    nelson_rules: Collection[int] = (),
    baselines: Mapping[Place, Baseline] | None = None,
    chance: float = FALSE_ALARM,
) -> Chart:
    """Return the chart of values (N,) as `chart`, each lasting alarm with the place that it is confined to.

    places: "bench" -> label (N,) of each value, "" if it is not stated. baselines: those of the places, for values
    after a baseline; without its own, a place is compared with that of all. Raises ValueError as `chart`.
    """
    whole = now = chart(values, baseline, nelson_rules, chance)
    left, level, named = np.array(values, dtype=float), np.zeros(len(values)), list[Alarm]()
    for _ in range(MOST_CHANGES):
        if not any(alarm.lasts for alarm in now.alarms):
            break
        found = _confined_alarms(left, places, baseline, baselines or {}, chance)
        if found is None:
            break
        alarms, change = found
        named, left, level = [*named, *alarms], left - change, level + change
        now = chart(left, baseline, nelson_rules, chance)
    sigma = now.baseline.sigma
    rest = [replace(a, place=_coincident(a, left, places, sigma)) if a.rule == SHIFT else a for a in now.alarms]
    alarms = sorted([*named, *rest], key=lambda a: (a.first, a.rule))
    return replace(whole, level=now.level + level, alarms=tuple(alarms))


def _confined_alarms(
    x: Array,
    places: Mapping[str, Labels],
    baseline: Baseline | None,
    baselines: Mapping[Place, Baseline],
    chance: float,
) -> tuple[list[Alarm], Array] | None:
    """Return the lasting alarms of places that the others contradict, and how much they move each value (N,); None if
    no column has such places."""
    for column, labels in places.items():
        names = [name for name in dict.fromkeys(labels) if name and (labels == name).sum() >= LEAST]
        charts = {name: chart(x[labels == name], baselines.get((column, name), baseline), (), chance) for name in names}
        ringing = [name for name, made in charts.items() if any(a.lasts for a in made.alarms)]
        still = np.flatnonzero(np.isin(labels, [name for name in names if name not in ringing]))
        alarms, change = list[Alarm](), np.zeros_like(x)
        for name in ringing:
            made, here = charts[name], np.flatnonzero(labels == name)
            moved = made.level - (made.level[0] if baseline is None else made.baseline.mean)
            alarms += [
                replace(a, first=int(here[a.first]), last=int(here[a.last]), units=a.last - a.first + 1,
                        place=(column, name))
                for a in made.alarms if a.lasts
            ]  # fmt: skip
            change[here] = moved
        if alarms and all(
            _is_contradicted(a, x, still, charts[str(a.place and a.place[1])].baseline.sigma) for a in alarms
        ):
            return alarms, change
    return None


def _is_contradicted(alarm: Alarm, x: Array, others: NDArray[np.intp], sigma: float) -> bool:
    """Return whether the values x[others] of the other places show that they did not change as this place did."""
    if not others.size:
        return False
    at = others[np.abs(x[others] - np.median(x[others])) <= GROSS_SIGMAS * sigma]
    within = (at >= alarm.first) & (at <= alarm.last)
    if alarm.rule == DRIFT:
        if at.size < LEAST:
            return False
        off = at - at.mean()
        span = alarm.last - alarm.first
        size = float(off @ x[at] / (off @ off)) * span
        error = sigma * span / float(np.sqrt(off @ off))
    else:
        if within.sum() < SHORTEST or (~within).sum() < SHORTEST:
            return False
        size = float(x[at[within]].mean() - x[at[~within]].mean())
        error = sigma * float(np.sqrt(1.0 / within.sum() + 1.0 / (~within).sum()))
    return abs(size) <= STILL * error and abs(alarm.size - size) > ONLY_THERE * float(np.hypot(error, alarm.U / 2.0))


def same_places(place: Place | None, places: Mapping[str, Labels]) -> tuple[Place, ...]:
    """Return the other places of exactly the values of a place: an operator who always works at one bench."""
    if place is None:
        return ()
    of_place = places[place[0]] == place[1]
    if of_place.all():
        return ()
    firsts = ((column, str(labels[np.argmax(of_place)])) for column, labels in places.items() if column != place[0])
    return tuple((c, name) for c, name in firsts if name and np.array_equal(places[c] == name, of_place))


def _coincident(alarm: Alarm, x: Array, places: Mapping[str, Labels], sigma: float) -> Place | None:
    """Return the place that the values of a shift have in common and others do not: the lot that began and ended with
    it, within the uncertainty of the beginning and the end.

    A level for the place must describe x nearly as well as one for the alarm, with as many values again on both sides:
    2 log likelihood ratio at most `NEARLY`.
    """
    size = alarm.last - alarm.first + 1
    around = np.arange(max(0, alarm.first - size), min(x.size, alarm.last + 1 + size))
    shown = (around >= alarm.first) & (around <= alarm.last)
    kept = (
        np.abs(x[around] - np.where(shown, np.median(x[around[shown]]), np.median(x[around[~shown]])))
        <= GROSS_SIGMAS * sigma
    )
    y, shown = x[around[kept]], shown[kept]
    for column, labels in places.items():
        names, counts = np.unique(labels[alarm.first : alarm.last + 1].astype(str), return_counts=True)
        name = str(names[np.argmax(counts)])
        of_place = labels == name
        inside = of_place[around[kept]]
        whole = of_place[around].sum() == of_place.sum() < labels.size and 0 < inside.sum() < inside.size
        if name and whole and _squares_of(y, inside) - _squares_of(y, shown) <= NEARLY * sigma**2:
            return column, name
    return None


def _squares_of(y: Array, inside: NDArray[np.bool_]) -> float:
    """Return the sum of squared distances of y (n,) from the mean of either part."""
    return sum(float(((part - part.mean()) ** 2).sum()) for part in (y[inside], y[~inside]))
