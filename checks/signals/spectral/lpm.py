"""Local polynomial method: the response at every bin of one transform of the whole record, free of leakage.

[PS12] 7.2. About bin k the record obeys Y(k + r) = G(k + r) U(k + r) + T(k + r) + noise, where G and the transient T
are smooth: both are polynomials of r, fitted by least squares over r = -half..half. The residual gives the noise, hence
the variance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.record import Record
from checks.signals.spectral.frf import Frf, guarded_covariance, named, power_floor

Bins = NDArray[np.intp]

ORDER, HALF = 4, 8  # of the polynomials, and bins on either side: 17 bins for 10 unknowns leave 7 to estimate the noise
MIN_DOF = 7  # with fewer, F(2, 2 nu) has tails so heavy that a variance says little
BATCH_BINS = 256  # bins solved at once: the work space stays in the cache
DEPENDENT = 1e-20  # share of a regressor's power left by the others, below which it is one of them but for rounding


@dataclass(frozen=True, eq=False)
class LocalRegression:
    """What a fit about one bin needs, the same for every bin.

    off_transient : (2 half + 1, m) orthonormal; its columns are blind to every transient of the order.
    regressors : (order + 1, 2 half + 1) powers of r / half, the constant last, projected by off_transient afterwards.
    """

    off_transient: Array
    regressors: Array
    half: int
    dof: int

    @classmethod
    def of(cls, order: int, half: int) -> "LocalRegression":
        dof = 2 * half + 1 - 2 * (order + 1)
        if order < 0 or dof < MIN_DOF:
            raise ValueError(f"order {order} over +-{half} bins leaves {dof} degrees of freedom; needed: {MIN_DOF}")
        powers = np.vander(np.arange(-half, half + 1) / half, order + 1)
        complement = np.linalg.qr(powers, mode="complete")[0][:, order + 1 :]
        return cls(complement, powers.T, half, dof)


@dataclass(frozen=True, eq=False)
class LocalPolynomialFit:
    """Of B bins: H (B, C), noise covariance (B, C, C), power (B,) of the input that is left to tell H by (0: none),
    and of some neighbouring bins the weights (b, 2 half + 1) of the neighbours' Y in H."""

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
    problem = LpmTransforms.of(u, y, fs, f_lo, f_hi, step, input)
    local = LocalRegression.of(order, half)
    bins = problem.bins(half)
    found = problem.fit(bins, local)
    note = f"local polynomials of order {order} over +-{half} bins of {fs / len(u):.4g} Hz"
    return problem.frf(bins, found, np.full(bins.shape, float(local.dof)), half, "lpm", note)


def lpm_record(record: Record, input: str, outputs: Sequence[str], f_lo: float, f_hi: float, step: int = 1) -> Frf:
    """`lpm` of channels of a record, order and window at their defaults. RecordError: a channel is not there."""
    columns = {name: record[name] for name in outputs}
    return lpm(record[input], columns, record.fs, f_lo=f_lo, f_hi=f_hi, step=step, input=input)


