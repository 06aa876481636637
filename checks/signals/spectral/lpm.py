"""Local polynomial method: the response at every bin of one transform of the whole record, free of leakage.

[PS12] 7.2. About bin k the record obeys Y(k + r) = G(k + r) U(k + r) + T(k + r) + noise, where G and the transient T
are smooth: both are polynomials of r, fitted by least squares over r = -half..half. The residual gives the noise, hence
the variance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.record import Record
from checks.signals.spectral.frf import Frf, named, power_floor
from checks.signals.spectral.local_polynomials import LocalPolynomialFit, LocalRegression, fitted
from checks.signals.spectral.transform import transform
from checks.signals.spectral.transient import is_transient

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
    problem = LpmTransforms.of(u, y, fs, f_lo, f_hi, step, input)
    local = LocalRegression.of(order, half)
    bins = problem.bins(half)
    found = problem.fit(bins, local)
    apart = float(np.mean(found.own > CONDITION**-2))
    if lasting and apart < 0.5 and is_transient(u):
        raise ValueError(
            f"{input} and the transient of the record cannot be distinguished in {100 * (1 - apart):.0f} % of the bins "
            f"(condition number above {CONDITION:g}): {input} looks like hits of a hammer"
        )
    note = f"local polynomials of order {order} over +-{half} bins of {fs / len(u):.4g} Hz"
    return problem.frf(bins, found, np.full(bins.shape, float(local.dof)), "lpm", note)


def lpm_record(record: Record, input: str, outputs: Sequence[str], f_lo: float, f_hi: float, step: int = 1) -> Frf:
    """Return `lpm` of channels of a record with its defaults. Raises RecordError if a channel is missing."""
    columns = {name: record[name] for name in outputs}
    return lpm(record[input], columns, record.fs, f_lo=f_lo, f_hi=f_hi, step=step, input=input, lasting=True)


@dataclass(frozen=True, eq=False)
class LpmTransforms:
    """Transforms (1 + C, N // 2 + 1) of a record, input first, and the bins at which the response is wanted."""

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
        """Return the wanted bins with `half` neighbours on both sides. Raises ValueError for an empty band."""
        # Bin 0 is left out of every neighbourhood: its offset is no response to the input.
        lo, hi = max(half + 1, self.first), min((self.n - 1) // 2 - half, self.last)
        if hi < lo:
            df = self.fs / self.n
            band = f"{self.first * df:g}..{self.last * df:g} Hz"
            raise ValueError(f"no bin of {df:.4g} Hz in {band} has {half} neighbours on both sides")
        return np.arange(lo, hi + 1, self.step)

    def fit(self, bins: Bins, local: LocalRegression) -> LocalPolynomialFit:
        """Return the fit about every one of the bins (B,), which are step apart."""
        U = self.spectra[0]
        windows = sliding_window_view(self.spectra, 2 * local.half + 1, axis=1)
        near = windows[:, bins[0] - local.half : bins[-1] - local.half + 1 : self.step]
        return fitted(near.transpose(0, 2, 1), local, power_floor(U.real**2 + U.imag**2))

    def frf(self, bins: Bins, found: LocalPolynomialFit, nu: Array, estimator: str, note: str) -> Frf:
        """Return the response at the bins (B,) with degrees of freedom nu (B,)."""
        return Frf(
            f=bins.astype(float) * (self.fs / self.n),
            H=found.H,
            channels=self.channels,
            input=self.input,
            coherence=found.coherence,
            cov=found.cov,
            nu=nu,
            correlation=_correlation(found.weights, self.step),
            estimator=estimator,
            notes=(note,),
        )


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
