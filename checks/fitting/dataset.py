"""Data for comparison with a model: measured responses on independent bins, their noise and the model's tolerance.

Every bin comes from a local polynomial over 17 bins of the record (leakage and transient removed), the next from the
next 17: errors of different bins are independent. All bins would give half the uncertainty where noise dominates, which
it hardly does: on recorded struts it is 1e-4 to 1e-2 of |H|, beside a tolerance of 1e-2."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.errors import RecordError
from checks.fitting.whitener import Whitener, whitener
from checks.model.learned_bench import LearnedBench
from checks.record import Record
from checks.signals.interpolation import (
    Errors,
    error_notes,
    errors_of_other_record,
    interpolation_errors,
    remove_errors,
)
from checks.signals.spectral.frf import Frf
from checks.signals.spectral.lpm import HALF, lpm_record

NEIGHBOURS = 2  # windows on either side that share one estimate
ALONE = 1e-4  # chance that a window's noise exceeds that about it so much, if it is the same noise


def pool_noise(frf: Frf, input_power: Array) -> tuple[Complex, Array]:
    """Return cov (U, C, C) and its degrees of freedom nu (U,) of a local fit's usable bins, averaged over neighbours.

    frf: independent bins; input_power (F,): of the input about each bin, in any unit. The noise on the outputs is
    averaged, because it is smooth; cov is that noise over the input power that determines H. A window with far more
    noise than its neighbours (a line of the mains, a resonance too sharp for its polynomial) keeps its own, which is
    not used for them."""
    good = frf.usable
    own, power = frf.nu[good], (_power(frf) * input_power)[good]
    noise: Complex = frf.cov[good] * power[:, None, None]
    alone = _is_outlier(np.einsum("fcc->fc", noise).real, own)
    lend = np.where(alone, 0.0, own)
    lent: Complex = noise * lend[:, None, None]
    total, nu = _moving(lent), _moving(lend.astype(np.complex128)).real
    keep = alone | (nu <= own)
    mean: Complex = total / np.where(nu > 0.0, nu, 1.0)[:, None, None]
    cov = np.asarray(np.where(keep[:, None, None], noise, mean) / power[:, None, None], dtype=np.complex128)
    return cov, np.where(keep, own, nu)


def _power(frf: Frf) -> Array:
    """Return the input power (F,) that determines H: var is noise / power, coherence gives noise / input power."""
    c = np.argmin(np.abs(frf.coherence - 0.5), axis=1)  # there neither 1 - coherence nor coherence is round-off
    at = np.arange(frf.f.size)
    coherence, var = frf.coherence[at, c], frf.var[at, c]
    ratio = np.abs(frf.H[at, c]) ** 2 * (1.0 - coherence) / np.maximum(coherence, 1e-300)
    valid = (ratio > 0.0) & (var > 0.0) & np.isfinite(var)
    return np.where(valid, ratio / np.where(valid, var, 1.0), 1.0)


def _is_outlier(noise: Array, nu: Array) -> NDArray[np.bool_]:
    """Return whether the noise (F, C) of each window (F,) exceeds the local median by more than chance allows."""
    wide = 2 * NEIGHBOURS + 1
    padded = np.pad(noise, ((wide, wide), (0, 0)), mode="reflect" if len(noise) > wide else "edge")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * wide + 1, axis=0), axis=-1)
    limit = stats.chi2.isf(ALONE, 2.0 * nu) / stats.chi2.median(2.0 * nu)
    return np.asarray((noise > limit[:, None] * median).any(axis=1))


def _moving(x: Complex) -> Complex:
    """Return the sums over the neighbours on both sides along the first axis; fewer at the ends."""
    padded = np.pad(x, ((NEIGHBOURS, NEIGHBOURS), *((0, 0),) * (x.ndim - 1)))
    sums: Complex = np.sum([padded[k : k + len(x)] for k in range(2 * NEIGHBOURS + 1)], axis=0)
    return sums


DRIVE = "Va"
CHANNELS = ("Vs", "de", "da")
F_LO, F_HI = 10.0, 2000.0  # [Hz] where the excitations of [STB] 3.1.1 drive; the model holds to 2 kHz with a margin
STEP = 2 * HALF + 1  # windows that share no bin


@dataclass(frozen=True, eq=False)
class Dataset:
    """f (F,) [Hz]; H (F, C) complex, channels (C,) over Va at the DAC; cov (F, C, C) noise E[e e^H] across channels; nu
    (F,) complex degrees of freedom of cov; tolerance: relative model error, see `whitener`; by_frequency (F, C):
    further tolerance, added in square, if a learned bench states how much units differ; scale (F, C): the response that
    both are fractions of, the measured one before a model is known; taken_out: errors of the encoder's interpolation
    that were removed from H.

    Errors of different bins are independent. `from_records`, `of` and `simulated` make it."""

    f: Array
    H: Complex
    channels: tuple[str, ...]
    cov: Complex
    nu: Array
    tolerance: float = 0.0
    name: str = "responses"
    scale: Complex | None = None
    by_frequency: Array | None = None
    taken_out: Errors = ()

    @classmethod
    def of(cls, frf: Frf, tolerance: float = 0.0, name: str = "responses") -> "Dataset":
        """Return the usable, independent bins of an estimate. Raises RecordError if there are none."""
        bins = frf.independent()
        good = bins.usable
        if not good.any():
            raise RecordError(f"{name}: no bin of the response is driven")
        return cls(bins.f[good], bins.H[good], bins.channels, bins.cov[good], bins.nu[good], tolerance, name)

    @classmethod
    def from_records(
        cls,
        low: Record,
        high: Record | None = None,
        merge_Hz: float | None = None,
        *,
        tolerance: float = 0.0,
        channels: Sequence[str] = CHANNELS,
        f_lo: float = F_LO,
        f_hi: float = F_HI,
        name: str | None = None,
    ) -> "Dataset":
        """Return the responses of one realisation: low up to merge_Hz [Hz] and high above it; low alone without high.
        The encoder's interpolation error seen in low is removed from both.

        Raises RecordError for a missing channel or merge frequency, and a band without drive."""
        called = name or low.name
        errors = interpolation_errors(low) if "de" in channels else ()
        low = remove_errors(low, errors)
        high = high and remove_errors(high, errors_of_other_record(errors, high))
        if high is None:
            return replace(_of_record(low, tolerance, channels, f_lo, f_hi, called), taken_out=errors)
        if merge_Hz is None or not f_lo < merge_Hz < f_hi:
            raise RecordError(f"{called}: merge_Hz is {merge_Hz}; expected a frequency within {f_lo:g}..{f_hi:g} Hz")
        below = _of_record(low, tolerance, channels, f_lo, merge_Hz, called)
        above = _of_record(high, tolerance, channels, merge_Hz, f_hi, called)
        return replace(joined(below, above.at(above.f > below.f[-1])), taken_out=errors)

    def __repr__(self) -> str:
        band = f"{self.f.size} bins from {self.f[0]:.4g} to {self.f[-1]:.4g} Hz" if self.f.size else "no bins"
        return f"Dataset({self.name}: {', '.join(self.channels)}; {band})"

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the whitener, which can be recomputed: it is some thirty times as large as everything else."""
        return {k: v for k, v in vars(self).items() if k != "whitener"}

    @property
    def reference(self) -> Complex:
        """Return the response (F, C) that the tolerance is a fraction of."""
        return self.H if self.scale is None else self.scale

    def around(self, model: Complex) -> "Dataset":
        """Return the same with the tolerance as a fraction of a model's response (F, C). A fraction of the measured one
        pulls a fit down, because bins that noise made small then count more (Peelle's puzzle; [DAGOSTINI94])."""
        return replace(self, scale=model)

    @property
    def notes(self) -> tuple[str, ...]:
        """Return remarks on what was taken out of the records."""
        return error_notes(self.taken_out)

    @property
    def noise(self) -> Array:
        """Return the variance (F, C) of the noise, total complex."""
        diagonal: Array = np.einsum("fcc->fc", self.cov).real
        return diagonal

    @property
    def variance(self) -> Array:
        """Return the noise variance (F, C) plus squared tolerance, the denominator of G."""
        return self.noise + (self.relative * np.abs(self.reference)) ** 2

    @property
    def relative(self) -> float | Array:
        """Return the relative model error: one number, or (F, C) if it depends on frequency and channel."""
        return self.tolerance if self.by_frequency is None else np.hypot(self.tolerance, self.by_frequency)

    @cached_property
    def whitener(self) -> Whitener:
        """Turn residuals (F, C) into real numbers of unit variance: noise and tolerance with their correlations."""
        return whitener(self.f, self.reference, self.cov, self.nu, self.relative)

    def on_bench(self, learned: LearnedBench | None) -> "Dataset":
        """Return the dataset with the scatter of a learned bench between units, if the model has one."""
        return self if learned is None else replace(self, by_frequency=learned.tolerance_at(self.f, self.channels))

    def select(self, channels: Iterable[str]) -> "Dataset":
        """Return some channels, in the order asked for. Raises RecordError naming a missing one."""
        wanted = tuple(channels)
        for c in wanted:
            if c not in self.channels:
                raise RecordError(f"{self.name}: no channel '{c}' (has: {', '.join(self.channels)})")
        at = [self.channels.index(name) for name in wanted]
        scale = None if self.scale is None else self.scale[:, at]
        more = None if self.by_frequency is None else self.by_frequency[:, at]
        H, cov = self.H[:, at], self.cov[:, at][:, :, at]
        return replace(self, H=H, cov=cov, channels=wanted, scale=scale, by_frequency=more)

    def band(self, f_lo: float, f_hi: float) -> "Dataset":
        """Return the bins with f_lo <= f <= f_hi [Hz]."""
        return self.at((self.f >= f_lo) & (self.f <= f_hi))

    def at(self, bins: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Dataset":
        scale = None if self.scale is None else self.scale[bins]
        more = None if self.by_frequency is None else self.by_frequency[bins]
        f, H, cov, nu = self.f[bins], self.H[bins], self.cov[bins], self.nu[bins]
        return replace(self, f=f, H=H, cov=cov, nu=nu, scale=scale, by_frequency=more)

    def thinned(self, bins: int) -> "Dataset":
        """Return at most `bins` of the bins, spread over log f: for a first, quick fit."""
        if self.f.size <= bins:
            return self
        wanted = np.geomspace(self.f[0], self.f[-1], bins)
        return self.at(np.unique(np.searchsorted(self.f, wanted * (1 - 1e-12))))


def joined(below: Dataset, above: Dataset) -> Dataset:
    """Join two bands of a response."""
    if below.channels != above.channels:
        raise RecordError(f"{below.name}: channels {below.channels} below and {above.channels} above")
    f, H, cov, nu = (np.concatenate([getattr(d, k) for d in (below, above)]) for k in ("f", "H", "cov", "nu"))
    return replace(below, f=f, H=H, cov=cov, nu=nu, scale=None, by_frequency=None)


def simulated(
    f: Array,
    H: Complex,
    channels: tuple[str, ...],
    cov: Complex,
    rng: np.random.Generator,
    tolerance: float = 0.0,
) -> Dataset:
    """Return H (F, C) with noise drawn from a known covariance (F, C, C): to test fits and to know their power."""
    L = np.linalg.cholesky(cov)
    e = (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)) / np.sqrt(2.0)
    return Dataset(f, H + np.einsum("fij,fj->fi", L, e), channels, cov, np.full(f.size, np.inf), tolerance, "simulated")


def _of_record(
    record: Record, tolerance: float, channels: Sequence[str], f_lo: float, f_hi: float, name: str
) -> Dataset:
    try:
        frf = lpm_record(record, DRIVE, channels, f_lo, f_hi, step=STEP)
    except ValueError as e:
        raise RecordError(f"{record.name}: {e}") from e
    data = Dataset.of(frf, tolerance, name)
    cov, nu = pool_noise(frf, _input_power(record, frf.f))
    return replace(data, cov=cov, nu=nu)


def _input_power(record: Record, f: Array) -> Array:
    """Return the power (F,) of the drive over the window about each bin."""
    u = record[DRIVE]
    power = np.abs(rfft(u - np.mean(u))) ** 2
    window = np.convolve(power, np.full(STEP, 1.0 / STEP), mode="same")
    return np.asarray(window[np.rint(f * u.size / record.fs).astype(int)])
