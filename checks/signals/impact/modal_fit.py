"""Modal frequency and damping with intervals: a local rational fit around each peak of an impact FRF.

A decay cut by the end of a block has the very same pole on the DFT's bins, so truncation does not bias it. The interval
comes from the estimates of the single impacts, so it also holds if the impacts differ in level or place.

H(f) = r/(z - q) + c0 + c1 z + c2 z^2, z = (f - centre)/half: the pole by itself, everything else as a local polynomial
(local rational method: [MG12]; [PS12] 7.3). Started by the linear iteration of [SK63], finished by Gauss-Newton."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.distributions import t as student
from checks.signals.impact.hammer import ImpactFrf
from checks.signals.spectral.poles import FittedRoot
from checks.signals.spectral.recursion import peaks

_HALF_BINS = 8  # at least, each side of the peak: 17 complex bins for 5 complex unknowns
_HALF_WIDTHS = 6.0  # half-power half-widths each side: beyond, a bin carries little information on the pole
_SMOOTH_BINS = 11  # with fewer, bins that happen to scatter little get the weight, and the interval comes out short


@dataclass(frozen=True, eq=False)
class LocalBins:
    """Bins of a fit: z (B,) scaled frequency, H (B,), weight (B,) inverse variance, and the impacts' contributions."""

    f: Array
    z: Array
    centre: float
    half: float
    H: Complex
    weight: Array
    parts: Complex  # (K, B): (Y_k - H F_k) conj(F_k)/S, summing to zero over k
    share: Array  # (K,): of the force's energy in the band


def neighbourhood(frf: ImpactFrf, centre: float, half_width: float) -> LocalBins:
    """Return the bins around a peak at centre [Hz] with this half-power half-width [Hz] that determine its pole."""
    half = max(_HALF_WIDTHS * half_width, _HALF_BINS * frf.df)
    half = min(half, max(0.15 * centre, _HALF_BINS * frf.df))
    return bins_about(frf, centre, min(half, max(_to_neighbour(frf, centre, half), _HALF_BINS * frf.df)))


def bins_about(frf: ImpactFrf, centre: float, half: float) -> LocalBins:
    """Return the bins within half [Hz] of a centre."""
    s = (np.abs(frf.f - centre) <= half) & (frf.f > 0)
    F, Y, H = frf.F[:, s], frf.Y[:, s], frf.H[s]
    power = np.abs(F) ** 2
    S = power.sum(axis=0)
    residual = Y - H * F
    noise = smooth(np.sum(np.abs(_without_gain(residual, H * F)) ** 2, axis=0))
    floor = 1e-12 * np.max(np.abs(Y) ** 2)
    weight = S / np.maximum(noise, floor)
    share = power.sum(axis=1) / power.sum()
    return LocalBins(frf.f[s], (frf.f[s] - centre) / half, centre, half, H, weight, residual * F.conj() / S, share)


def _to_neighbour(frf: ImpactFrf, centre: float, half: float) -> float:
    """Return the distance to the deepest point before a higher peak inside the band; that peak dominates beyond it."""
    near = np.flatnonzero(np.abs(frf.f - centre) <= half)
    k = round(centre / frf.df)
    top = np.max(np.abs(frf.H[max(k - 2, 0) : k + 3]))
    higher = near[(np.abs(near - k) > 2) & (np.abs(frf.H[near]) > 1.2 * top)]
    if higher.size == 0:
        return half
    other = int(higher[np.argmin(np.abs(higher - k))])
    lo, hi = sorted((k, other))
    valley = lo + int(np.argmin(np.abs(frf.H[lo : hi + 1])))
    return abs(valley - k) * frf.df


def _without_gain(residual: Complex, predicted: Complex) -> Complex:
    """Return the residuals (K, B) without the part that is a gain of the impact: a gain moves no pole."""
    power = np.maximum(np.sum(np.abs(predicted) ** 2, axis=1), np.finfo(float).tiny)
    gain = np.sum(residual * predicted.conj(), axis=1) / power
    rest: Complex = residual - gain[:, None] * predicted
    return rest


def smooth(x: Array) -> Array:
    """Return the running mean over a few bins: a variance from few impacts is too rough for weights."""
    kernel = np.ones(_SMOOTH_BINS)
    return np.convolve(x, kernel, "same") / np.convolve(np.ones(x.size), kernel, "same")


def solve_pole(local: LocalBins, order: int) -> Complex | None:
    """Return the unknowns (q, r, c0, c1, ...) of the local model, or None if the pole does not decay."""
    q = _start(local, order)
    q = complex(q.real, abs(q.imag) or 1e-6)
    basis = np.column_stack([1.0 / (local.z - q), local.z[:, None] ** np.arange(order + 1)])
    theta = _gauss_newton(local, np.concatenate([[q], weighted_inverse(basis, local.weight) @ local.H]))
    return theta if np.isfinite(theta).all() and theta[0].imag > 0 else None


