"""Local polynomial method: the response at every bin of one transform of the whole record, free of leakage.

[PS12] 7.2. About bin k the record obeys Y(k + r) = G(k + r) U(k + r) + T(k + r) + noise, where G and the transient T
are smooth: both are polynomials of r, fitted by least squares over r = -half..half. The residual gives the noise, hence
the variance. The least squares about many bins are solved at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.record import Record
from checks.signals.spectral.frf import Frf, guarded_covariance, named, power_floor
from checks.signals.spectral.transform import transform
from checks.signals.spectral.transient import is_transient

MIN_DOF = 7  # with fewer, F(2, 2 nu) has tails so heavy that a variance is of little use
BATCH_BINS = 768  # bins solved at once: fewer cost more in calls, more in memory far from the core
WHOLE_BINS = 16  # batches are filled up to a multiple: the last digit of a bin must not depend on where its batch ends
SAMPLED_BINS = 256  # of the first ones the correlation of neighbours is taken
DEPENDENT = 1e-20  # share of a regressor's power left by the others, below which it is one of them but for rounding


@dataclass(frozen=True, eq=False)
class LocalRegression:
    """Regressors of a fit about one bin, the same for every bin.

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
    """Fits about B bins: H (B, C), its covariance (B, C, C), infinite if H is not determined, coherence (B, C), and of
    the first ones the weights (b, 2 half + 1) of their neighbours' Y in H. own (B,): share of the input's power about
    each bin that neither a transient nor the other regressors can have, which determines H; its inverse square root is
    the condition number."""

    H: Complex
    cov: Complex
    coherence: Array
    weights: Complex
    own: Array

    @classmethod
    def empty(cls, bins: int, channels: int, neighbours: int) -> "LocalPolynomialFit":
        """Return an empty fit, to be filled batch by batch; channel by channel in memory, in the order of use."""
        return cls(
            H=np.empty((channels, bins), dtype=complex).T,
            cov=np.empty((channels, channels, bins), dtype=complex).transpose(2, 0, 1),
            coherence=np.empty((channels, bins)).T,
            weights=np.empty((min(bins, SAMPLED_BINS), neighbours), dtype=complex),
            own=np.empty(bins),
        )

    def batch(self, bins: slice) -> "LocalPolynomialFit":
        return LocalPolynomialFit(
            self.H[bins], self.cov[bins], self.coherence[bins], self.weights[bins], self.own[bins]
        )


def fitted(near: Complex, local: LocalRegression, floor: float) -> LocalPolynomialFit:
    """Return the fit about every bin: near (1 + C, 2 half + 1, B) has the transforms of input and outputs there.

    floor : power of the input over a neighbourhood below which it does not determine the response."""
    channels, points, B = len(near) - 1, near.shape[1], near.shape[2]
    found = LocalPolynomialFit.empty(B, channels, points)
    work = _work_space(local, channels, min(_filled(B), BATCH_BINS))
    for first in range(0, B, BATCH_BINS):
        batch = slice(first, first + BATCH_BINS)
        _solve(near[:, :, batch], local, floor, work, found.batch(batch))
    return found


