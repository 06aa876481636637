"""Parameters that several effects have: corners of filters, modes, delays, each with its bounds and its grid."""

import math

from checks.gap.modelling.effect import Parameter, spread


def corner_of_lag(target: str, highest_Hz: float, places: int) -> Parameter:
    """Return the corner of a lag, which does nothing far above the band. highest_Hz, places: of its grid."""
    grid = spread(400.0, highest_Hz, places)
    return Parameter("f_Hz", lo=50.0, hi=200_000.0, off=math.inf, start=5000.0, scale=300.0, sets=(target,), grid=grid)


def corner_of_highpass(target: str) -> Parameter:
    """Return the corner of a high-pass, which does nothing at zero."""
    return Parameter("f_Hz", lo=0.0, hi=500.0, start=2.0, scale=0.2, sets=(target,), grid=spread(0.1, 100.0, 13))


def damping_of_filter(target: str, start: float) -> Parameter:
    """Return the damping ratio of a filter of second order."""
    return Parameter(
        "damping_ratio",
        lo=5e-3,
        hi=0.99,
        off=0.7,
        start=start,
        scale=0.05,
        sets=(target,),
        grid=(0.3, 0.8),
        limit_at=0.7,
    )


def frequency_of_mode(target: str, usual_Hz: float) -> Parameter:
    """Return the frequency of a mode beside the strut's own. usual_Hz: where a fit begins."""
    grid, at = spread(15.0, 1500.0, 40), usual_Hz
    return Parameter("f_Hz", lo=10.0, hi=1800.0, off=at, start=at, scale=1.0, sets=(target,), grid=grid, limit_at=at)


def damping_of_mode(target: str) -> Parameter:
    """Return its damping ratio."""
    grid = (0.006, 0.02)
    return Parameter(
        "damping_ratio", lo=5e-4, hi=0.3, off=0.01, start=0.015, scale=0.005, sets=(target,), grid=grid, limit_at=0.01
    )


def delay(target: str, *longest_us: float) -> Parameter:
    """Return a delay. longest_us: of its grid."""
    grid = (-100.0, 0.0, 30.0, 100.0, *longest_us)
    return Parameter("tau_us", lo=-500.0, hi=5000.0, scale=5.0, sets=(target,), grid=grid)
