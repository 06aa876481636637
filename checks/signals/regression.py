"""Linear least squares whose covariance holds for coloured residuals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fit:
    """y ~ design @ x. x (p,), covariance (p, p), residual (N,) = y - design @ x, in the units of y and the design."""

    x: Array
    covariance: Array
    residual: Array

    @property
    def scatter(self) -> float:
        """Root mean square of the residual, per degree of freedom."""
        return float(np.sqrt(self.residual @ self.residual / (self.residual.size - self.x.size)))

    def u(self, weights: Array) -> float:
        """Standard uncertainty of weights (p,) @ x."""
        return float(np.sqrt(max(float(weights @ self.covariance @ weights), 0.0)))


def least_squares(design: Array, y: Array, lags: int | None = None) -> Fit:
    """Ordinary least squares of y (N,) on design (N, p), covariance by Newey & West (Econometrica 55, 1987) with
    Bartlett weights over `lags` samples (None: 4 (N/100)^(2/9)), times N/(N - p).

    Raises ValueError when N <= p or the columns are dependent.
    """
    n, p = design.shape
    if n <= p:
        raise ValueError(f"{n} samples cannot carry {p} parameters")
    q, r = np.linalg.qr(design)
    diagonal = np.abs(np.diag(r))
    norms = np.linalg.norm(design, axis=0)
    if not (diagonal > 1e-10 * norms).all():
        raise ValueError("the samples cannot tell the parameters of the fit apart")
    x = np.linalg.solve(r, q.T @ y)
    residual = y - design @ x
    scores = q * residual[:, None]
    # An orthonormal basis keeps the middle of the sandwich well scaled whatever the units of the columns.
    middle = scores.T @ scores
    reach = min(n - 1, int(4 * (n / 100) ** (2 / 9)) if lags is None else lags)
    for lag in range(1, reach + 1):
        cross = scores[lag:].T @ scores[:-lag]
        middle += (1 - lag / (reach + 1)) * (cross + cross.T)
    r_inverse = np.linalg.inv(r)
    return Fit(x, r_inverse @ middle @ r_inverse.T * n / (n - p), residual)