def _filled(bins: int) -> int:
    return -(-bins // WHOLE_BINS) * WHOLE_BINS


def _work_space(local: LocalRegression, channels: int, bins: int) -> tuple[Complex, ...]:
    """Return arrays for regressors, then for outputs: whole (order + 1 + C, 2 half + 1, B), off the transient (order +
    1 + C, m, B), products of that shape, a conjugate (m, B). They serve every batch: fresh pages cost as much as the
    computation."""
    points, m = local.off_transient.shape
    number = len(local.regressors) + channels
    shapes = ((number, points, bins), (number, m, bins), (number, m, bins), (m, bins))
    return tuple(np.zeros(shape, dtype=complex) for shape in shapes)


def _solve(
    near: Complex, local: LocalRegression, floor: float, work: tuple[Complex, ...], found: LocalPolynomialFit
) -> None:
    """Solve least squares about each bin by modified Gram-Schmidt, vectorised over the bins; fills `found`.

    near : (1 + C, 2 half + 1, B) transforms about each bin. The constant of G is the last regressor, so that its
    coefficient is H at once, and its remainder after the others is the power that determines H. With the outputs as
    further columns the solution is backward stable ([BJORCK67])."""
    B, order = near.shape[2], len(local.regressors) - 1
    whole, columns, products, conjugate = (x[..., : _filled(B)] for x in work)
    whole[order + 1 :, :, :B] = near[1:]
    np.multiply(local.regressors[:, :, None], near[0], out=whole[: order + 1, :, :B])
    whole[:, :, B:] = 0.0
    np.matmul(local.off_transient.T, whole.view(float), out=columns.view(float))
    powered = np.ones(whole.shape[2], dtype=bool)
    for s in range(order + 1):
        q, rest, product = columns[s], columns[s + 1 :], products[s + 1 :]
        power, undiminished = _power(q), _power(whole[s])
        powered &= (power > DEPENDENT * undiminished) & (undiminished > floor)
        reciprocal = 1.0 / np.where(powered, power, 1.0)
        coefficient = _sum(np.multiply(rest, np.conjugate(q, out=conjugate), out=product)) * reciprocal
        rest -= np.multiply(coefficient[:, None], q, out=product)
    noise = _covariance(columns[order + 1 :], products, conjugate) / local.dof
    H = np.where(powered, coefficient, 0.0).T
    found.H[:] = H[:B]
    found.cov[:] = guarded_covariance((noise * reciprocal).transpose(2, 0, 1), powered)[:B]
    found.coherence[:] = _quality(H, noise, np.where(powered, undiminished / near.shape[1], 0.0))[:B]
    found.own[:] = np.divide(power, undiminished, out=np.zeros_like(power), where=undiminished > 0.0)[:B]
    b = len(found.weights)
    weights = (local.off_transient @ columns[order, :, :b].conj()) * reciprocal[:b]
    found.weights[:] = np.where(powered[:b], weights, 0.0).T


def _covariance(E: Complex, products: Complex, conjugate: Complex) -> Complex:
    """Return the sums (C, C, B) of E_c conj(E_d) over the rows of E (C, m, B); the rest is work space."""
    sums = np.empty((len(E), len(E), E.shape[2]), dtype=complex)
    for d in range(len(E)):
        sums[: d + 1, d] = _sum(np.multiply(E[: d + 1], np.conjugate(E[d], out=conjugate), out=products[: d + 1]))
        sums[d, : d + 1] = sums[: d + 1, d].conj()
    return sums


def _sum(x: Complex) -> Complex:
    """Return the sums (..., B) over the rows of x (..., m, B)."""
    ones = np.ones((1, x.shape[-2]))
    sums: Complex = np.matmul(ones, x.view(float)).view(complex)
    return sums[..., 0, :]


def _power(x: Complex) -> Array:
    """Return the sum (B,) of |x|^2 over the rows of x (m, B)."""
    power: Array = np.einsum("mb,mb->b", x.real, x.real) + np.einsum("mb,mb->b", x.imag, x.imag)
    return power


def _quality(H: Complex, noise: Complex, Suu: Array) -> Array:
    """Return the share (B, C) of the outputs' power that H (B, C) explains beside noise (C, C, B), with the input's
    power (B,)."""
    signal = (H.real**2 + H.imag**2) * Suu[:, None]
    total = signal + np.einsum("ccb->bc", noise).real
    return np.where(total > 0.0, signal / np.where(total > 0.0, total, 1.0), 0.0)


Bins = NDArray[np.intp]

CONDITION = 5.0  # of the regression about a bin: that of noise stays below 5.6, whose own share is 0.03 at least
ORDER, HALF = 4, 8  # of the polynomials, and bins on either side: 17 bins for 10 unknowns leave 7 to estimate the noise


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
    lasting: bool = False,
) -> Frf:
    """Return the responses from u to each channel of y by the local polynomial method, from one aperiodic record.

    u : (N,) noise or sweep; y : (N,), (N, C) or name -> (N,), sampled together at fs [Hz]. Bins of fs/N from f_lo to
    f_hi [Hz], every step-th; the `half` bins next to 0 Hz and to fs/2 have no full neighbourhood and are left out.
    order : of both polynomials. `coherence` is |H|^2 S_uu over itself plus the noise, over the neighbourhood.
    Neighbours share their data: `stride` is the distance of independent bins (2 half + 1 of the full grid). The
    variance is infinite if u has no power of its own (a periodic u between its lines, a band not driven). lasting :
    refuse hits near an end of the record: their responses are its transient, and only noise would determine H. Raises
    ValueError for them, for unequal lengths, NaN or inf, an empty band, or fewer than 7 degrees of freedom."""
    if not (np.isfinite(fs) and fs > 0 and step >= 1):
        raise ValueError(f"sampling frequency {fs} Hz and step {step}: expected positive numbers")
    outputs = named(y)
    if not outputs:
        raise ValueError("no output channel given")
    spectra = _transform([(input, u), *outputs.items()])
    local = LocalRegression.of(order, half)
    bins = _bins(len(u), fs, (f_lo, fs / 2 if f_hi is None else f_hi), step, half)
    near = sliding_window_view(spectra, 2 * half + 1, axis=1)[:, bins[0] - half : bins[-1] - half + 1 : step]
    found = fitted(near.transpose(0, 2, 1), local, power_floor(spectra[0].real ** 2 + spectra[0].imag ** 2))
    apart = float(np.mean(found.own > CONDITION**-2))
    if lasting and apart < 0.5 and is_transient(u):
        raise ValueError(
            f"{input} and the transient of the record cannot be distinguished in {100 * (1 - apart):.0f} % of the bins "
            f"(condition number above {CONDITION:g}): {input} looks like hits of a hammer"
        )
    return Frf(
        f=bins.astype(float) * (fs / len(u)),
        H=found.H,
        channels=tuple(outputs),
        input=input,
        coherence=found.coherence,
        cov=found.cov,
        nu=np.full(bins.shape, float(local.dof)),
        correlation=_correlation(found.weights, step),
        estimator="lpm",
        notes=(f"local polynomials of order {order} over +-{half} bins of {fs / len(u):.4g} Hz",),
    )


