"""What a model is compared with: measured responses on independent bins, their noise and the model's tolerance.

Every bin comes from a local polynomial over 17 bins of the record (leakage and transient removed); taking one bin in 17
makes the errors of the bins independent, at the price of half the precision that all bins together would give.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from checks.model.whitener import Whitener, whitener
from checks.record import Record, RecordError
from checks.signals.frf import Frf
from checks.signals.lpm import lpm_record

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

CHANNELS = ("Vs", "de", "da")
F_LO, F_HI = 10.0, 2000.0  # [Hz] where the seed's excitations drive; the model holds to 2 kHz with a margin
NEIGHBOURS = 2  # windows on either side that share one estimate of the noise
LINE = 1e-5  # chance that a window's noise exceeds its neighbours' so much: then it holds a line of the mains


@dataclass(frozen=True, eq=False)
class Dataset:
    """f (F,) [Hz]; H (F, C) complex, channels (C,) over Va at the DAC; cov (F, C, C) noise E[e e^H] across channels;
    nu (F,) complex degrees of freedom of cov; tolerance: relative model error, see `whitener`.

    Errors of different bins are independent. Raises nothing itself: `dataset_of` and `simulated` make it.
    """

    f: Array
    H: Complex
    channels: tuple[str, ...]
    cov: Complex
    nu: Array
    tolerance: float = 0.0
    name: str = "responses"

    @property
    def noise(self) -> Array:
        """(F, C) variance of the noise, total complex."""
        return np.einsum("fcc->fc", self.cov).real

    @property
    def variance(self) -> Array:
        """(F, C) noise variance plus squared tolerance: what G divides the squared residual by."""
        return self.noise + (self.tolerance * np.abs(self.H)) ** 2

    @cached_property
    def whitener(self) -> Whitener:
        """Turns residuals (F, C) into real numbers of unit variance: noise and tolerance with their correlations."""
        return whitener(self.f, self.H, self.cov, self.nu, self.tolerance)

    def select(self, channels: Iterable[str]) -> "Dataset":
        """Some channels, in the order asked for. Raises RecordError naming one that is not there."""
        wanted = tuple(channels)
        for c in wanted:
            if c not in self.channels:
                raise RecordError(f"{self.name}: no channel '{c}' (has: {', '.join(self.channels)})")
        c = [self.channels.index(name) for name in wanted]
        return replace(self, H=self.H[:, c], cov=self.cov[:, c][:, :, c], channels=wanted)

    def band(self, f_lo: float, f_hi: float) -> "Dataset":
        """The bins with f_lo <= f <= f_hi [Hz]."""
        return self.at((self.f >= f_lo) & (self.f <= f_hi))

    def at(self, bins: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Dataset":
        """Some bins."""
        return replace(self, f=self.f[bins], H=self.H[bins], cov=self.cov[bins], nu=self.nu[bins])

    def thinned(self, bins: int) -> "Dataset":
        """At most `bins` of the bins, spread over log f: for a first, quick fit."""
        if self.f.size <= bins:
            return self
        wanted = np.geomspace(self.f[0], self.f[-1], bins)
        return self.at(np.unique(np.searchsorted(self.f, wanted * (1 - 1e-12))))


def dataset_of(frf: Frf, tolerance: float = 0.0, name: str = "responses") -> Dataset:
    """The usable, independent bins of an estimate. Raises RecordError when there are none."""
    bins = frf.independent()
    good = bins.usable
    if not good.any():
        raise RecordError(f"{name}: no bin of the response is driven")
    return Dataset(bins.f[good], bins.H[good], bins.channels, bins.cov[good], bins.nu[good], tolerance, name)


def dataset_from_records(
    low: Record,
    high: Record | None = None,
    merge_Hz: float | None = None,
    *,
    tolerance: float = 0.0,
    channels: Sequence[str] = CHANNELS,
    input: str = "Va",
    f_lo: float = F_LO,
    f_hi: float = F_HI,
    name: str | None = None,
) -> Dataset:
    """Responses of one realisation: low up to merge_Hz [Hz] and high above it; without high, low alone.

    Raises RecordError for a channel that is missing, no merge frequency, or a band without drive."""
    called = name or low.name
    if high is None:
        return _of_record(low, tolerance, channels, input, f_lo, f_hi, called)
    if merge_Hz is None or not f_lo < merge_Hz < f_hi:
        raise RecordError(f"{called}: merge_Hz is {merge_Hz}; expected a frequency within {f_lo:g}..{f_hi:g} Hz")
    below = _of_record(low, tolerance, channels, input, f_lo, merge_Hz, called)
    above = _of_record(high, tolerance, channels, input, merge_Hz, f_hi, called)
    return joined(below, above.at(above.f > below.f[-1]))


def joined(below: Dataset, above: Dataset) -> Dataset:
    """Two bands of one response, one after the other."""
    if below.channels != above.channels:
        raise RecordError(f"{below.name}: channels {below.channels} below and {above.channels} above")
    parts = {k: np.concatenate([getattr(below, k), getattr(above, k)]) for k in ("f", "H", "cov", "nu")}
    return replace(below, **parts)


def simulated(
    f: Array,
    H: Complex,
    channels: tuple[str, ...],
    cov: Complex,
    rng: np.random.Generator,
    tolerance: float = 0.0,
) -> Dataset:
    """H (F, C) with noise drawn from a known covariance (F, C, C): to test what fits, and to know its power."""
    L = np.linalg.cholesky(cov)
    e = (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)) / np.sqrt(2.0)
    return Dataset(f, H + np.einsum("fij,fj->fi", L, e), channels, cov, np.full(f.size, np.inf), tolerance, "simulated")


def _of_record(
    record: Record, tolerance: float, channels: Sequence[str], input: str, f_lo: float, f_hi: float, name: str
) -> Dataset:
    try:
        frf = lpm_record(record, input, channels, f_lo, f_hi)
    except ValueError as e:
        raise RecordError(f"{record.name}: {e}") from e
    return dataset_of(frf, tolerance, name)


def hashes(records: Mapping[str, Record]) -> dict[str, str]:
    """Name -> sha256 of records, for the provenance of what is fitted to them."""
    return {name: record.sha256 for name, record in records.items()}
