"""The search down to the least squares: its normal equations, and how near it ends to where it says."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import least_squares

from checks.arrays import Array
from checks.fitting.descent import CLOSE, EXACT, LOOSE, Precision, descend
from checks.fitting.whitener import whitener


@pytest.mark.parametrize("tolerance", [0.0, 1e-4, 0.01])
def test_normal_equations_are_those_of_whitened_slopes(tolerance: float) -> None:
    rng = np.random.default_rng(5)
    f = np.geomspace(20.0, 900.0, 60)
    H = rng.standard_normal((60, 3)) + 1j * rng.standard_normal((60, 3))
    half = rng.standard_normal((60, 3, 3)) + 1j * rng.standard_normal((60, 3, 3))
    cov = 1e-4 * (half @ np.conj(half.swapaxes(1, 2)) + np.eye(3))  # channels that belong together
    white = whitener(f, H, cov, np.full(60, 40.0), tolerance)
    assert bool(white.U.size) == (tolerance > 0.0)
    slopes = (rng.standard_normal((7, 60, 3)) + 1j * rng.standard_normal((7, 60, 3))) * np.geomspace(1e-3, 1e3, 7)[
        :, None, None
    ]
    r = white(rng.standard_normal((60, 3)) * (1.0 + 0.5j))
    A, g = white.normal(slopes, r)
    J = white(slopes).T
    size = np.linalg.norm(J, axis=0)
    # The product takes away up to 1 - 1/(1 + s2) of what it adds: round-off grows by no more than 1e4 here.
    assert np.abs(A - J.T @ J).max() == pytest.approx(0.0, abs=1e-12 * float(size.max() ** 2))
    assert A / np.outer(size, size) == pytest.approx(J.T @ J / np.outer(size, size), abs=1e-11)
    assert g / size == pytest.approx(J.T @ r / size, abs=1e-11 * float(np.linalg.norm(r)))


@dataclass(frozen=True, eq=False)
class Bent:
    """Decays that overlap: a long valley that bends. Noise of one, and priors of one about `prior`."""

    t: Array
    data: Array
    prior: Array

    def curve(self, x: Array) -> Array:
        return np.asarray(40.0 * np.exp(x[0] - self.t * np.exp(0.3 * x[1])) + 30.0 * np.exp(-self.t * np.exp(x[2])))

    def residual(self, x: Array) -> Array:
        return np.concatenate([self.data - self.curve(x), x - self.prior])

    def slopes(self, x: Array) -> Array:
        first = 40.0 * np.exp(x[0] - self.t * np.exp(0.3 * x[1]))
        second = 30.0 * np.exp(-self.t * np.exp(x[2]))
        columns = [-first, 0.3 * np.exp(0.3 * x[1]) * self.t * first, np.exp(x[2]) * self.t * second]
        return np.vstack([np.array(columns).T, np.eye(3)])

    def normal(self, x: Array, r: Array) -> tuple[Array, Array]:
        J = self.slopes(x)
        return J.T @ J, J.T @ r

    def bounds(self) -> tuple[Array, Array]:
        return np.full(3, -20.0), np.full(3, 20.0)


@pytest.mark.parametrize(("to", "off"), [(LOOSE, 0.15), (CLOSE, 0.05), (EXACT, 1.5e-3)])
def test_a_search_ends_as_near_as_its_precision_says(to: Precision, off: float) -> None:
    """off: in standard uncertainties, sqrt(2 end): half the square of what is left to go is the fall that is left."""
    t = np.linspace(0.0, 3.0, 40)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        truth = rng.standard_normal(3)
        bent = Bent(t, np.zeros_like(t), np.zeros(3))
        bent = Bent(t, bent.curve(truth) + rng.standard_normal(t.size), np.zeros(3))
        found = descend(bent, np.zeros(3), 60, to)
        best = least_squares(bent.residual, found.x, bent.slopes, xtol=1e-15, ftol=1e-15, gtol=1e-12)
        assert found.settled
        away = found.x - best.x
        assert np.sqrt(away @ found.normal @ away) < off, seed
