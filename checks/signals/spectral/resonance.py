"""Resonances in a record: found by a test with a known rate of false alarms, then fitted with intervals.

A pole is accepted if it explains more than chance lets the best of many tried poles explain. Candidates lie on a grid
of frequencies and damping ratios; the best one is fitted, and the F test of its contribution to all channels, times the
number of candidates (Bonferroni), must stay below CHANCE."""

import math
from dataclasses import dataclass, replace

import numpy as np

from checks.arrays import Array, Complex
from checks.distributions import f as f_distribution
from checks.signals.spectral.poles import (
    FittedRoot,
    PoleFit,
    PoleWindow,
    basis,
    eliminate,
    enough_bins,
    fit_poles,
    root_numbers,
    with_noise_of,
)

CHANCE = 1e-3  # probability of a false pole, over the whole range that is searched
ORDER = 4  # of the polynomials beside the poles
DAMPING_RATIOS = (0.002, 0.005, 0.0125, 0.03)
DAMPING_MAX = 0.1  # above, a resonance has no distinct peak
APART = 3.0  # half-power half-widths between two distinct resonances
MAX_CANDIDATES = 300  # limits the time; candidates are then wider apart
CANDIDATE_BINS = 500  # the grid is tried on so many bins; its best is fitted and judged on all
_NONE = np.zeros(0, dtype=complex)


@dataclass(frozen=True, eq=False, repr=False)
class Resonance(FittedRoot):
    """Resonance of a record. amplitude (C,): height by itself, in the channels' units.

    p : probability that chance shows such a pole somewhere in the range searched. fit: the curve, k: its pole."""

    amplitude: Array
    p: float
    fit: PoleFit
    k: int = 0

    @property
    def seen(self) -> bool:
        """Return whether the data determine the pole: it decays, and its damping is known to better than a third."""
        placed = 3.0 * self.u_damping < self.damping_ratio < DAMPING_MAX
        return self.p < CHANCE and placed and math.isfinite(self.u_Hz_model)

    @property
    def half_width_Hz(self) -> float:
        return self.damping_ratio * self.f_Hz


def find(w: PoleWindow, f_lo: float, f_hi: float, order: int = ORDER) -> Resonance | None:
    """Return the strongest resonance in f_lo..f_hi [Hz] of a window, or None if chance explains as much."""
    if not enough_bins(w, 1, order):
        return None
    best, tried = candidate(w, f_lo, f_hi, _NONE, order)
    fitted = fit_poles(w, [w.scaled(best)], order)
    if fitted is None:
        return None
    found = resonance(fitted, finer(fitted), 0, evidence(fitted, _NONE, tried))
    return found if found.seen and f_lo <= found.f_Hz <= f_hi else None


def find_beside(
    w: PoleWindow, first: Resonance, f_lo: float, f_hi: float, share: float
) -> tuple[Resonance, Resonance] | None:
    """Return (the first resonance fitted again, a second one) if two poles fit better than one, else None.

    share : least ratio of the second one alone to the first one's fit at its frequency, in one channel. Without noise
    every flaw of a model is significant, but it need not matter."""
    order = first.fit.order
    if not enough_bins(w, 2, order):
        return None
    alone = fit_poles(w, [w.scaled(complex(first.fit.frequencies()[first.k]))], order)
    if alone is None:
        return None
    best, tried = candidate(alone.window, f_lo, f_hi, alone.q, order)
    both = fit_poles(w, [complex(alone.q[0]), w.scaled(best)], order)
    if both is None:
        return None
    checked = finer(both)
    one = resonance(both, checked, 0, first.p)
    two = resonance(both, checked, 1, evidence(both, alone.q, tried))
    beside = np.abs(alone.response()[int(np.argmin(np.abs(w.f - two.f_Hz)))])
    matters = bool((two.amplitude >= share * beside).any())
    apart = abs(two.f_Hz - one.f_Hz) > APART * max(one.half_width_Hz, two.half_width_Hz)
    return (one, two) if two.seen and matters and apart and f_lo <= two.f_Hz <= f_hi else None


