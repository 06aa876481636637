"""Resonances in a measured response: found by a test with a known rate of false alarms, then fitted with intervals.

A pole is there when it explains more than chance lets one of many tried poles explain: for every candidate on a grid of
frequencies and damping ratios, the F test of the residues it adds in all channels; the smallest p times the number of
candidates (Bonferroni) must stay below CHANCE. Only bins with independent errors are tested.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from checks.signals.poles import PoleFit, Window, fit_poles, thinned

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

CHANCE = 1e-3  # probability of a pole where there is none, over the whole range that is searched
ORDER = 4  # of the polynomials beside the poles
DAMPING_RATIOS = (0.002, 0.005, 0.0125, 0.03)
DAMPING_MAX = 0.1


@dataclass(frozen=True, eq=False)
class Resonance:
    """f_Hz: undamped natural frequency |p|/2 pi; damping_ratio: -Re p/|p|. u_*: standard uncertainties from the
    scatter, u_*_model from one order more of the polynomials. amplitude (C,): height by itself, in the channels' units.

    p : probability that chance shows such a pole somewhere in the range searched. fit: the curve, k: its pole.
    """

    f_Hz: float
    damping_ratio: float
    u_Hz: float
    u_Hz_model: float
    u_damping: float
    u_damping_model: float
    amplitude: Array
    p: float
    fit: PoleFit
    k: int = 0

    @property
    def seen(self) -> bool:
        """A pole that the data place: it decays, and both its numbers are known better than to a third."""
        placed = 3.0 * self.u_damping < self.damping_ratio < DAMPING_MAX
        return self.p < CHANCE and placed and math.isfinite(self.u_Hz_model)


@dataclass(frozen=True)
class Candidate:
    """Complex frequency [Hz] of the most likely further pole, and its p after counting all candidates."""

    f_Hz: complex
    p: float


def search(w: Window, f_lo: float, f_hi: float, known: PoleFit | None = None, order: int = ORDER) -> Candidate:
    """The pole in f_lo..f_hi [Hz] that explains most of what `known` (no pole: polynomials alone) leaves over."""
    thin = thinned(w)
    q = np.array([]) if known is None else known.q
    candidates = _grid(thin, f_lo, f_hi)
    Q, residual = _left_over(thin, q, known, order)
    reduction = np.zeros(candidates.size)
    for c in range(residual.shape[0]):
        g = (1.0 / (thin.z[:, None] - candidates)) / thin.sd[:, c : c + 1]
        whole = np.sum(np.abs(g) ** 2, axis=0)
        g = g - Q[c] @ (Q[c].conj().T @ g)
        size = np.sum(np.abs(g) ** 2, axis=0)
        told = size > 1e-8 * whole  # else it is one of the columns that are there already
        reduction += np.where(told, np.abs(g.conj().T @ residual[c]) ** 2 / np.where(told, size, 1.0), 0.0)
    best = int(np.argmax(reduction))
    C, B = residual.shape
    rest = float(np.sum(np.abs(residual) ** 2)) - float(reduction[best])
    freedom = 2 * (C * (B - Q.shape[2]) - C)
    ratio = math.inf if rest <= 0 else float(reduction[best]) / (2 * C) / (rest / freedom)
    p = min(1.0, candidates.size * float(f_distribution.sf(ratio, 2 * C, freedom)))
    return Candidate(w.frequency(complex(candidates[best])), p)


def _grid(w: Window, f_lo: float, f_hi: float) -> Complex:
    """Scaled candidates: every damping ratio at frequencies a half-power half-width apart, but not below the grid."""
    step = w.f[1] - w.f[0]
    poles = [
        w.scaled(f * (1 + 1j * ratio))
        for ratio in DAMPING_RATIOS
        for f in np.arange(f_lo, f_hi, max(step / 2, ratio * (f_lo + f_hi) / 2))
    ]
    return np.array(poles)


def _left_over(w: Window, q: Complex, known: PoleFit | None, order: int) -> tuple[Complex, Complex]:
    """Q (C, B, P) orthonormal columns of what is in the model already, movement of its poles included, and the residual
    (C, B), both weighted."""
    weight = 1.0 / w.sd.T
    columns = [w.z[:, None] ** np.arange(order + 1) + 0j, 1.0 / (w.z[:, None] - q), 1.0 / (w.z[:, None] - q) ** 2]
    A = weight[:, :, None] * np.concatenate(columns, axis=1)
    Q, _ = np.linalg.qr(A)
    y = weight * w.H.T
    return Q, y - np.einsum("cbp,cp->cb", Q, np.einsum("cbp,cb->cp", Q.conj(), y))


def fit(w: Window, start_Hz: list[complex], order: int = ORDER) -> tuple[PoleFit, PoleFit | None] | None:
    """Joint fit of poles near these complex frequencies, and the same with polynomials of one order more."""
    start = [w.scaled(f) for f in start_Hz]
    found = fit_poles(w, start, order)
    return None if found is None else (found, fit_poles(w, list(found.q), order + 1))


def resonance(found: PoleFit, finer: PoleFit | None, k: int, p: float) -> Resonance:
    """The k-th pole of a fit as a resonance."""
    f = complex(found.frequencies()[k])
    other = complex(finer.frequencies()[k]) if finer is not None else complex(math.inf, math.inf)
    known = finer is not None
    size, u = abs(f), found.u(k)
    return Resonance(
        f_Hz=size,
        damping_ratio=f.imag / size,
        u_Hz=u,
        u_Hz_model=abs(abs(other) - size) if known else math.inf,
        u_damping=u / size,
        u_damping_model=abs(other.imag / abs(other) - f.imag / size) if known else math.inf,
        amplitude=found.amplitude(k),
        p=p,
        fit=found,
        k=k,
    )


def find(w: Window, f_lo: float, f_hi: float, order: int = ORDER) -> Resonance | None:
    """The strongest resonance in f_lo..f_hi [Hz], or None when chance shows as much or the fit leaves the band."""
    best = search(w, f_lo, f_hi, None, order)
    if best.p >= CHANCE:
        return None
    fitted = fit(w, [best.f_Hz], order)
    if fitted is None:
        return None
    found = resonance(*fitted, 0, best.p)
    return found if found.seen and f_lo <= found.f_Hz <= f_hi else None


def find_beside(
    w: Window, first: Resonance, f_lo: float, f_hi: float, share: float
) -> tuple[Resonance, Resonance] | None:
    """(the first one fitted anew, a second one) when two poles fit better than one, else None.

    share : the second one alone must be this part of what the first one's fit shows at its frequency, in one channel at
    least. A response without noise tells every flaw of a model: what is significant need not matter.
    """
    order, at_Hz = first.fit.order, complex(first.fit.frequencies()[first.k])
    alone = fit_poles(w, [w.scaled(at_Hz)], order)
    if alone is None:
        return None
    best = search(w, f_lo, f_hi, alone, order)
    if best.p >= CHANCE:
        return None
    fitted = fit(w, [w.frequency(complex(alone.q[0])), best.f_Hz], order)
    if fitted is None:
        return None
    one, two = (resonance(*fitted, k, p) for k, p in ((0, first.p), (1, best.p)))
    at = int(np.argmin(np.abs(w.f - two.f_Hz)))
    beside = np.abs(alone.response()[at])
    matters = bool((two.amplitude >= share * beside).any())
    return (one, two) if two.seen and matters and f_lo <= two.f_Hz <= f_hi else None
