"""The unexplained part of a bench that is the same for every unit: a factor on each channel, learned from units that
were measured on it, and how far one more unit may differ from it."""

from dataclasses import dataclass, replace

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError


@dataclass(frozen=True, eq=False)
class LearnedBench:
    """f (K,) [Hz] rising; factor (K, C) complex: the factor on the responses of channels (C,), less one; sd (K, C): its
    standard uncertainty; tolerance (K, C): 1 sd, relative, of the deviation of one more unit. All are interpolated
    linearly between the frequencies and constant beyond them."""

    f: Array
    channels: tuple[str, ...]
    factor: Complex
    sd: Array
    tolerance: Array

    def __post_init__(self) -> None:
        """Raise ModelError if shapes do not agree or a value is not a number."""
        shape = (self.f.size, len(self.channels))
        for name in ("factor", "sd", "tolerance"):
            part = getattr(self, name)
            if part.shape != shape or not np.isfinite(part).all():
                raise ModelError(f"learned bench: {name} has shape {part.shape}; expected finite numbers of {shape}")
        if self.f.size < 2 or not (np.diff(self.f) > 0.0).all():
            raise ModelError("learned bench: expected two or more frequencies that rise")

    def at(self, f: Array, channel: str) -> Complex | float:
        """Return the factor (F,) of a channel at f (F,) [Hz]; 1 for a channel that was not learned."""
        if channel not in self.channels:
            return 1.0
        d = self.factor[:, self.channels.index(channel)]
        return np.asarray(1.0 + np.interp(f, self.f, d.real) + 1j * np.interp(f, self.f, d.imag))

    def tolerance_at(self, f: Array, channels: tuple[str, ...]) -> Array:
        """Return the relative error (F, C), 1 sd, of the factor for one more unit: uncertainty and scatter of units."""
        whole = np.hypot(self.sd, self.tolerance)
        found = np.zeros((f.size, len(channels)))
        for i, c in enumerate(channels):
            if c in self.channels:
                found[:, i] = np.interp(f, self.f, whole[:, self.channels.index(c)])
        return found

    def simplified(self, share: float = 0.1, least: float = 2e-4) -> "LearnedBench":
        """Return the bench at the fewest frequencies that keep it within a share of its uncertainty, or `least`."""
        whole = np.hypot(self.sd, self.tolerance)
        near = np.maximum(share * whole, least)
        columns = np.hstack([self.factor.real / near, self.factor.imag / near, 3.0 * np.log(whole + least)])
        kept = np.zeros(self.f.size, dtype=bool)
        kept[[0, -1]] = True
        parts = [(0, self.f.size - 1)]
        while parts:
            a, b = parts.pop()
            if b - a < 2:
                continue
            x = (self.f[a : b + 1] - self.f[a]) / (self.f[b] - self.f[a])
            straight = columns[a] + x[:, None] * (columns[b] - columns[a])
            off = np.abs(columns[a : b + 1] - straight).max(axis=1)
            k = a + int(np.argmax(off))
            if off.max() > 1.0:
                kept[k] = True
                parts += [(a, k), (k, b)]
        return replace(self, f=self.f[kept], factor=self.factor[kept], sd=self.sd[kept], tolerance=self.tolerance[kept])
