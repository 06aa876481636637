"""Control charts of single values against a baseline: gross values, lasting shifts, and where a shift began.

Phase I estimates mean and spread within the process from a baseline, gross values left out; phase II compares what
follows with it, one value at a time and by cumulative sums ([Montgomery] 6.4 and 9.1; [AIAG-SPC] chapter II). The
limits depend on how many values are compared: a process that is in control rings with a chance of `FALSE_ALARM` in the
whole chart, the uncertainty of a short baseline included, not with a chance at every value. Nelson's rules ([Nelson])
may be added; `false_alarm_rate` gives the cost of the chosen set.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import median_filter

from accept.fleet.process_control.spread import most_sigmas, moving_range_degrees, moving_range_sigma, robust_sigma
from checks.arrays import Array

LEAST = 8  # values below which limits are not worth drawing
FALSE_ALARM = 0.02  # chance that a chart of a process in control rings anywhere
OF_ONE_VALUE = 0.25  # share of a chance, after a baseline: a value is seldom just beyond its limits, a drift often is
GROSS_SIGMAS = 5.0  # a value so far from the median is no part of the spread of the process
ALLOWANCE = 0.5  # sigmas that a value may be off without adding to a sum: sees one sigma soonest ([Montgomery] 9.1)
NEIGHBOURS = 9  # values whose median is the level around one of them
BACK = 1.0 / 3.0  # of its limit: so far a sum must come back before a shift is over
SHORTEST = 3  # values that a shift must last to be a shift, not single values
VALUE, SHIFT, DRIFT = "value", "shift", "drift"  # a drift is a shift that a line describes better than steps
MIXTURE, UNLIKE = "two populations", "unlike"  # `accept.fleet.process_control.reading_quality`
EQUAL = "equal"  # a run of equal values (`accept.fleet.process_control.equal_runs`)
OFFSET = "offset"  # of one bench, meter or person against others (`accept.fleet.process_control.offsets`)
NELSON = {
    1: "one value beyond 3 sigma",
    2: "nine in a row on one side of the mean",
    3: "six in a row rising or falling",
    4: "fourteen in a row alternating",
    5: "two of three beyond 2 sigma on one side",
    6: "four of five beyond 1 sigma on one side",
    7: "fifteen in a row within 1 sigma",
    8: "eight in a row beyond 1 sigma on both sides",
}
ON_BOTH_SIDES = (EQUAL, MIXTURE, "4", "7", "8")
_SIMULATED = 1000  # charts in control behind a stated rate: 5 % +- 1.4 %
_LENGTHS = (10, 20, 50, 100, 200, 500)  # of simulated charts; the rate depends little on it
# Limit of the sums [sigma] by values of the baseline, then by chance (`_RARER`), then by `_LENGTHS`: what the larger of
# the two exceeds in `FALSE_ALARM` less `OF_ONE_VALUE` of charts in control, in a tenth and in a hundredth of that; of
# 40,000 simulated ones, of 1,000,000 for what is rarer (known to 2 % from 20 values on, the rarest to 4 %).
_RARER = (1.0, 0.1, 0.01)
_SUMS = {
    8: ((12.7, 20.7, 41.9, 77.7, 147.2, 354.6), (23.2, 39.5, 86.2, 162.1, 312.5, 764.5),
        (37.4, 65.4, 141.3, 270.8, 522.6, 1301.0)),
    10: ((10.8, 17.0, 33.1, 59.4, 111.3, 266.2), (18.7, 30.5, 63.9, 118.7, 227.2, 548.7),
        (28.8, 48.0, 100.8, 191.5, 366.8, 894.0)),
    15: ((8.4, 12.3, 21.6, 35.0, 61.2, 134.5), (13.5, 21.0, 40.1, 71.1, 131.4, 310.4),
        (19.4, 31.1, 62.1, 113.4, 209.5, 506.6)),
    20: ((7.3, 10.2, 16.7, 25.1, 39.3, 76.7), (11.3, 16.8, 30.0, 50.0, 87.9, 202.5),
        (15.7, 23.9, 44.3, 79.0, 143.7, 338.6)),
    30: ((6.4, 8.5, 12.3, 16.2, 21.4, 31.5), (9.5, 13.4, 21.1, 31.3, 49.9, 102.7),
        (12.7, 18.4, 30.9, 50.5, 85.4, 193.6)),
    40: ((5.8, 7.6, 10.5, 13.3, 16.1, 20.6), (8.6, 11.6, 17.2, 23.5, 33.0, 55.0),
        (11.2, 15.8, 24.7, 36.6, 58.3, 120.5)),
    60: ((5.5, 7.0, 9.2, 10.9, 12.7, 15.3), (7.8, 10.2, 13.9, 17.2, 20.8, 26.9), (10.1, 13.5, 19.3, 25.5, 34.2, 52.4)),
    100: ((5.1, 6.3, 8.0, 9.3, 10.5, 12.3), (7.2, 9.0, 11.6, 13.4, 15.3, 17.7), (9.1, 11.8, 15.6, 18.4, 21.0, 25.2)),
    200: ((4.9, 6.0, 7.4, 8.3, 9.3, 10.5), (6.7, 8.2, 10.1, 11.4, 12.6, 14.1), (8.4, 10.6, 12.9, 14.8, 16.0, 17.9)),
    500: ((4.7, 5.7, 7.0, 7.9, 8.7, 9.8), (6.5, 7.9, 9.4, 10.4, 11.3, 12.4), (8.1, 10.0, 12.0, 13.0, 14.0, 15.3)),
}  # fmt: skip
# Per mille of charts that ring without any of Nelson's rules, as `simulated_rate` finds it: values of the baseline
# before them (None: none), then by `_LENGTHS`. To be simulated again if the tests of a chart change.
_RATES = {
    None: (5, 7, 5, 16, 15, 23),
    10: (23, 15, 13, 20, 17, 15),
    20: (10, 18, 15, 21, 16, 16),
    50: (20, 22, 23, 22, 13, 11),
    100: (24, 26, 27, 21, 13, 15),
    200: (13, 15, 18, 11, 18, 18),
    500: (23, 31, 17, 14, 13, 20),
}


@dataclass(frozen=True)
class Baseline:
    """The process as it was: mean, standard deviation within, from n values; left_out: gross values among them."""

    mean: float
    sigma: float
    n: int
    left_out: int = 0

    def U_of_mean(self, n: int) -> float:
        """Return the expanded uncertainty (k = 2) of the distance of the mean of n values from this one."""
        return 2.0 * self.sigma * float(np.sqrt(1.0 / n + 1.0 / self.n))


@dataclass(frozen=True)
class Alarm:
    """A test that raises an alarm. rule: "value", "shift", "drift", "equal", "offset", "two populations", "unlike" or a
    number of `NELSON`; first, last: indices of its values; size: distance of their mean from that of the baseline, or,
    without one, from the mean before; U: its expanded uncertainty (k = 2). units: number of values that show it, if not
    all from first to last do; place: what those have in common, ("bench", "B2"), None if unknown; usual: of equal
    values, how many in a row are no alarm; same: other places of exactly the same values, which these cannot tell
    apart; evidence: in words, of what a chart does not show; rings: whether it is as rare as all charts of a page need
    (`accept.fleet.rings`), not as its own chart alone does."""

    rule: str
    first: int
    last: int
    size: float
    U: float
    units: int = 0
    place: tuple[str, str] | None = None
    usual: int = 0
    same: tuple[tuple[str, str], ...] = ()
    evidence: str = ""
    rings: bool = False

    @property
    def lasts(self) -> bool:
        """Whether it is about several values and not single ones."""
        return self.rule in (SHIFT, DRIFT)

    @property
    def direction(self) -> str | None:
        """Return "up" or "down", None for a pattern on both sides."""
        return None if self.rule in ON_BOTH_SIDES else "up" if self.size > 0 else "down"

    def document(self, names: Sequence[str]) -> dict[str, Any]:
        ends = {"first": names[self.first], "last": names[self.last]}
        of = {"rule": self.rule, **ends, "direction": self.direction, "size": self.size, "U": self.U}
        return {**of, "rings": self.rings}


@dataclass(frozen=True, eq=False)
class Chart:
    """values (N,) against a baseline: lower, upper limits of a single value; level (N,) of the process as the lasting
    alarms give it; sums (N, 2), upwards and downwards [sigma], gross values left out, of which one at sums_limit rings;
    both None without a baseline."""

    values: Array
    baseline: Baseline
    lower: float
    upper: float
    level: Array
    sums: Array | None
    sums_limit: float | None
    alarms: tuple[Alarm, ...]


def estimate_baseline(values: Array) -> Baseline:
    """Return the mean and spread within a process from values (n,) in the order of measurement, gross values left out.

    Raises ValueError for fewer than `LEAST` values or one that is not finite.
    """
    x = np.asarray(values, dtype=float)
    if x.ndim != 1 or x.size < LEAST or not np.isfinite(x).all():
        raise ValueError(f"{x.size} values, expected {LEAST} or more, all finite")
    apart = np.abs(x - np.median(x))
    kept = x[apart <= GROSS_SIGMAS * robust_sigma(x)] if robust_sigma(x) > 0.0 else x
    if kept.size < LEAST:
        kept = x
    mean = kept[0] + (kept - kept[0]).mean()  # of equal values it is that value, without a rounding error
    return Baseline(float(mean), moving_range_sigma(kept), kept.size, x.size - kept.size)


def chart(
    values: Array, baseline: Baseline | None = None, nelson_rules: Collection[int] = (), chance: float = FALSE_ALARM
) -> Chart:
    """Return the chart of values (N,) in the order of measurement, with its alarms by their first value.

    baseline: of values before these; None: estimated from these values, and a shift is then a place where their own
    mean changes. chance: that values in control ring anywhere, without Nelson's rules. Raises ValueError for fewer than
    `LEAST` values without a baseline, for no value, or one that is not finite.
    """
    x = finite(values)
    base = baseline or estimate_baseline(x)
    of_values = chance if baseline is None else OF_ONE_VALUE * chance
    half = _quantile(x.size, base, of_values) * base.U_of_mean(1) / 2.0
    # A single value is compared with the level around it: many in a row that are far off are a shift.
    local = median_filter(x, NEIGHBOURS, mode="mirror")
    apart = half if baseline is not None else max(half, GROSS_SIGMAS * base.sigma)
    kept = np.flatnonzero(np.abs(x - local) <= apart)
    sums, limit = None, None
    if baseline is None:
        lasting, level = _changes(x, kept, base, chance)
    else:
        limit = sums_limit(base.n, x.size, chance)
        sums = _cumulative_sums(x, kept, base, limit)
        lasting, level = _departures(x, kept, base, sums[kept].max(axis=1) / limit)
    gross = map(int, np.flatnonzero(_distance(x, level) > half))
    alarms = [Alarm(VALUE, i, i, float(x[i] - level[i]), base.U_of_mean(1)) for i in gross]
    return Chart(
        values=x,
        baseline=base,
        lower=base.mean - half,
        upper=base.mean + half,
        level=level,
        sums=sums,
        sums_limit=limit,
        alarms=tuple(sorted([*alarms, *lasting, *_patterns(x, base, nelson_rules)], key=lambda a: (a.first, a.rule))),
    )


def finite(values: Array) -> Array:
    """Return values (N,) as numbers. Raises ValueError for no value, or one that is not finite."""
    x = np.asarray(values, dtype=float)
    if x.ndim != 1 or not x.size or not np.isfinite(x).all():
        raise ValueError(f"{x.size} values, expected one or more, all finite")
    return x


def _quantile(tests: int, base: Baseline, chance: float) -> float:
    return most_sigmas(tests, moving_range_degrees(base.n), chance)


@cache
def sums_limit(baseline_n: int, n: int, chance: float = FALSE_ALARM) -> float:
    """Return the limit of the cumulative sums [sigma] of n values after a baseline of baseline_n.

    The logarithm of `_SUMS` is interpolated in 1 / baseline_n, log(chance) and log(n). Longer charts, shorter baselines
    and smaller chances are extrapolated, longer baselines take the last row.
    """
    over = sorted(1.0 / known for known in _SUMS)
    table = np.log([_SUMS[round(1.0 / each)][::-1] for each in over])
    axes = over, np.log(_RARER[::-1]), np.log(_LENGTHS)
    at = RegularGridInterpolator(axes, table, bounds_error=False, fill_value=None)
    asked = max(1.0 / baseline_n, over[0]), np.log(chance / FALSE_ALARM), np.log(max(n, SHORTEST))
    return float(np.exp(at([asked]).item()))


def _cumulative_sums(x: Array, kept: NDArray[np.intp], base: Baseline, limit: float) -> Array:
    """Return the sums (N, 2), upwards and downwards [sigma], of what x[kept] exceeds the baseline by beyond `ALLOWANCE`
    ([Montgomery] eq. 9.2, 9.3). A sum that rings grows no further, so that it comes back soon after the process did."""
    sums, now = np.zeros((x.size, 2)), np.zeros(2)
    step = np.zeros((x.size, 2))
    if base.sigma > 0.0:
        z = (x[kept] - base.mean) / base.sigma
        step[kept] = np.stack([z, -z], axis=1) - ALLOWANCE
    for i, each in enumerate(step):
        sums[i] = now = np.clip(now + each, 0.0, limit)
    return sums


def _distance(x: Array, level: Array) -> Array:
    """Return how far each value (N,) lies from the level there, or from that of a neighbour if it is nearer: where a
    shift begins is known to some values only."""
    padded = np.concatenate([level[:1], level, level[-1:]])
    return np.asarray(np.min([np.abs(x - padded[k : k + x.size]) for k in range(3)], axis=0))


def shift_length(off: Array) -> int:
    """Return how many values of a shift there are among values (n,) since its first, as distances from the mean before
    it: the maximum-likelihood number."""
    return int(np.argmax(np.cumsum(off) ** 2 / np.arange(1, off.size + 1))) + 1


def _departures(x: Array, kept: NDArray[np.intp], base: Baseline, off: Array) -> tuple[list[Alarm], Array]:
    """Return the shifts from the baseline that the cumulative sums show, each with its most likely start, and the level
    (N,) that they give every value.

    off (K,): the larger sum at x[kept], in units of its limit. A shift lasts until it is back within a third of that.
    The beginning is the maximum-likelihood one of a step, the values before it counted with the baseline."""
    out: list[Alarm] = []
    level = np.full_like(x, base.mean)
    if base.sigma == 0.0:
        return out, level
    done = 0
    for start in map(int, np.flatnonzero(off >= 1.0)):
        if start < done:
            continue
        back = np.flatnonzero(off[start:] < BACK)
        end = start + int(back[0]) if back.size else kept.size
        y = x[kept[done:end]]
        of = np.arange(start - done + 1)  # values before the shift, beside those of the baseline
        before = (base.n * base.mean + np.concatenate([[0.0], np.cumsum(y)])[of]) / (base.n + of)
        after = np.cumsum(y[::-1])[::-1][of] / (y.size - of)
        contrast = np.abs(after - before) / np.sqrt(1.0 / (base.n + of) + 1.0 / (y.size - of))
        begin = done + int(np.argmax(contrast))
        if back.size:  # the sum comes back some values after the process did
            end = begin + shift_length(x[kept[begin:end]] - base.mean)
        size = float(x[kept[begin:end]].mean() - base.mean)
        if end - begin >= SHORTEST:
            out.append(Alarm(SHIFT, int(kept[begin]), int(kept[end - 1]), size, base.U_of_mean(end - begin)))
            level[kept[begin] : kept[end - 1] + 1] += size
        done = start + int(back[0]) if back.size else kept.size
    return out, level


def _changes(x: Array, kept: NDArray[np.intp], base: Baseline, chance: float) -> tuple[list[Alarm], Array]:
    """Return the places where the mean of x[kept] changes, and the level (N,) that this gives every value.

    The most significant change is sought first, then both parts ([Hawkins]). Its size is that from the part before to
    the part after it. The end of a shift, a return to the level before it, is no change of its own.
    """
    level = np.full_like(x, base.mean)
    places = _refine(x[kept], _split(x[kept], 0, base, chance), base, chance) if base.sigma > 0.0 else []
    if not places:
        return [], level
    if drift := _drift(x, kept, base, places):
        at = np.arange(x.size) - kept.mean()
        return [drift], x[kept].mean() + drift.size / (drift.last - drift.first) * at
    edges = [0, *places, kept.size]
    means = [float(x[kept[i:k]].mean()) for i, k in pairwise(edges)]
    level = np.repeat(means, np.diff([0, *kept[places], x.size]))
    alarms, levels = [], [0]  # parts whose level may come back: the one before each shift that lasts
    for part in range(1, len(means)):
        if (back := _same_level(part, levels[:-1], means, edges, base, chance)) is not None:
            del levels[levels.index(back) + 1 :]
            continue
        before, first, end = edges[part - 1 : part + 2]
        size = means[part] - means[part - 1]
        U = 2.0 * base.sigma * float(np.sqrt(1.0 / (end - first) + 1.0 / (first - before)))
        alarms.append(Alarm(SHIFT, int(kept[first]), int(kept[end - 1]), size, U))
        levels.append(part)
    return alarms, level


def _same_level(
    part: int, earlier: list[int], means: list[float], edges: list[int], base: Baseline, chance: float
) -> int | None:
    """Return the last of some earlier parts whose mean does not differ significantly from that of a part, or None."""
    size, significant = np.diff(edges), _quantile(edges[-1], base, chance)
    for other in reversed(earlier):
        error = base.sigma * float(np.sqrt(1.0 / size[part] + 1.0 / size[other]))
        if abs(means[part] - means[other]) <= significant * error:
            return other
    return None


def _drift(x: Array, kept: NDArray[np.intp], base: Baseline, places: list[int]) -> Alarm | None:
    """Return a drift of x[kept] over the whole chart if a line describes it better than steps at these places."""
    y, at = x[kept], kept - kept.mean()
    slope = float(at @ y / (at @ at))
    line = float(((y - y.mean() - slope * at) ** 2).sum())
    steps = _squares(y, [0, *places, y.size])
    if line > steps + (2 * len(places) - 1) * base.sigma**2 * np.log(y.size):  # a step has a parameter more ([Schwarz])
        return None
    span = float(kept[-1] - kept[0])
    U = 2.0 * base.sigma * span / float(np.sqrt(at @ at))
    return Alarm(DRIFT, int(kept[0]), int(kept[-1]), slope * span, U)


def _split(x: Array, offset: int, base: Baseline, chance: float) -> list[int]:
    """Return the indices at which the mean of x (n,) changes, counted from offset."""
    at = best_split(x, SHORTEST)
    if at is None:
        return []
    apart = abs(float(x[at:].mean() - x[:at].mean())) / float(np.sqrt(1.0 / at + 1.0 / (x.size - at)))
    if apart <= _quantile(x.size - 2 * SHORTEST + 1, base, chance) * base.sigma:
        return []
    return [*_split(x[:at], offset, base, chance), offset + at, *_split(x[at:], offset + at, base, chance)]


def _refine(x: Array, places: list[int], base: Baseline, chance: float) -> list[int]:
    """Return the places of change of x (n,) after each was moved to where it fits best between its neighbours, and left
    out if it is not significant then: a split of the whole is only approximately at the place that later splits
    show."""
    edges = [0, *places, x.size]
    significant = _quantile(x.size, base, chance) ** 2 * base.sigma**2
    i = 1
    while i < len(edges) - 1:
        lo, hi = max(0, i - 2), min(len(edges) - 1, i + 2)
        without = [*edges[lo:i], *edges[i + 1 : hi + 1]]
        for k in range(1, len(without) - 1):
            without[k] = _between(x, without[k - 1], without[k], without[k + 1])
        if _squares(x, without) - _squares(x, edges[lo : hi + 1]) <= significant:
            edges[lo : hi + 1] = without
            i = max(1, i - 2)
        else:
            edges[i] = _between(x, edges[i - 1], edges[i], edges[i + 1])
            i += 1
    return edges[1:-1]


def _between(x: Array, first: int, present: int, end: int) -> int:
    """Return the best place to split x[first:end]; the present place if it is too short."""
    found = best_split(x[first:end], SHORTEST)
    return present if found is None else first + found


def best_split(x: Array, least: int) -> int | None:
    """Return where to split x (n,) so that two means, of at least so many values, describe it best; or None."""
    at = np.arange(least, x.size - least + 1)
    if not at.size:
        return None
    total = np.cumsum(x)
    before, after = total[at - 1] / at, (total[-1] - total[at - 1]) / (x.size - at)
    return int(at[np.argmax((before - after) ** 2 * at * (x.size - at))])


def _squares(x: Array, edges: list[int]) -> float:
    """Return the sum of squared distances from the mean of each part of x between edges."""
    return sum(float(((x[i:k] - x[i:k].mean()) ** 2).sum()) for i, k in pairwise(edges))


def _patterns(x: Array, base: Baseline, rules: Collection[int]) -> list[Alarm]:
    """Return the alarms of Nelson's rules, one for each run of values at which a rule is met."""
    if base.sigma == 0.0:
        return []
    out = []
    for rule, at in nelson((x - base.mean) / base.sigma).items():
        if rule in rules:
            for run in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1):
                size = float(x[run].mean() - base.mean)
                U = 2.0 * base.sigma / float(np.sqrt(run.size))
                out.append(Alarm(str(rule), int(run[0]), int(run[-1]), size, U))
    return out


