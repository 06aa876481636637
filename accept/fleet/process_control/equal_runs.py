"""Runs of equal values in a row: longer ones than a meter's steps and the scatter of the process explain.

Two readings of a normal process are equal with a chance p that depends on the step of the meter and the standard
deviation alone; so does the length of the runs that such readings show. A longer run was not measured one by one: a
number was copied, the reading stood still, or the steps of the meter are too coarse for the process.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from accept.fleet.process_control.spread import moving_range_sigma
from checks.arrays import Array

BY = ("operator", "bench")  # who reads, and with which meters: a run counts among the values of each alone
FALSE_ALARM = 0.02  # chance of a run anywhere among measured values, of both together

COARSEST = 0.5  # chance of equal neighbours at a step of 2 sigma: a coarser meter cannot resolve the process

Labels = NDArray[np.object_]
Place = tuple[str, str]  # ("operator", "Ben")


@dataclass(frozen=True, eq=False)
class EqualRun:
    """A run. at: indices of its values; place: whose values, None if that is not stated; usual: how many in a row
    measured values show, but for one chart in 1 / `FALSE_ALARM`; rings: whether it is too long for a shared chance."""

    at: NDArray[np.intp]
    place: Place | None
    usual: int
    rings: bool = True


def equal_runs(values: Array, places: Mapping[str, Labels], shared: float = FALSE_ALARM) -> list[EqualRun]:
    """Return the runs of values (N,) in the order of measurement, no value in two of them, by their first value.

    places: "operator" -> label (N,) of each value, "" if it is not stated; of those the columns `BY` count.
    shared: chance of a run anywhere among measured values that rings."""
    x = np.asarray(values, dtype=float)
    columns = {name: places[name] for name in BY if name in places} or {"": np.full(x.size, "", dtype=object)}
    people = next(iter(columns.values()))
    parts = [(name, label, np.flatnonzero(of == label)) for name, of in columns.items() for label in dict.fromkeys(of)]
    tie = {label: _tie_chance(x[people == label]) for label in dict.fromkeys(people)}
    found = list[EqualRun]()
    for name, label, at in parts:
        place = (name, str(label)) if label else None
        # Whose meter has the largest steps decides where several read on one bench.
        p = max(tie[each] for each in set(people[at]))
        usual, rare = (_usual_length(at.size, p, chance) for chance in (FALSE_ALARM, shared))
        runs = (run for run in _stretches(x[at]) if run.size > usual)
        found += [EqualRun(at[run], place, usual, run.size > rare) for run in runs]
    chosen, taken = list[EqualRun](), np.zeros(x.size, dtype=bool)
    for run in sorted(found, key=lambda r: -r.at.size):  # of the same values the operator stands first
        if not taken[run.at].any():
            chosen.append(run)
            taken[run.at] = True
    return sorted(chosen, key=lambda r: int(r.at[0]))


def _stretches(x: Array) -> Sequence[NDArray[np.intp]]:
    return np.split(np.arange(x.size), np.flatnonzero(np.diff(x)) + 1)


def _usual_length(n: int, p: float, chance: float = FALSE_ALARM) -> int:
    """Return the longest run that n values show but for half a chance: people and benches have it together.

    n p q^(L - 2) is the expected number of runs of L or more; q, the chance that a run goes on, is that of the most
    frequent value: sqrt(2) p of fine steps, at most sqrt(p) of coarse ones."""
    q = min(np.sqrt(2.0) * p, np.sqrt(p))
    return int(np.ceil(1.0 + np.log(chance / 2.0 / (n * p)) / np.log(q)))


def _tie_chance(x: Array) -> float:
    """Return the chance that two values of the process behind x (n,) are equal. The longest run counts as one value
    while it is too long for the other values."""
    p, longest = _tie_chance_of(x), max(_stretches(x), key=len)
    others = np.delete(x, longest[1:])
    if longest.size < 2 or longest.size <= _usual_length(x.size, _tie_chance_of(others)):
        return p
    return _tie_chance(others)


def _tie_chance_of(x: Array) -> float:
    """Return the larger of two estimates, but at most `COARSEST`: the share of equal neighbours, and the chance for
    normal values that are rounded to a step, the mean of the positive part of 1 - |difference| / step.

    The step is the median difference of neighbouring values in order: one value with more digits makes it no finer."""
    shown = (float((np.diff(x) == 0.0).sum()) + 1.0) / (x.size + 1.0)
    steps = np.diff(np.unique(x))
    if not steps.size:
        return COARSEST
    ratio = float(np.median(steps)) / (2.0 * moving_range_sigma(x))
    rounded = float(erf(ratio) - (1.0 - np.exp(-(ratio**2))) / (ratio * np.sqrt(np.pi)))
    return min(max(shown, rounded), COARSEST)