@dataclass(frozen=True, eq=False)
class LpmTransforms:
    """Transforms (1 + C, N // 2 + 1) of a record, input first, and the bins where the response is wanted."""

    spectra: Complex
    input: str
    channels: tuple[str, ...]
    n: int
    fs: float
    first: int
    last: int
    step: int

    @classmethod
    def of(
        cls,
        u: Array,
        y: Array | Mapping[str, Array],
        fs: float,
        f_lo: float,
        f_hi: float | None,
        step: int,
        input: str,
    ) -> "LpmTransforms":
        if not (np.isfinite(fs) and fs > 0 and step >= 1):
            raise ValueError(f"sampling frequency {fs} Hz and step {step}: expected positive numbers")
        outputs = named(y)
        if not outputs:
            raise ValueError("no output channel given")
        first = int(np.ceil(f_lo * len(u) / fs - 1e-9))
        last = int(np.floor((fs / 2 if f_hi is None else f_hi) * len(u) / fs + 1e-9))
        spectra = _transform([(input, u), *outputs.items()])
        return cls(spectra, input, tuple(outputs), len(u), fs, first, last, step)

    def bins(self, half: int) -> Bins:
        """Wanted bins that have `half` neighbours on both sides. ValueError: there is none."""
        # Bin 0 is left out of every neighbourhood: its offset is no response to the input.
        lo, hi = max(half + 1, self.first), min((self.n - 1) // 2 - half, self.last)
        if hi < lo:
            df = self.fs / self.n
            band = f"{self.first * df:g}..{self.last * df:g} Hz"
            raise ValueError(f"no bin of {df:.4g} Hz in {band} has {half} neighbours on both sides")
        return np.arange(lo, hi + 1, self.step)

    def fit(self, bins: Bins, local: LocalRegression) -> LocalPolynomialFit:
        """The fit about every one of the bins (B,)."""
        floor = power_floor(np.abs(self.spectra[0]) ** 2)
        cuts = range(0, bins.size, BATCH_BINS)
        fits = [_solve(self.spectra, bins[first : first + BATCH_BINS], local, floor) for first in cuts]
        return LocalPolynomialFit(
            H=np.concatenate([fit.H for fit in fits]),
            noise=np.concatenate([fit.noise for fit in fits]),
            power=np.concatenate([fit.power for fit in fits]),
            weights=fits[0].weights,
        )

    def frf(self, bins: Bins, found: LocalPolynomialFit, nu: Array, half: int, estimator: str, note: str) -> Frf:
        """The response at the bins (B,) with degrees of freedom nu (B,)."""
        powered = found.power > 0.0
        cov = np.divide(found.noise, np.where(powered, found.power, 1.0)[:, None, None], dtype=complex)
        return Frf(
            f=bins.astype(float) * (self.fs / self.n),
            H=found.H,
            channels=self.channels,
            input=self.input,
            coherence=_quality(found.H, found.noise, _local_mean(np.abs(self.spectra[0]) ** 2, half)[bins]),
            cov=guarded_covariance(cov, powered),
            nu=nu,
            correlation=_correlation(found.weights, self.step),
            estimator=estimator,
            notes=(note,),
        )


def _transform(columns: Sequence[tuple[str, Array]]) -> Complex:
    """(1 + C, N // 2 + 1) transforms of the channels without their mean."""
    sizes = {name: np.shape(c) for name, c in columns}
    if len(set(sizes.values())) != 1 or any(len(s) != 1 for s in sizes.values()):
        raise ValueError(f"expected channels of one equal length, got shapes {sizes}")
    for name, c in columns:
        if not np.isfinite(c).all():
            raise ValueError(f"channel '{name}' holds NaN or inf, first at sample {int(np.argmin(np.isfinite(c)))}")
    return np.array([scipy.fft.rfft(c - np.mean(c)) for _, c in columns])


def _solve(spectra: Complex, bins: Bins, local: LocalRegression, floor: float) -> LocalPolynomialFit:
    """Least squares about each bin by modified Gram-Schmidt, vectorised over the bins.

    The constant of G is the last regressor, so that its coefficient is H at once, and what is left of it after the
    others is the power that tells H. With the outputs as further columns the solution is backward stable ([BJORCK67]).
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
    return LocalPolynomialFit(
        H=np.where(powered, coefficient, 0.0).T,
        noise=np.einsum("cmb,dmb->bcd", E, E.conj()) / local.dof,
        power=np.where(powered, power, 0.0),
        weights=np.where(powered, weights, 0.0).T,
    )


def _power(x: Complex) -> Array:
    """(B,) sum of |x|^2 over the rows of x (m, B)."""
    power: Array = np.einsum("mb,mb->b", x.real, x.real) + np.einsum("mb,mb->b", x.imag, x.imag)
    return power


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