def nelson(z: Array) -> dict[int, NDArray[np.intp]]:
    """Return rule -> indices of the values that complete its pattern. z (N,): distance from the mean in sigmas."""
    step = np.sign(np.diff(z))
    turning = step[1:] * step[:-1] < 0
    hits = {
        1: np.abs(z) > 3.0,
        2: _run(z > 0, 9, 9) | _run(z < 0, 9, 9),
        3: _shift(_run(step > 0, 5, 5) | _run(step < 0, 5, 5), 1, z.size),
        4: _shift(_run(turning, 12, 12), 2, z.size),
        5: _run(z > 2.0, 2, 3) | _run(z < -2.0, 2, 3),
        6: _run(z > 1.0, 4, 5) | _run(z < -1.0, 4, 5),
        7: _run(np.abs(z) < 1.0, 15, 15),
        8: _run(np.abs(z) > 1.0, 8, 8) & ~(_run(z > 1.0, 8, 8) | _run(z < -1.0, 8, 8)),
    }
    return {rule: at for rule, hit in hits.items() if (at := np.flatnonzero(hit)).size}


def _run(hit: NDArray[np.bool_], wanted: int, window: int) -> NDArray[np.bool_]:
    """Return whether a window that ends here (N,), with a hit at its end, holds at least `wanted` hits."""
    counts = np.convolve(hit.astype(int), np.ones(window, dtype=int))[: hit.size] if hit.size else hit.astype(int)
    return np.asarray(hit & (counts >= wanted))