def _start(local: LocalBins, order: int) -> complex:
    """Return the pole by the linear iteration: (z - q) H = polynomial of order + 1, divided by the last |z - q|."""
    q = 0j
    root = np.sqrt(local.weight)
    for step in range(4):
        scale = root / np.abs(local.z - q) if step and abs(q.imag) > 1e-9 else root
        A = np.column_stack([local.H, local.z[:, None] ** np.arange(order + 2)])
        q = complex(np.linalg.lstsq(A * scale[:, None], local.z * local.H * scale, rcond=None)[0][0])
    return q


def model(z: Array, theta: Complex) -> Complex:
    """Return the response H (B,) of the unknowns (q, r, c0, c1, ...)."""
    powers = z[:, None] ** np.arange(theta.size - 2)
    H: Complex = theta[1] / (z - theta[0]) + powers @ theta[2:]
    return H


def jacobian(z: Array, theta: Complex) -> Complex:
    """Return (B, P) derivatives of `model` by its unknowns."""
    away = z - theta[0]
    return np.column_stack([theta[1] / away**2, 1.0 / away, z[:, None] ** np.arange(theta.size - 2)])


def weighted_inverse(A: Complex, weight: Array) -> Complex:
    """Return the (P, B) matrix that maps data to weighted least-squares unknowns."""
    root = np.sqrt(weight)
    inverse: Complex = np.asarray(np.linalg.pinv(A * root[:, None]) * root, dtype=np.complex128)
    return inverse


def _gauss_newton(local: LocalBins, theta: Complex) -> Complex:
    """Return the unknowns by Gauss-Newton: the model is analytic in them, so complex least squares suffices."""
    cost = cost_of(local, theta)
    for _ in range(30):
        solve = weighted_inverse(jacobian(local.z, theta), local.weight)
        step = solve @ (local.H - model(local.z, theta))
        factor = 1.0
        while factor > 1e-3 and cost_of(local, theta + factor * step) > cost:
            factor *= 0.5
        if factor <= 1e-3:
            return theta
        theta = theta + factor * step
        cost = cost_of(local, theta)
        if abs(factor * step[0]) < 1e-10:
            return theta
    return theta


def cost_of(local: LocalBins, theta: Complex) -> float:
    """Return the weighted sum of squared residuals."""
    return float(np.sum(local.weight * np.abs(local.H - model(local.z, theta)) ** 2))


def frequency(local: LocalBins, theta: Complex) -> complex:
    """Return the complex frequency p/2 pi j of the pole: real part the damped frequency [Hz], imaginary decay/2 pi."""
    return local.centre + local.half * complex(theta[0])


def scatter(local: LocalBins, influence: Array) -> float:
    """Return the standard error of an estimate from the influence (K,) of each impact on it.

    Each impact's own estimate differs from the mean by influence/share and deserves the weight share, the noise of the
    response being the same for all: exact for normal noise, with K - 1 degrees of freedom."""
    return float(np.sqrt(np.sum(influence**2 / local.share) / (local.share.size - 1)))


_ORDER = 2  # of the local polynomial
_PROMINENCE = 0.3  # in log10: 6 dB
_SEPARATION_Hz = 8.0
_SIGNIFICANT = 4.0  # standard errors
_MISFIT_FACTOR = 2.0  # residual power against the scatter between impacts
_DAMPING_MAX = 0.1  # no joint or frame of a strut damps a tenth of critical: above, it is no mode
_DECAY_BINS = (
    0.02  # half-width of a mode, in bins: with less it loses under 12 % over a block, like a line of the mains
)


@dataclass(frozen=True, eq=False, repr=False)
class Mode(FittedRoot):
    """Mode of an FRF. Its u_* are half of 95 % intervals (t-quantile of the impacts' degrees of freedom), its u_*_model
    0 unless the residual of the fit is above the scatter. peak: |residue|/decay [response per N], u_peak its standard
    error. f, fit: curve."""

    peak: float
    u_peak: float
    pole: complex
    f: Array
    fit: Complex

    @property
    def significant(self) -> bool:
        """Return whether the mode decays, unlike a line of the mains, and stands out of the scatter."""
        damped = 2.0 * self.u_damping < self.damping_ratio < _DAMPING_MAX
        return damped and self.peak > _SIGNIFICANT * self.u_peak and 2.0 * self.u_Hz < 0.02 * self.f_Hz


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
        u_Hz=half_t * scatter(local, natural_moves),
        u_Hz_model=u_f_model,
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
