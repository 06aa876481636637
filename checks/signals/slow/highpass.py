"""First-order high-pass between two slowly swept signals, fitted in the time domain."""

import math
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array
from checks.signals.slow.loops import ScalarEstimate
from checks.signals.slow.regression import least_squares
from checks.signals.spectral.recursion import recursion, smooth_lowpass

PER_TOP = 20  # samples kept per period of the highest frequency used
MIN_SAMPLES = 200  # one second at the 200 Hz that such records have
TRIALS = 20  # over the logarithm of the range: neighbours so close that one minimum lies between them
LOWEST_PERIODS = 0.2  # a corner below this over the length of the record is a drift, not a corner
EDGE_PERIODS = 3.0  # of the highest frequency, cut off at each end where the filter has started and stopped


@dataclass(frozen=True, eq=False)
class HighPass:
    """Fit of y = (g + a s + b s^2) s/(s + w) u + offset + drift + decay of the state at the start.

    corner : w / 2 pi [Hz]; terms : (g, a, b) in the unit of y per unit of u, times s, times s^2; unexplained : share of
    the variance of y that is left; at_edge : whether the best corner lies at an end of the range that was tried; t, y,
    model : (N,)."""

    corner: ScalarEstimate
    terms: tuple[float, float, float]
    unexplained: float
    at_edge: bool
    t: Array
    y: Array
    model: Array

    def response(self, f: Array) -> Array:
        """Return the complex response (F,) at f (F,) [Hz]."""
        s = 2j * np.pi * f
        g, a, b = self.terms
        return np.asarray((g + a * s + b * s * s) * s / (s + 2 * np.pi * self.corner.value))


def fit_highpass(t: Array, u: Array, y: Array, top_Hz: float) -> HighPass:
    """Return the least-squares corner of the high-pass from u (N,) to y (N,), uniformly sampled at t (N,) [s].

    Both are low-passed to `top_Hz` by the same filter, which does not change their relation. The first and second
    derivative of u stand for delay and for the resonances far above, to second order in frequency. For each corner the
    rest is linear (variable projection: [GP73]), so the search is along one axis. There is no leakage in the time
    domain, and the state at the start of the record is a parameter. Raises ValueError if too little is left of the
    record."""
    t, u, y = _band(t, u, y, top_Hz)
    size_u, size_y = float(np.ptp(u)), float(np.ptp(y))
    if size_u == 0.0 or size_y == 0.0:
        raise ValueError(f"nothing moves below {top_Hz:g} Hz")
    u, y = u / size_u, y / size_y
    lo, hi = LOWEST_PERIODS / (t[-1] - t[0]), top_Hz / 2

    def left(log_corner: float) -> float:
        design = _design(t, u, math.exp(log_corner))
        gram = design.T @ design  # normal equations are ten times faster, and sound when scaled
        scale = 1 / np.sqrt(np.diag(gram))
        scaled = np.linalg.lstsq(gram * np.outer(scale, scale), scale * (design.T @ y), rcond=None)[0]
        residual = y - design @ (scale * scaled)
        return float(residual @ residual)

    grid = np.linspace(math.log(lo), math.log(hi), TRIALS)
    best = int(np.argmin([left(x) for x in grid]))
    bracket = grid[max(best - 1, 0)], grid[min(best + 1, TRIALS - 1)]
    from scipy.optimize import minimize_scalar  # loads slowly: only when wanted

    found = minimize_scalar(left, bounds=bracket, method="bounded", options={"xatol": 1e-6})
    corner = math.exp(float(found.x))
    design = _design(t, u, corner)
    fit = least_squares(design, y)
    # One more column, the derivative by log corner, gives its uncertainty together with that of all the others.
    step = 1e-4
    slope = (_design(t, u, corner * (1 + step)) - _design(t, u, corner * (1 - step))) @ fit.x / (2 * step)
    joint = least_squares(np.column_stack([design, slope]), y)
    u_relative = joint.u(np.eye(joint.x.size)[-1])
    unexplained = float(fit.residual @ fit.residual / ((y - y.mean()) @ (y - y.mean())))
    g, a, b = (float(x) * (size_y / size_u) for x in fit.x[:3])
    at_edge = best in (0, TRIALS - 1)
    found_corner = ScalarEstimate(corner, corner * u_relative)
    return HighPass(found_corner, (g, a, b), unexplained, at_edge, t, y * size_y, design @ fit.x * size_y)


def _band(t: Array, u: Array, y: Array, top_Hz: float) -> tuple[Array, Array, Array]:
    """Return time, u and y low-passed to top_Hz, without the edges, at about PER_TOP samples per period."""
    if t.size < MIN_SAMPLES:
        raise ValueError(f"{t.size} samples are too short a record, {MIN_SAMPLES} are needed")
    fs = (t.size - 1) / (t[-1] - t[0])
    if fs > 2.5 * top_Hz:
        u, y = smooth_lowpass(u, fs, top_Hz), smooth_lowpass(y, fs, top_Hz)
    every = max(1, int(fs / (PER_TOP * top_Hz)))
    edge = int(EDGE_PERIODS * fs / top_Hz)
    kept = slice(edge, t.size - edge, every)
    if t[kept].size < MIN_SAMPLES:
        raise ValueError(f"the record of {t[-1] - t[0]:.3g} s is too short for a high-pass below {top_Hz:g} Hz")
    return t[kept], u[kept], y[kept]


def _design(t: Array, u: Array, corner: float) -> Array:
    """Return the columns (N, 6) of the linear part for one corner [Hz]."""
    dt = (t[-1] - t[0]) / (t.size - 1)
    h = 2 * math.pi * corner * dt
    a, mean = math.exp(-h), -math.expm1(-h) / h
    # s/(s + w) = 1 - w/(s + w), the latter exact for a drive that runs straight from sample to sample; how a smooth one
    # bulges above its chords goes into the second derivative.
    drive = u - u[0]
    passed = drive - recursion([1 - mean, mean - a], [1.0, -a], drive)
    rate = np.gradient(passed, dt)
    after = t - t[0]
    decay = np.exp(-2 * math.pi * corner * after)
    return np.column_stack([passed, rate, np.gradient(rate, dt), np.ones_like(t), after - after.mean(), decay])