def _shift(hit: NDArray[np.bool_], by: int, size: int) -> NDArray[np.bool_]:
    """Return hit moved by so many values: a pattern of differences is complete at the value behind the last of them."""
    out = np.zeros(size, dtype=bool)
    out[by : by + hit.size] = hit
    return out


def false_alarm_rate(n: int, baseline_n: int | None = None, nelson_rules: tuple[int, ...] = ()) -> float:
    """Return the share of charts of n normal values in control that hold any alarm, as simulated (seeded).

    baseline_n: values of the baseline before them; None: estimated from the values themselves. Both numbers are rounded
    up to one that is simulated; longer charts ring as often by the two tests, and by rules once more for each stretch.
    """
    length = next((known for known in _LENGTHS if known >= n), _LENGTHS[-1])
    before = None if baseline_n is None else next((k for k in _LENGTHS if k >= baseline_n), _LENGTHS[-1])
    if not nelson_rules:
        return _RATES[before][_LENGTHS.index(length)] / 1000
    rate = simulated_rate(length, before, nelson_rules)
    return rate if n <= length else 1.0 - (1.0 - rate) ** (n / length)


@cache
def simulated_rate(n: int, baseline_n: int | None, nelson_rules: tuple[int, ...]) -> float:
    """Return the share of charts of n values that ring, by simulation, as `false_alarm_rate` has it."""
    rng = np.random.default_rng(20_261_101)
    rang = 0
    for _ in range(_SIMULATED):
        before = None if baseline_n is None else estimate_baseline(rng.standard_normal(baseline_n))
        rang += bool(chart(rng.standard_normal(n), before, nelson_rules).alarms)
    return rang / _SIMULATED
