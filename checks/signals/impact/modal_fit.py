"""Modal frequency and damping with intervals: a local rational fit around each peak of an impact FRF.

A decay cut by the end of a block has the very same pole on the DFT's bins, so truncation does not bias it. The interval
comes from the estimates of the single impacts, so it also holds if the impacts differ in level or place."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.distributions import t as student
from checks.rounding import with_U
from checks.signals.impact.hammer import ImpactFrf
from checks.signals.impact.local_rational import (
    LocalBins,
    bins_about,
    cost_of,
    frequency,
    jacobian,
    model,
    neighbourhood,
    scatter,
    smooth,
    solve_pole,
    weighted_inverse,
)
from checks.signals.spectral.recursion import peaks
from checks.signals.spectral.resonance import U_CLOCK

_ORDER = 2  # of the local polynomial
_PROMINENCE = 0.3  # in log10: 6 dB
_SEPARATION_Hz = 8.0
_SIGNIFICANT = 4.0  # standard errors
_MISFIT_FACTOR = 2.0  # residual power against the scatter between impacts
_DAMPING_MAX = 0.1  # no joint or frame of a strut damps a tenth of critical: above, it is no mode
_DECAY_BINS = (
    0.02  # half-width of a mode, in bins: with less it loses under 12 % over a block, like a line of the mains
)


@dataclass(frozen=True, eq=False)
class Mode:
    """Mode of an FRF. f_Hz: undamped natural frequency |p|/2 pi; damping_ratio -Re p/|p|; both with u_*, half of their
    95 % interval (t-quantile of the impacts' degrees of freedom), from scatter, and u_*_model, from the local
    polynomial if the residual of the fit is above the scatter. peak: |residue|/decay [response per N], u_peak its
    standard error. f, fit: curve."""

    f_Hz: float
    u_f_Hz: float
    u_f_model_Hz: float
    damping_ratio: float
    u_damping: float
    u_damping_model: float
    peak: float
    u_peak: float
    pole: complex
    f: Array
    fit: Complex

    def __repr__(self) -> str:
        U, U_damping = (
            2.0 * np.hypot(self.u_f_Hz, self.u_f_model_Hz),
            2.0 * np.hypot(self.u_damping, self.u_damping_model),
        )
        return f"Mode({with_U(self.f_Hz, U)} Hz, damping ratio {with_U(self.damping_ratio, U_damping)}; k = 2)"

    @property
    def U_Hz(self) -> float:
        """Return U of the frequency [Hz] (k = 2): scatter between hits, model, and the clock."""
        return math.hypot(2.0 * math.hypot(self.u_f_Hz, self.u_f_model_Hz), U_CLOCK * self.f_Hz)

    @property
    def U_damping(self) -> float:
        """Return U of the damping ratio (k = 2): scatter between hits and model."""
        return 2.0 * math.hypot(self.u_damping, self.u_damping_model)

    @property
    def significant(self) -> bool:
        """Return whether the mode decays, unlike a line of the mains, and stands out of the scatter."""
        damped = 2.0 * self.u_damping < self.damping_ratio < _DAMPING_MAX
        return damped and self.peak > _SIGNIFICANT * self.u_peak and 2.0 * self.u_f_Hz < 0.02 * self.f_Hz


def find_modes(
    frf: ImpactFrf, band_Hz: tuple[float, float], floor: float = 0.01, separation_Hz: float = _SEPARATION_Hz
) -> tuple[Mode, ...]:
    """Return the modes of an impact FRF inside band_Hz, by frequency; peaks below `floor` times the highest are left
    out, of peaks within separation_Hz all but the highest."""
    fitted = (fit_mode(frf, frf.f[k]) for k in _peaks(frf, band_Hz, floor, separation_Hz))
    slowest = _DECAY_BINS * frf.df
    modes = [m for m in fitted if m is not None and m.significant and m.damping_ratio * m.f_Hz > slowest]
    return tuple(
        sorted(_distinct([m for m in modes if band_Hz[0] <= m.f_Hz <= band_Hz[1]], separation_Hz), key=lambda m: m.f_Hz)
    )


def _peaks(frf: ImpactFrf, band_Hz: tuple[float, float], floor: float, separation_Hz: float) -> NDArray[np.intp]:
    inside = np.flatnonzero((band_Hz[0] <= frf.f) & (frf.f <= band_Hz[1]))
    if inside.size < 3:
        return inside[:0]
    magnitude = np.abs(frf.H[inside])
    noise = np.sqrt(smooth(frf.var[inside]))
    distance = max(round(separation_Hz / frf.df), 3)
    found = peaks(np.log10(np.maximum(magnitude, 1e-300)), _PROMINENCE, distance)
    strong = (magnitude[found] > floor * magnitude.max()) & (magnitude[found] > 3.0 * noise[found])
    kept: NDArray[np.intp] = inside[found[strong & frf.driven[inside[found]]]]
    return kept


def _distinct(modes: list[Mode], separation_Hz: float) -> list[Mode]:
    """Return the modes without duplicates: peaks of noise on one mode give the same pole; the stronger fit stays."""
    kept: list[Mode] = []
    for m in sorted(modes, key=lambda m: -m.peak):
        if all(abs(m.f_Hz - k.f_Hz) > 0.5 * separation_Hz for k in kept):
            kept.append(m)
    return kept


def fit_mode(frf: ImpactFrf, near_Hz: float) -> Mode | None:
    """Return the mode at the peak next to near_Hz; None if no decaying pole fits in the band.

    Two passes: the first finds the width of the peak, the second takes as many bins as that width deserves."""
    rough = _pole_near(frf, near_Hz, _half_power_half_width(frf, near_Hz))
    if rough is None:
        return None
    at = frequency(*rough)
    fine = _pole_near(frf, at.real, at.imag)
    return None if fine is None else _mode(frf, *fine)


def _pole_near(frf: ImpactFrf, centre: float, half_width: float) -> tuple[LocalBins, Complex] | None:
    local = neighbourhood(frf, centre, half_width)
    theta = solve_pole(local, _ORDER)
    return None if theta is None or abs(theta[0].real) > 1.0 else (local, theta)


def amplitude_at(frf: ImpactFrf, mode: Mode) -> tuple[float, float]:
    """Return the peak amplitude |residue|/decay of a mode's pole in another FRF, and its standard error [per N].

    The band is that of the mode's fit: if the other FRF does not show the mode, a peak of noise would cut the band to
    less than its width, where pole and polynomial are indistinguishable."""
    natural = mode.pole / (2j * np.pi)
    half = max(float(np.max(np.abs(mode.f - natural.real))), 8.0 * frf.df)
    local = bins_about(frf, natural.real, half)
    q = (natural + 1j * frf.added_decay / (2 * np.pi) - local.centre) / local.half
    basis = np.column_stack([1.0 / (local.z - q), local.z[:, None] ** np.arange(_ORDER + 1)])
    solve = weighted_inverse(basis, local.weight)
    gain = local.half / abs(natural.imag)
    return gain * abs((solve @ local.H)[0]), gain * scatter(local, np.abs(solve @ local.parts.T)[0])


def _half_power_half_width(frf: ImpactFrf, near_Hz: float) -> float:
    k = round(near_Hz / frf.df)
    low = np.abs(frf.H) < np.abs(frf.H[k]) / np.sqrt(2.0)
    right, left = np.flatnonzero(low[k:]), np.flatnonzero(low[k::-1])
    sides = [int(s[0]) for s in (right, left) if s.size]
    return min(sides, default=1) * frf.df


def _mode(frf: ImpactFrf, local: LocalBins, theta: Complex) -> Mode | None:
    pole = 2j * np.pi * frequency(local, theta) + frf.added_decay
    if pole.real >= 0.0:
        return None
    influences = weighted_inverse(jacobian(local.z, theta), local.weight) @ local.parts.T
    moves = 2j * np.pi * local.half * influences[0]
    natural_moves = np.real(np.conj(pole) * moves) / abs(pole) / (2 * np.pi)
    damping_moves = -moves.real / abs(pole) + pole.real * np.real(np.conj(pole) * moves) / abs(pole) ** 3
    half_t = 0.5 * float(student.ppf(0.975, frf.count - 1))
    u_f_model, u_damping_model = _model_error(frf, local, theta, pole)
    gain = local.half / (-pole.real / (2 * np.pi))
    return Mode(
        f_Hz=_natural_Hz(pole),
        u_f_Hz=half_t * scatter(local, natural_moves),
        u_f_model_Hz=u_f_model,
        damping_ratio=_damping(pole),
        u_damping=half_t * scatter(local, damping_moves),
        u_damping_model=u_damping_model,
        peak=gain * abs(theta[1]),
        u_peak=gain * scatter(local, np.abs(influences[1])),
        pole=pole,
        f=local.f,
        fit=model(local.z, theta),
    )


def _model_error(frf: ImpactFrf, local: LocalBins, theta: Complex, pole: complex) -> tuple[float, float]:
    """Return the shift of (frequency, damping) with one more order, 0 if the residual is within the scatter."""
    freedom = local.z.size - theta.size
    if cost_of(local, theta) * (frf.count - 1) < _MISFIT_FACTOR * freedom:
        return 0.0, 0.0
    finer = solve_pole(local, _ORDER + 1)
    if finer is None:
        return np.inf, np.inf
    other = 2j * np.pi * frequency(local, finer) + frf.added_decay
    return abs(_natural_Hz(other) - _natural_Hz(pole)), abs(_damping(other) - _damping(pole))


def _natural_Hz(pole: complex) -> float:
    return abs(pole) / (2 * np.pi)


def _damping(pole: complex) -> float:
    return -pole.real / abs(pole)
