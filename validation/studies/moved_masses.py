"""Two masses that were moved on a measured frame, located by its natural frequencies and a surface through simulated
runs of it; and where the runs say nothing.

    python -m validation.studies.moved_masses

The logarithm of a frequency is a quadratic of both positions, by least squares over the runs. A position at which the
surface is less certain than a single run (a leverage above 1) is beyond what the model was shown."""

from dataclasses import dataclass

import numpy as np
from scipy.io import loadmat
from scipy.optimize import least_squares

from checks.arrays import Array
from validation.data.measured_frames import MEASURED

MODES, RUNS = (0, 1, 2, 3, 4), (0, 1, 2, 3, 5)  # columns of the measured modes and of the same ones of the runs
TOLERANCE = 0.005  # of a frequency
MIDDLE, HALF, LENGTH = 20.0, 15.0, 40.0  # cm
STARTS = ((8.0, 8.0), (32.0, 32.0), (8.0, 32.0), (32.0, 8.0), (20.0, 20.0))
COVERAGE = 1.96
MOST_APART = 12.0  # cm, of the runs' masses


@dataclass(frozen=True)
class Located:
    """at, U (2,): positions and half-widths of their 95 % intervals [cm]; leverage: variance of the surface there over
    that of one run."""

    true: Array
    at: Array
    U: Array
    leverage: float

    @property
    def beyond(self) -> bool:
        """Return whether the position is beyond what the model was shown."""
        return self.leverage > 1.0

    @property
    def shown(self) -> bool:
        """Return whether the runs had the masses as near to each other as they truly were."""
        return bool(abs(self.true[0] - self.true[1]) < MOST_APART)


def locate() -> list[Located]:
    """Return what is found for every measured configuration."""
    runs = loadmat(MEASURED / "frame_masses_simulated.mat", simplify_cells=True)["DATA"]
    measured = loadmat(MEASURED / "frame_masses_measured.mat", simplify_cells=True)["Data_experimental"]
    X, Y = _terms(np.column_stack([runs["p1"], runs["p2"]])), np.log(runs["f"][:, RUNS])
    surface, *_ = np.linalg.lstsq(X, Y, rcond=None)
    spread = np.sqrt(np.sum((Y - X @ surface) ** 2, axis=0) / (len(X) - X.shape[1]))
    inner = np.linalg.inv(X.T @ X)

    def leverage(p: Array) -> float:
        x = _terms(p)[0]
        return float(x @ inner @ x)

    out = []
    for true, f in zip(measured["p"], measured["Nat_Freq_Exp"], strict=True):
        wanted = np.log(f[list(MODES)])

        def residuals(p: Array, wanted: Array = wanted) -> Array:
            size = np.sqrt(spread**2 * (1.0 + leverage(p)) + TOLERANCE**2)
            return np.asarray((wanted - _terms(p)[0] @ surface) / size)

        fits = [least_squares(residuals, p, bounds=(0.0, LENGTH)) for p in STARTS]
        best = min(fits, key=lambda fit: fit.cost)
        U = COVERAGE * np.sqrt(np.diag(np.linalg.pinv(best.jac.T @ best.jac)))
        out.append(Located(np.asarray(true, float), best.x, U, leverage(best.x)))
    return out


def _terms(p: Array) -> Array:
    """Return the terms (k, 6) of a quadratic of positions (k, 2)."""
    a, b = ((np.atleast_2d(p) - MIDDLE) / HALF).T
    return np.column_stack([np.ones_like(a), a, b, a * a, a * b, b * b])


if __name__ == "__main__":
    for m in locate():
        answer = "beyond what the model was shown" if m.beyond else f"{m.at.round(1)} +- {m.U.round(1)} cm"
        print(f"{m.true} cm{'' if m.shown else ' (not shown)'}: {answer}; leverage {m.leverage:.2f}")
