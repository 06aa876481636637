"""Frequency responses with their uncertainty, and the averaged estimate H1."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.errors import RecordError
from checks.record import Record
from checks.signals.spectral.segments import spectra

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Frf:
    """Responses of C output channels to one input, H = Y/U: a pure delay has falling phase.

    f : (F,) [Hz]. H : (F, C) complex [unit of the channel per unit of the input].
    coherence : (F, C) in 0..1; 0 where the bin is unusable.
    cov : (F, C, C) complex, E[e e^H] of the errors e of H across channels; its diagonal is the total complex variance
    E|e|^2 (real and imaginary part have half each), infinite where the input had no power; H is 0 there.
    nu : (F,) complex degrees of freedom of cov: |e|^2 / var follows F(2, 2 nu).
    correlation : correlation of the errors of two bins of this grid 1, 2, ... bins apart; 0 beyond.
    segments : averaged segments (0: the estimator does not average)."""

    f: Array
    H: Complex
    channels: tuple[str, ...]
    input: str
    coherence: Array
    cov: Complex
    nu: Array
    correlation: tuple[float, ...]
    estimator: str
    segments: int = 0
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        band = f"{self.f.size} bins from {self.f[0]:.4g} to {self.f[-1]:.4g} Hz" if self.f.size else "no bins"
        return f"Frf({', '.join(self.channels)} over {self.input}, {self.estimator}; {band})"

    @property
    def var(self) -> Array:
        """Return (F, C) total complex variance of H."""
        diagonal: Array = np.einsum("fcc->fc", self.cov).real
        return diagonal

    @property
    def usable(self) -> Mask:
        """Return (F,) bins where every channel has a finite variance."""
        return np.asarray(np.isfinite(self.var).all(axis=1))

    @property
    def known(self) -> Mask:
        """Return the bins (F,) that hold a response: driven, or of a file that states no variance."""
        return np.asarray(~np.isinf(self.var).any(axis=1))

    def cut(self, f_lo: float, f_hi: float | None, notes: tuple[str, ...] | None = None) -> "Frf":
        """Return the bins from f_lo to f_hi [Hz], with other notes if given. Raises RecordError for fewer than two."""
        part = self.band(f_lo, math.inf if f_hi is None else f_hi)
        if part.f.size < 2:
            raise RecordError(f"no two frequencies lie in {f_lo:g}..{f_hi or self.f[-1]:g} Hz")
        return part if notes is None else replace(part, notes=notes)

    @property
    def stride(self) -> int:
        """Return the distance in bins of this grid at which errors are independent."""
        return len(self.correlation) + 1

    def index(self, channel: str) -> int:
        """Return the column of a channel. Raises KeyError with the existing names if it is missing."""
        if channel not in self.channels:
            raise KeyError(f"no channel '{channel}' (has: {', '.join(self.channels)})")
        return self.channels.index(channel)

    def radius(self, p: float = 0.95) -> Array:
        """Return radius (F, C) of the disc about H with the truth at probability p (Pintelon & Schoukens, 2.4)."""
        return np.sqrt(self.var * quantile(p, self.nu)[:, None])

    def band(self, f_lo: float, f_hi: float) -> "Frf":
        """Return the bins with f_lo <= f <= f_hi [Hz]."""
        return self._at((self.f >= f_lo) & (self.f <= f_hi))

    def independent(self) -> "Frf":
        """Return every stride-th bin, so that the errors of the remaining ones are independent."""
        return replace(self._at(slice(None, None, self.stride)), correlation=())

    def _at(self, bins: Mask | slice) -> "Frf":
        """Return some bins. `correlation` counts grid bins: pick a run of neighbours, or reset it."""
        return replace(
            self, f=self.f[bins], H=self.H[bins], coherence=self.coherence[bins], cov=self.cov[bins], nu=self.nu[bins]
        )

    def select(self, *channels: str) -> "Frf":
        """Return some channels, in the given order."""
        c = [self.index(name) for name in channels]
        return replace(
            self, H=self.H[:, c], channels=channels, coherence=self.coherence[:, c], cov=self.cov[:, c][:, :, c]
        )


def h1(u: Array, y: Array | Mapping[str, Array], fs: float, nperseg: int, *, input: str = "u") -> Frf:
    """Return the H1 estimate of the responses from u to every channel of y, with coherence and covariance, in one pass.

    u : (N,) input; y : (N,), (N, C) or name -> (N,) outputs, sampled together at fs [Hz]. Hann segments of nperseg
    samples, half overlapped, the mean of each segment removed. The last bins of the grid (0 Hz
    and half of fs) are real numbers and have half the degrees of freedom. Biased low at peaks narrower than the window,
    and by noise on u ([BP10] ch. 6, 9). Raises ValueError for fewer than two segments, unequal lengths, NaN or inf.

    nu = n - 1 with n effective segments; C = (S_yy - S_yu S_uy / S_uu) / (S_uu nu), whose diagonal is |H|^2 (1 -
    coherence) / (coherence nu) ([PS12] 2.5)."""
    outputs = named(y)
    if not outputs:
        raise ValueError("no output channel given")
    averaged = spectra([u, *outputs.values()], fs, nperseg)  # channel 0 is the input
    S, nu = averaged.S, averaged.effective - 1.0
    Suu, Syu = S[:, 0, 0].real, S[:, 1:, 0]
    powered = Suu > power_floor(Suu)
    safe = np.where(powered, Suu, 1.0)
    H = np.where(powered[:, None], Syu / safe[:, None], 0.0)
    rest = Syu[:, :, None] * Syu[:, None, :].conj()  # in place from here on: memory at first hand costs as much
    rest *= (-1.0 / safe)[:, None, None]
    rest += S[:, 1:, 1:]
    rest *= (1.0 / (safe * nu))[:, None, None]
    Syy = np.einsum("fcc->fc", S[:, 1:, 1:]).real
    explained = (Syu.real**2 + Syu.imag**2) / np.where(Syy > 0.0, Syy, 1.0) / safe[:, None]
    return Frf(
        f=averaged.f,
        H=H,
        channels=tuple(outputs),
        input=input,
        coherence=np.where(powered[:, None], np.minimum(explained, 1.0), 0.0),
        cov=guarded_covariance(rest, powered),
        nu=np.full(Suu.shape, nu),
        correlation=averaged.correlation,
        estimator="h1",
        segments=averaged.segments,
    )


def h1_record(record: Record, input: str, outputs: Sequence[str], segment_s: float = 0.5) -> Frf:
    """Return `h1` of channels of a record with segments of segment_s [s]. Raises RecordError if a channel is missing,
    ValueError if the record is shorter than two segments that share half of their samples."""
    if not 1.5 * segment_s * record.fs <= record.t.size:
        raise ValueError(f"segments of {segment_s:g} s: the record's {record.t.size / record.fs:g} s do not hold two")
    columns = {name: record[name] for name in outputs}
    return h1(record[input], columns, record.fs, max(4, round(segment_s * record.fs)), input=input)


def quantile(p: float, nu: Array) -> Array:
    """Return the quantile of F(2, 2 nu), whose distribution is 1 - (1 + x/nu)^-nu, for every nu (F,)."""
    finite = np.where(np.isinf(nu), 1.0, nu)
    return np.asarray(np.where(np.isinf(nu), -np.log1p(-p), finite * np.expm1(-np.log1p(-p) / finite)))


def power_floor(power: Array) -> float:
    """Return the power below which a bin is rounding error: 240 dB below the sum of all bins (F,)."""
    return float(1e-24 * power.sum())


def guarded_covariance(cov: Complex, powered: Mask) -> Complex:
    """Return cov (F, C, C), changed in place: diagonal non-negative, and infinite in bins without drive."""
    cov[~powered] = 0.0
    for c in range(cov.shape[1]):
        cov[:, c, c] = np.where(powered, np.maximum(cov[:, c, c].real, 0.0), np.inf)
    return cov


def named(y: Array | Mapping[str, Array]) -> dict[str, Array]:
    """Return the outputs by name, (N,) each; the columns of an array are called y0, y1, ..."""
    if isinstance(y, Mapping):
        return dict(y)
    columns = np.atleast_2d(np.asarray(y).T)
    return {f"y{i}": column for i, column in enumerate(columns)}
