"""The scale on which values of a process are normal, so that the limits of a chart hold for them.

A size that cannot be below zero, such as flatness, is skewed: limits of a normal distribution ring at good values. A
power of it, or its logarithm, is nearly normal ([Montgomery] 6.4.3).
"""

from dataclasses import replace

import numpy as np

from accept.fleet.process_control.capability import LEAST, NOT_NORMAL, normality
from accept.fleet.process_control.control_chart import GROSS_SIGMAS, Alarm, Baseline, Chart
from accept.fleet.process_control.spread import about_level, robust_sigma
from checks.arrays import Array

AS_MEASURED = ""
NEARLY = 1e-6  # p of the test of normality below which no scale is taken: two populations are normal on no scale
POWERS = {AS_MEASURED: 1.0, "square root": 1 / 2, "cube root": 1 / 3, "logarithm": 0.0}


def scale_of(values: Array) -> str:
    """Return the name of the scale (`POWERS`) on which values (n,) in the order of measurement are most nearly normal
    about their level, gross ones left out; as measured if they are so there, or nearly on none, or some are not above
    zero."""
    p = {AS_MEASURED: _p_normal(values, AS_MEASURED)}
    if p[AS_MEASURED] < NOT_NORMAL:
        p |= {name: _p_normal(values, name) for name in POWERS if name not in p}
    best = max(p, key=lambda name: p[name])
    return best if p[best] >= NEARLY else AS_MEASURED


def scales_of(values: Array) -> tuple[str, ...]:
    """Return the scales on which values may be normal: those that they contradict no more than `scale_of`, or not at
    all. Similar scales differ in their tails: what is gross on one of them alone is a value of a process on another."""
    p = {name: _p_normal(values, name) for name in POWERS}
    least = min(NOT_NORMAL, max(p.values()) / 10.0)
    return tuple(name for name in POWERS if p[name] >= max(least, NEARLY)) or (AS_MEASURED,)


def _p_normal(values: Array, name: str) -> float:
    """Return p of the test that values (n,) are normal about their level on a scale, 0 if that cannot be asked."""
    if values.size < LEAST or values.min() <= 0.0:
        return 0.0
    y = to_scale(values, name)
    apart = about_level(y)
    kept = apart[np.abs(apart) <= GROSS_SIGMAS * robust_sigma(y)]
    return normality(kept) if kept.size >= LEAST and np.ptp(kept) > 0.0 else 0.0


def to_scale(values: Array, name: str) -> Array:
    """Return values on a scale; on others than that of the measurement one of zero or less is that of the smallest
    number."""
    if name == AS_MEASURED:
        return np.asarray(values, dtype=float)
    above = np.maximum(values, np.finfo(float).tiny)
    return np.asarray(np.log(above) if POWERS[name] == 0.0 else above ** POWERS[name])


def from_scale(values: Array, name: str) -> Array:
    """Return values as measured from those on a scale; below the end of a power's scale it is zero."""
    if name == AS_MEASURED:
        return np.asarray(values, dtype=float)
    if POWERS[name] == 0.0:
        return np.asarray(np.exp(values))
    return np.asarray(np.maximum(values, 0.0) ** (1.0 / POWERS[name]))


def as_measured(made: Chart, values: Array, name: str) -> Chart:
    """Return the chart of values (n,) that was made on a scale, with all it states as measured: limits by their
    quantiles, sizes of alarms as distances from the mean of the baseline."""
    if name == AS_MEASURED:
        return made
    mean, sigma = made.baseline.mean, made.baseline.sigma
    middle, low, high = (float(from_scale(np.array(mean + k * sigma), name)) for k in (0.0, -1.0, 1.0))
    base = Baseline(middle, (high - low) / 2.0, made.baseline.n, made.baseline.left_out)

    def of_alarm(alarm: Alarm) -> Alarm:
        size = float(from_scale(np.array(mean + alarm.size), name)) - middle
        return replace(alarm, size=size, U=alarm.U * abs(size / alarm.size)) if alarm.size else alarm

    lower, upper = (float(from_scale(np.array(limit), name)) for limit in (made.lower, made.upper))
    level, alarms = from_scale(made.level, name), tuple(map(of_alarm, made.alarms))
    return Chart(np.asarray(values, dtype=float), base, lower, upper, level, made.sums, made.sums_limit, alarms)
