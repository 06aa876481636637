"""The sign of the phase: the poles of a stable system lie in the left half plane, and in the right one if its response
was stored as the complex conjugate (phase of e^-jwt)."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex

MOST = 6  # resonances that are examined, the largest first
FEWEST = 7  # bins in a fit
REACH = 2.0  # half-widths on each side of a peak that are fitted
PROMINENT = 5.0  # times the response around: a peak that is a resonance
RESIDUAL = 0.05  # relative: of a fit that describes the peak
SURE = 5.0  # standard deviations that a pole lies off the imaginary axis
WIDTHS = (0.4, 2.5)  # of the fitted damping over that of the half-power width


@dataclass(frozen=True)
class PolePlace:
    """A resonance [Hz] and its damping ratio, negative if its pole lies in the right half plane."""

    f_Hz: float
    damping_ratio: float


def clear_poles(f: Array, H: Complex) -> list[PolePlace]:
    """Return the poles at the clear resonances of a response (F,) over f (F,) [Hz]."""
    size = np.abs(H)
    inner = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:]) & (f[1:-1] > 0.0)) + 1
    found: list[PolePlace] = []
    for peak in inner[np.argsort(size[inner])[::-1]][: 4 * MOST]:
        place = _pole(f, H, int(peak))
        if place is not None and all(abs(place.f_Hz - each.f_Hz) > 0.01 * each.f_Hz for each in found):
            found.append(place)
        if len(found) == MOST:
            break
    return found


def conjugate_resonances(f: Array, H: Complex) -> list[PolePlace]:
    """Return the poles at the clear resonances of responses (F, C) if all lie in the right half plane, else none."""
    poles = [pole for column in H.T for pole in clear_poles(f, column)]
    return poles if all(pole.damping_ratio < 0.0 for pole in poles) else []


def _pole(f: Array, H: Complex, peak: int) -> PolePlace | None:
    """Fit a pole beside a parabola about a peak; None if the peak is no clear resonance."""
    size = np.abs(H)
    below = np.flatnonzero(size < size[peak] / np.sqrt(2.0))
    left, right = below[below < peak], below[below > peak]
    if not left.size or not right.size:
        return None
    half = 0.5 * (f[right[0]] - f[left[-1]])
    window = np.flatnonzero(np.abs(f - f[peak]) <= REACH * half)
    around = np.flatnonzero((np.abs(f - f[peak]) <= 10.0 * half) & (np.abs(f - f[peak]) > 4.0 * half))
    if window.size < FEWEST or not around.size or size[peak] < PROMINENT * np.median(size[around]):
        return None
    x = 1j * (f[window] - f[peak]) / half  # (s - j w) over the half width: the pole lies near -1
    y = H[window] / size[peak]
    A = np.column_stack([y, np.ones_like(x), x, x**2])
    b = x * y
    solution, *_ = np.linalg.lstsq(A, b, rcond=None)
    pole = solution[0]
    fitted = A[:, 1:] @ solution[1:] / (x - pole)
    residual = float(np.linalg.norm(fitted - y) / np.linalg.norm(y))
    left_over = b - A @ solution
    scatter = np.sqrt(np.linalg.inv(A.conj().T @ A)[0, 0].real * np.vdot(left_over, left_over).real / (x.size - 4))
    clear = residual < RESIDUAL and abs(pole.real) > SURE * scatter and WIDTHS[0] < abs(pole.real) < WIDTHS[1]
    at = float(f[peak] + half * pole.imag)
    return PolePlace(at, float(-half * pole.real / at)) if clear and at > 0.0 else None
