"""What a fit leaves, band by band: tolerated in the next fit, it keeps what a model lacks in some band of a channel
from biasing the values that the other bands determine."""

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset

BLOCKS_PER_OCTAVE = 4
MEDIAN = float(np.log(2.0))  # of |e|^2 over its mean, for noise
LEAST = 0.02  # relative: less is a matter of the values, and the next fit has to mend it


def misfit(data: Dataset, H: Complex) -> Array:
    """Return the relative misfit (F, C) of a modelled response H (F, C) in each band, beyond noise; values below
    `LEAST` are set to zero."""
    energy, noise = np.abs(data.H / H - 1.0) ** 2, data.noise / np.abs(H) ** 2
    block = np.floor(np.log2(data.f / data.f[0]) * BLOCKS_PER_OCTAVE).astype(int)
    found = np.zeros(energy.shape)
    for k in np.unique(block):
        inside = block == k
        left = np.median(energy[inside], axis=0) / MEDIAN - np.median(noise[inside], axis=0)
        found[inside] = np.sqrt(np.clip(left, 0.0, None))
    return np.where(found > LEAST, found, 0.0)