def candidate(w: PoleWindow, f_lo: float, f_hi: float, known: Complex, order: int) -> tuple[complex, int]:
    """Return the complex frequency [Hz] of the further pole that explains most besides the `known` (scaled), and the
    number of tried ones.

    A known pole may move: its derivative is among the columns."""
    w = w.thinned(CANDIDATE_BINS)
    # how the response moves with each known pole
    squared = 1.0 / (w.z[:, None] - known) ** 2
    A = np.concatenate([basis(w, known, order), w.U[:, None] * squared, squared], axis=1)
    known_columns, X, _, residual = eliminate(w, A)
    poles = _grid(w, f_lo, f_hi)
    columns = 1.0 / (w.z[:, None] - poles)
    gain = np.zeros(poles.size)
    for c in range(residual.shape[0]):
        gain += _explained_share(known_columns[c] @ X[c], residual[c], columns * (w.U / w.sd[:, c])[:, None])
    return w.frequency(complex(poles[int(np.argmax(gain))])), poles.size


def _explained_share(Q: Complex, residual: Complex, columns: Complex) -> Array:
    """Return (N,) power of a residual (B,) that each of N columns explains beyond Q; 0 if almost nothing is left of a
    column. The transient of the column would add little and is left to the fit."""
    before = np.sum(np.abs(columns) ** 2, axis=0)
    left = before - np.sum(np.abs(Q.conj().T @ columns) ** 2, axis=0)
    counts = left > 1e-6 * before
    return np.where(counts, np.abs(residual.conj() @ columns) ** 2 / np.where(counts, left, 1.0), 0.0)


def _grid(w: PoleWindow, f_lo: float, f_hi: float) -> Complex:
    """Return the scaled candidates: every damping ratio at frequencies a half-power half-width apart. Narrow ones are
    spaced no finer than the bins, and no finer than worth the time."""
    middle, bin_Hz = (f_lo + f_hi) / 2, float(w.f[1] - w.f[0])
    least = max(bin_Hz, len(DAMPING_RATIOS) * (f_hi - f_lo) / MAX_CANDIDATES)
    poles = [
        w.scaled(f * (1 + 1j * ratio))
        for ratio in DAMPING_RATIOS
        for f in np.arange(f_lo, f_hi, max(least, ratio * middle))
    ]
    return np.array(poles)


def evidence(fitted: PoleFit, without: Complex, tried: int) -> float:
    """Return the probability p of the last pole of a fit against the poles `without` (scaled) it, times the candidates
    tried.

    Both fits use the residual noise of the smaller fit, so that the further pole does not profit from noise that it
    reduced itself."""
    order, w = fitted.order, _as_without(fitted, without)
    smaller, larger = (float(np.sum(np.abs(eliminate(w, basis(w, q, order))[-1]) ** 2)) for q in (without, fitted.q))
    C, B = len(w.channels), w.f.size
    # In real numbers: a pole adds itself and a residue of response and of transient in each channel; left are the bins
    # less the coefficients of both in each channel, less all poles.
    added = 4 * C + 2
    freedom = 2 * C * (B - 2 * (fitted.q.size + order + 1)) - 2 * fitted.q.size
    ratio = (smaller - larger) / added / (larger / freedom)
    return min(1.0, tried * float(f_distribution.sf(ratio, added, freedom)))


def _as_without(fitted: PoleFit, without: Complex) -> PoleWindow:
    """Return the window of a fit with the noise estimated by a fit of fewer poles."""
    w = fitted.window
    even = replace(w, sd=np.ones(w.sd.shape))
    for _ in range(2):
        residual = eliminate(even, basis(w, without, fitted.order))[-1].T * even.sd
        even = with_noise_of(even, residual)
    return even


def finer(fitted: PoleFit) -> PoleFit | None:
    """Return the fit with polynomials of one order more."""
    return fit_poles(fitted.window, list(fitted.q), fitted.order + 1, rounds=1)


def resonance(found: PoleFit, checked: PoleFit | None, k: int, p: float) -> Resonance:
    """Return the k-th pole of a fit as a resonance; `checked`: the fit with one order more."""
    finer = None if checked is None else complex(checked.frequencies()[k])
    numbers = root_numbers(complex(found.frequencies()[k]), found.u(k), finer)
    return Resonance(**numbers, amplitude=found.amplitude(k), p=p, fit=found, k=k)
