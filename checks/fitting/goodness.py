"""Distance of data and model, relative to noise and the model's tolerance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset

BLOCKS_PER_OCTAVE = 4
MEDIAN = float(np.log(2.0))  # of |e|^2 over its mean, for noise
LEAST = 0.02  # relative: less is a matter of the values, and the next fit has to mend it


@dataclass(frozen=True)
class Gap:
    """The gap between model and data. G: squared residual over noise variance plus squared tolerance, per degree of
    freedom; 1 or less is agreement. dof: real degrees of freedom. p: chance of so large a G from noise, were the model
    exact."""

    G: float
    dof: float
    p: float


def gaps(datasets: Sequence[Dataset], residuals: Sequence[Complex], fitted: float = 0) -> dict[str, Gap]:
    """Return G of every channel, all datasets together.

    residuals: (F, C) of each dataset, data minus model. fitted: number of parameters that these data were fitted with,
    taken off the degrees of freedom in equal parts; 0 on data that were not fitted. For a band, pass `data.band(...)`.
    """
    names = tuple(dict.fromkeys(name for data in datasets for name in data.channels))
    parts = [_parts(data, r) for data, r in zip(datasets, residuals, strict=True)]
    lost = fitted / max(len(names), 1)
    return {name: _gap(np.concatenate([p[name] for p in parts if name in p], axis=1), lost) for name in names}


def overall(found: Mapping[str, Gap]) -> Gap:
    """Return G of all channels together, as if they were independent."""
    dof = sum(g.dof for g in found.values())
    G = sum(g.G * g.dof for g in found.values()) / dof
    return Gap(G, dof, float(stats.chi2.sf(G * dof, dof)))


def _parts(data: Dataset, residual: Complex) -> dict[str, Array]:
    """Return by channel (3, F): squared residual over variance, and its mean and variance for pure noise."""
    nu = np.clip(data.nu, 3.0, 1e9)
    # |e|^2 over an estimated variance is F(2, 2 nu): its mean is above 1 and its tail heavier than chi-square's
    mean, spread = nu / (nu - 1.0), nu**3 / ((nu - 1.0) ** 2 * (nu - 2.0))
    out = {}
    for c, name in enumerate(data.channels):
        share = data.noise[:, c] / data.variance[:, c]
        squared = np.abs(residual[:, c]) ** 2 / data.variance[:, c]
        out[name] = np.array([squared, 1.0 + share * (mean - 1.0), 1.0 + share * (spread - 1.0)])
    return out


def _gap(parts: Array, lost: float) -> Gap:
    total, mean, spread = parts.sum(axis=1)
    expected = max(mean - 0.5 * lost, 0.5)
    G = float(total / expected)
    dof = float(2.0 * expected * expected / spread)  # of the scaled chi-square with this mean and variance
    return Gap(G, dof, float(stats.chi2.sf(G * dof, dof)))


def misfit(data: Dataset, H: Complex) -> Array:
    """Return the relative misfit (F, C) of a modelled H (F, C) in each band, beyond noise; below `LEAST` it is zero.

    As a tolerance of the next fit it keeps a model's fault in one band from biasing what other bands determine."""
    energy, noise = np.abs(data.H / H - 1.0) ** 2, data.noise / np.abs(H) ** 2
    block = np.floor(np.log2(data.f / data.f[0]) * BLOCKS_PER_OCTAVE).astype(int)
    out = np.zeros(energy.shape)
    for k in np.unique(block):
        inside = block == k
        left = np.median(energy[inside], axis=0) / MEDIAN - np.median(noise[inside], axis=0)
        out[inside] = np.sqrt(np.clip(left, 0.0, None))
    return np.where(out > LEAST, out, 0.0)
