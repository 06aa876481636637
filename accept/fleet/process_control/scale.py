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
POWERS = {AS_MEASURED: 1.0, "square root": 1 / 2, "cube root": 1 / 3, "logarithm": 0.0}


def scale_of(values: Array) -> str:
    """Return the name of the scale (`POWERS`) on which values (n,) in the order of measurement are normal about their
    level, gross ones left out; as measured if they are so there, or on no scale, or some are not above zero."""
    x = np.asarray(values, dtype=float)
    if x.size < LEAST or x.min() <= 0.0:
        return AS_MEASURED
    for name in POWERS:
        y = to_scale(x, name)
        apart = about_level(y)
        kept = apart[np.abs(apart) <= GROSS_SIGMAS * robust_sigma(y)]
        if kept.size >= LEAST and np.ptp(kept) > 0.0 and normality(kept) >= NOT_NORMAL:
            return name
    return AS_MEASURED


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
