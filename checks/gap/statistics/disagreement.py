"""The disagreement that an explanation leaves: a random function of frequency in every channel, smooth over half an
octave, of a size that is free in each half octave ([KENNEDY01]; [BRYNJARSDOTTIR14]). A cell (channel and half octave)
holds two real numbers of information on that size, however many bins it has. With E the whitened energy of a cell's n
bins and Q = E / 2n, the profile likelihood over all sizes is

    ln L = - sum over cells of (2 / 2) ln max(Q, 1) - (priors) / 2,

and its maximum is found by fits in which the variance of a cell's bins is raised by (Q - 1) 2n / 2, Q from the fit
before (iterated weights; each round lowers the sum). A member gains by the number of cells that it explains and by how
much better, not by the bins of a single peak.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset

CELLS_PER_OCTAVE = 2.0
FIRST_HZ = 5.0  # where the first cell begins
VALUES_PER_CELL = 2.0  # real numbers that a disagreement smooth over a cell has in it: one complex value


def cells(f: Array) -> NDArray[np.intp]:
    """Return the number of the half octave (F,) that each frequency f (F,) [Hz] lies in."""
    return np.floor(CELLS_PER_OCTAVE * np.log2(f / FIRST_HZ)).astype(np.intp)


def left_by_cell(data: Dataset, residual: Complex) -> Array:
    """Return Q (K, C): squared residual (F, C) over noise variance and squared tolerance, the mean of each cell, in the
    order of frequency."""
    _, at, counts = np.unique(cells(data.f), return_inverse=True, return_counts=True)
    out = np.zeros((counts.size, residual.shape[1]))
    np.add.at(out, at, np.abs(residual) ** 2 / data.variance)
    return np.asarray(out / counts[:, None])


def with_disagreement(data: Dataset, residual: Complex) -> Dataset:
    """Return the dataset with the variance of a disagreement of the size that a residual (F, C) shows in each cell."""
    _, at, counts = np.unique(cells(data.f), return_inverse=True, return_counts=True)
    beyond = np.maximum(left_by_cell(data, residual) - 1.0, 0.0) * (2.0 * counts / VALUES_PER_CELL)[:, None]
    extra = beyond[at] * data.variance
    cov = data.cov.copy()
    d = np.arange(len(data.channels))
    cov[:, d, d] += extra
    return replace(data, cov=cov)