def lpm_record(record: Record, input: str, outputs: Sequence[str], f_lo: float, f_hi: float, step: int = 1) -> Frf:
    """Return `lpm` of channels of a record with its defaults. Raises RecordError if a channel is missing."""
    columns = {name: record[name] for name in outputs}
    return lpm(record[input], columns, record.fs, f_lo=f_lo, f_hi=f_hi, step=step, input=input, lasting=True)


def _bins(n: int, fs: float, band_Hz: tuple[float, float], step: int, half: int) -> Bins:
    """Return the bins of a band, with `half` neighbours on both sides, of n samples. Raises ValueError without any."""
    first, last = int(np.ceil(band_Hz[0] * n / fs - 1e-9)), int(np.floor(band_Hz[1] * n / fs + 1e-9))
    # Bin 0 is left out of every neighbourhood: its offset is no response to the input.
    lo, hi = max(half + 1, first), min((n - 1) // 2 - half, last)
    if hi < lo:
        df = fs / n
        band = f"{first * df:g}..{last * df:g} Hz"
        raise ValueError(f"no bin of {df:.4g} Hz in {band} has {half} neighbours on both sides")
    return np.arange(lo, hi + 1, step)


def _transform(columns: Sequence[tuple[str, Array]]) -> Complex:
    """Return the (1 + C, N // 2 + 1) transforms of the channels without their mean."""
    sizes = {name: np.shape(c) for name, c in columns}
    if len(set(sizes.values())) != 1 or any(len(s) != 1 for s in sizes.values()):
        raise ValueError(f"expected channels of one equal length, got shapes {sizes}")
    spectra = np.empty((len(columns), len(columns[0][1]) // 2 + 1), dtype=complex)
    for X, (name, c) in zip(spectra, columns, strict=True):
        mean = np.mean(c)
        if not (np.isfinite(mean) or np.isfinite(c).all()):  # a sum is sooner made than a mask
            raise ValueError(f"channel '{name}' holds NaN or inf, first at sample {int(np.argmin(np.isfinite(c)))}")
        X[:] = transform(np.asarray(c))
    return spectra


def _correlation(weights: Complex, step: int) -> tuple[float, ...]:
    """Return the mean correlation of the errors of bins 1, 2, ... places apart, for weights (B, 2 half + 1)."""
    power = np.sqrt(np.sum(np.abs(weights) ** 2, axis=1))
    unit = weights / np.where(power > 0.0, power, 1.0)[:, None]
    places = range(1, (weights.shape[1] - 1) // step + 1)
    lags = [(d, d * step) for d in places if d < len(unit)]
    return tuple(float(np.mean(np.sum(unit[:-d, lag:] * unit[d:, :-lag].conj(), axis=1)).real) for d, lag in lags)
