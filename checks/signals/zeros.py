"""The zero of a response near a minimum: root of a local complex polynomial, with its interval."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.signals.poles import Window, spread

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ORDER = 5


@dataclass(frozen=True, eq=False)
class Zero:
    """f_Hz: undamped frequency |s|/2 pi; damping_ratio: -Re s/|s|, negative for a zero in the right half plane.
    u_Hz, u_damping: standard uncertainties from the scatter; u_*_model: from one order more of the polynomial.
    f (B,), measured (B,), response (B,): the data and the fitted curve."""

    f_Hz: float
    damping_ratio: float
    u_Hz: float
    u_Hz_model: float
    u_damping: float
    u_damping_model: float
    f: Array
    measured: Complex
    response: Complex

    @property
    def side(self) -> str:
        """ "minimum-phase", "non-minimum-phase", or "undecided" where the interval of the damping holds 0."""
        if abs(self.damping_ratio) <= 2.0 * math.hypot(self.u_damping, self.u_damping_model):
            return "undecided"
        return "minimum-phase" if self.damping_ratio > 0 else "non-minimum-phase"


def find_zero(w: Window, order: int = ORDER) -> Zero | None:
    """Zero of the only channel of a window, or None where the polynomial has no root inside it.

    Errors move a root by -P(root)'s error over P'(root) (first order). The misfit widens the scatter (Birge).
    """
    found, finer = _root(w, order), _root(w, order + 1)
    if found is None or finer is None:
        return None
    f, u, response = found
    size = abs(f)
    return Zero(
        f_Hz=size,
        damping_ratio=f.imag / size,
        u_Hz=u,
        u_Hz_model=abs(abs(finer[0]) - size),
        u_damping=u / size,
        u_damping_model=abs(finer[0].imag / abs(finer[0]) - f.imag / size),
        f=w.f,
        measured=w.H[:, 0],
        response=response,
    )


def _root(w: Window, order: int) -> tuple[complex, float, Complex] | None:
    """(complex frequency of the root nearest the axis [Hz], its u [Hz] along and across, fitted curve)."""
    powers = np.arange(order + 1)
    basis = w.z[:, None] ** powers
    solve = np.linalg.pinv(basis / w.sd) / w.sd.T
    c = solve @ w.H[:, 0]
    roots = np.roots(c[::-1])
    roots = roots[np.abs(roots.real) < 1.0]
    if roots.size == 0:
        return None
    root = complex(roots[np.argmin(np.abs(roots.imag))])
    slope = np.sum(powers[1:] * c[1:] * root ** (powers[1:] - 1))
    influence = (root**powers @ solve / slope)[:, None]
    response = basis @ c
    misfit = float(np.sum(np.abs((w.H[:, 0] - response) / w.sd[:, 0]) ** 2)) / (w.z.size - order - 1)
    u = w.half * float(np.sqrt(max(misfit, 1.0) * spread(w, influence) / 2))
    return w.frequency(root), u, response
