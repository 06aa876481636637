"""Linear least squares whose covariance holds for coloured residuals."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array


@dataclass(frozen=True, eq=False)
class LinearFit:
    """Fit of y ~ design @ x. x (p,), covariance (p, p), residual (N,), in the units of y and design."""

    x: Array
    covariance: Array
    residual: Array

    @property
    def scatter(self) -> float:
        """Return the standard deviation of the residual, per degree of freedom."""
        return float(np.sqrt(self.residual @ self.residual / (self.residual.size - self.x.size)))

    def u(self, weights: Array) -> float:
        """Return the standard uncertainty of weights (p,) @ x."""
        return float(np.sqrt(max(float(weights @ self.covariance @ weights), 0.0)))


def least_squares(design: Array, y: Array) -> LinearFit:
    """Return the least squares of y (N,) on design (N, p); covariance scaled by the residual and by its `colour`.

    Raises ValueError if N <= p or the columns are linearly dependent."""
    n, p = design.shape
    if n <= p:
        raise ValueError(f"{n} samples cannot carry {p} parameters")
    q, r = np.linalg.qr(design)
    if not (np.abs(np.diag(r)) > 1e-9 * np.linalg.norm(design, axis=0)).all():
        raise ValueError("the samples cannot tell the parameters of the fit apart")
    x = np.linalg.solve(r, q.T @ y)
    residual = y - design @ x
    r_inverse = np.linalg.inv(r)
    variance = float(residual @ residual) / (n - p) * colour(residual)
    return LinearFit(x, variance * r_inverse @ r_inverse.T, residual)


def colour(residual: Array) -> float:
    """Return the factor by which a slow combination of the samples scatters more than for a white residual (N,): one
    plus twice the sum of the autocorrelation, Bartlett weights over 2 N^(1/3) lags ([NW87]).

    Never below 1: a residual that looks bluer than white does not justify a smaller uncertainty."""
    power = float(residual @ residual)
    if power == 0.0:
        return 1.0
    lags = min(residual.size - 1, int(2 * residual.size ** (1 / 3)))
    weighted = ((1 - lag / (lags + 1)) * float(residual[lag:] @ residual[:-lag]) for lag in range(1, lags + 1))
    return max(1.0, 1 + 2 * sum(weighted) / power)
