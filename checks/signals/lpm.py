"""Local polynomial method: the response at every bin of one transform of the whole record, free of leakage.

Pintelon & Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 7.2. About bin k the record obeys
Y(k + r) = G(k + r) U(k + r) + T(k + r) + noise, where G and the transient T are smooth: both are polynomials of r,
fitted by least squares over r = -half..half. The residual gives the noise, hence the variance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from checks.record import Record
from checks.signals.frf import Frf, guarded_covariance, named, power_floor
from checks.signals.segments import Array, Complex

ORDER, HALF = 4, 8
MIN_DOF = 7  # with fewer, F(2, 2 nu) has tails so heavy that a variance says little
BATCH_BINS = 256  # bins solved at once: the work space stays in the cache
DEPENDENT = 1e-20  # share of a regressor's power left by the others, below which it is one of them but for rounding


@dataclass(frozen=True, eq=False)
class _Local:
    """What a fit about one bin needs, the same for every bin.

    off_transient : (2 half + 1, m) orthonormal; its columns are blind to every transient of the order.
    regressors : (order + 1, 2 half + 1) powers of r / half, the constant last, projected by off_transient afterwards.
    """

    off_transient: Array
    regressors: Array
    half: int
    dof: int

    @classmethod
    def of(cls, order: int, half: int) -> "_Local":
        dof = 2 * half + 1 - 2 * (order + 1)
        if order < 0 or dof < MIN_DOF:
            raise ValueError(f"order {order} over +-{half} bins leaves {dof} degrees of freedom; needed: {MIN_DOF}")
        powers = np.vander(np.arange(-half, half + 1) / half, order + 1)
        complement = np.linalg.qr(powers, mode="complete")[0][:, order + 1 :]
        return cls(complement, powers.T, half, dof)


@dataclass(frozen=True, eq=False)
class _Fit:
    """Of B bins: H (B, C), noise covariance (B, C, C), power (B,) of the input that is left to tell H by (0: none),
    weights (B, 2 half + 1) of the neighbours' Y in H."""

    H: Complex
    noise: Complex
    power: Array
    weights: Complex


def lpm(
    u: Array,
    y: Array | Mapping[str, Array],
    fs: float,
    *,
    f_lo: float = 0.0,
    f_hi: float | None = None,
    step: int = 1,
    order: int = ORDER,
    half: int = HALF,
    input: str = "u",
) -> Frf:
    """Responses from u to every channel of y by the local polynomial method, from one record without periodicity.

    u : (N,) noise or sweep; y : (N,), (N, C) or name -> (N,), sampled together at fs [Hz]. Bins of fs/N from f_lo to
    f_hi [Hz], every step-th; the `half` bins next to 0 Hz and to fs/2 have no full neighbourhood and are left out.
    order : of both polynomials. `coherence` is |H|^2 S_uu over itself plus the noise, over the neighbourhood.
    Neighbours share their data: `stride` says how far apart bins are independent (2 half + 1 of the full grid).
    Where u has no power of its own (a periodic u between its lines, a band not driven) the variance is infinite.
    Raises ValueError for unequal lengths, NaN or inf, an empty band, fewer than 7 degrees of freedom.
    """
    outputs = named(y)
    local = _Local.of(order, half)
    spectra = _transform({input: u, **outputs} if input not in outputs else {"": u, **outputs})
    n = len(u)
    bins = _bins(n, fs, f_lo, fs / 2 if f_hi is None else f_hi, step, half)
    batches = [bins[first : first + BATCH_BINS] for first in range(0, bins.size, BATCH_BINS)]
    floor = power_floor(np.abs(spectra[0]) ** 2)
    fits = [_solve(spectra, batch, local, floor) for batch in batches]
    H = np.concatenate([fit.H for fit in fits])
    noise = np.concatenate([fit.noise for fit in fits])
    power = np.concatenate([fit.power for fit in fits])
    powered = power > 0.0
    cov = np.divide(noise, np.where(powered, power, 1.0)[:, None, None], dtype=complex)
    return Frf(
        f=bins * (fs / n),
        H=H,
        channels=tuple(outputs),
        input=input,
        coherence=_quality(H, noise, _local_mean(np.abs(spectra[0]) ** 2, half)[bins]),
        cov=guarded_covariance(cov, powered),
        nu=np.full(bins.shape, float(local.dof)),
        correlation=_correlation(fits[0].weights, step),
        estimator="lpm",
        notes=(f"local polynomials of order {order} over +-{half} bins of {fs / n:.4g} Hz",),
    )


