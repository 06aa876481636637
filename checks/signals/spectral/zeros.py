"""The zero of a response near its minimum: root of a local complex polynomial, with its interval."""

import math
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.signals.spectral.poles import FittedRoot, PoleWindow, basis, eliminate, root_numbers, scatter, with_noise_of

ORDER = 4
NEAR = 0.03  # of half the band: where the coherence of a zero is read
_NO_POLE = np.zeros(0, dtype=complex)


@dataclass(frozen=True, eq=False, repr=False)
class Zero(FittedRoot):
    """Zero of a response, its damping ratio negative in the right half plane. f (B,), response (B,): the fitted curve.
    coherence: of output with input about the zero, 0..1."""

    coherence: float
    f: Array
    response: Complex

    @property
    def side(self) -> str:
        """Return "minimum-phase", "non-minimum-phase", or "undecided" if the damping's interval includes 0."""
        if abs(self.damping_ratio) <= self.U_damping:
            return "undecided"
        return "minimum-phase" if self.damping_ratio > 0 else "non-minimum-phase"


@dataclass(frozen=True, eq=False)
class _Root:
    """Root nearest the axis. f: its complex frequency [Hz]; u: of its real and its imaginary part [Hz]."""

    f: complex
    u: float
    coherence: float
    response: Complex


def find_zero(w: PoleWindow) -> Zero | None:
    """Return the zero of the only channel of a window, or None if the polynomial has no root inside it.

    Response and transient are polynomials of the frequency. Errors move a root by the error there over the slope."""
    found, finer = _root(w, ORDER), _root(w, ORDER + 1)
    if found is None or finer is None:
        return None
    numbers = root_numbers(found.f, found.u, finer.f)
    return Zero(**numbers, coherence=found.coherence, f=w.f, response=found.response)


def _root(w: PoleWindow, order: int) -> _Root | None:
    A = basis(w, _NO_POLE, order)
    w = with_noise_of(w, eliminate(w, A)[-1].T)
    *_, coefficients, residual = eliminate(w, A)
    powers = np.arange(order + 1)
    c = coefficients[0, : order + 1]
    roots = np.roots(c[::-1])
    roots = roots[np.abs(roots.real) < 1.0]
    if roots.size == 0:
        return None
    root = complex(roots[np.argmin(np.abs(roots.imag))])
    slope = np.sum(powers[1:] * c[1:] * root ** (powers[1:] - 1))
    solve = np.linalg.pinv(A / w.sd)[: order + 1]
    gain = (root**powers @ solve / slope)[None, None, :]
    B = w.f.size
    variance = float(scatter(gain, residual)[0]) * B / (B - 2 * (order + 1))
    response = (w.z[:, None] ** powers) @ c
    return _Root(
        w.frequency(root), w.half * math.sqrt(variance / 2), _coherence(w, root, residual), response * w.scale[0]
    )


def _coherence(w: PoleWindow, root: complex, residual: Complex) -> float:
    """Return the share of the output about the root that is not noise."""
    near = np.abs(w.z - root.real) < NEAR
    total = float(np.sum(np.abs(w.Y[near, 0]) ** 2))
    noise = float(np.sum(np.abs(residual[0, near] * w.sd[near, 0]) ** 2))
    return max(0.0, 1.0 - noise / total) if total > 0 else 0.0