def lpm_record(record: Record, input: str, outputs: Sequence[str], f_lo: float, f_hi: float, step: int = 1) -> Frf:
    """`lpm` of channels of a record, order and window at their defaults. RecordError: a channel is not there."""
    columns = {name: record[name] for name in outputs}
    return lpm(record[input], columns, record.fs, f_lo=f_lo, f_hi=f_hi, step=step, input=input)


def _transform(columns: Mapping[str, Array]) -> Complex:
    """(1 + C, N//2 + 1) transforms of the channels without their mean."""
    sizes = {name: np.shape(c) for name, c in columns.items()}
    if len(set(sizes.values())) != 1 or any(len(s) != 1 for s in sizes.values()):
        raise ValueError(f"expected channels of one equal length, got shapes {sizes}")
    for name, c in columns.items():
        if not np.isfinite(c).all():
            raise ValueError(f"channel '{name}' holds NaN or inf, first at sample {int(np.argmin(np.isfinite(c)))}")
    return np.array([scipy.fft.rfft(c - np.mean(c)) for c in columns.values()])


def _bins(n: int, fs: float, f_lo: float, f_hi: float, step: int, half: int) -> np.ndarray:
    if not (np.isfinite(fs) and fs > 0 and step >= 1):
        raise ValueError(f"sampling frequency {fs} Hz and step {step}: expected positive numbers")
    # Bin 0 is left out of every neighbourhood: its offset is no response to the input.
    first = max(half + 1, int(np.ceil(f_lo * n / fs - 1e-9)))
    last = min((n - 1) // 2 - half, int(np.floor(f_hi * n / fs + 1e-9)))
    if last < first:
        raise ValueError(f"no bin of {fs / n:.4g} Hz with {half} neighbours on both sides in {f_lo:g}..{f_hi:g} Hz")
    return np.arange(first, last + 1, step)


def _solve(spectra: Complex, bins: np.ndarray, local: _Local, floor: float) -> _Fit:
    """Least squares about each bin by modified Gram-Schmidt, vectorised over the bins.

    The constant of G is the last regressor, so that its coefficient is H at once, and what is left of it after the
    others is the power that tells H. With the outputs as further columns the solution is backward stable (Bjorck 1967).
    """
    near = spectra[:, bins + np.arange(-local.half, local.half + 1)[:, None]]  # (1 + C, 2 half + 1, B)
    regressors = local.regressors[:, :, None] * near[0]
    both = np.concatenate([regressors, near[1:]])
    columns = (local.off_transient.T @ both.view(float)).view(complex)  # (order + 1 + C, m, B)
    last = len(local.regressors) - 1
    powered = np.ones(bins.size, dtype=bool)
    for s in range(last + 1):
        q, rest = columns[s], columns[s + 1 :]
        power = _power(q)
        whole = _power(regressors[s])
        powered &= (power > DEPENDENT * whole) & (whole > floor)
        coefficient = np.einsum("mb,jmb->jb", q.conj(), rest) / np.where(powered, power, 1.0)
        rest -= coefficient[:, None] * q
    E = columns[last + 1 :]
    weights = (local.off_transient @ columns[last].conj()) / np.where(powered, power, 1.0)
    return _Fit(
        H=np.where(powered, coefficient, 0.0).T,
        noise=np.einsum("cmb,dmb->bcd", E, E.conj()) / local.dof,
        power=np.where(powered, power, 0.0),
        weights=np.where(powered, weights, 0.0).T,
    )


def _power(x: Complex) -> Array:
    """(B,) sum of |x|^2 over the rows of x (m, B)."""
    return np.einsum("mb,mb->b", x.real, x.real) + np.einsum("mb,mb->b", x.imag, x.imag)


def _local_mean(x: Array, half: int) -> Array:
    return np.convolve(x, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="same")


def _quality(H: Complex, noise: Complex, Suu: Array) -> Array:
    signal = np.abs(H) ** 2 * Suu[:, None]
    total = signal + np.einsum("fcc->fc", noise).real
    return np.where(total > 0.0, signal / np.where(total > 0.0, total, 1.0), 0.0)


def _correlation(weights: Complex, step: int) -> tuple[float, ...]:
    """Mean correlation of the errors of bins 1, 2, ... places apart whose weights (B, 2 half + 1) are given."""
    power = np.sqrt(np.sum(np.abs(weights) ** 2, axis=1))
    unit = weights / np.where(power > 0.0, power, 1.0)[:, None]
    places = range(1, (weights.shape[1] - 1) // step + 1)
    lags = [(d, d * step) for d in places if d < len(unit)]
    return tuple(float(np.mean(np.sum(unit[:-d, lag:] * unit[d:, :-lag].conj(), axis=1)).real) for d, lag in lags)
