"""Local polynomials with the widest neighbourhood that each bin allows: for sweeps, and for less error off resonance.

Near the beginning and the end of a sweep the response to the input looks like a transient within a few bins, and a
narrow fit cannot tell them apart: its variance says so. A wider neighbourhood can, where the response is smooth enough.
"""

from collections.abc import Mapping

import numpy as np
from scipy.special import fdtri

from checks.arrays import Array
from checks.signals.spectral.frf import Frf, Mask
from checks.signals.spectral.lpm import HALF, ORDER, LocalPolynomialFit, LocalRegression, LpmTransforms

HALVES = (HALF, 2 * HALF, 4 * HALF)
# Share of bins and channels that stay with the narrower fit though the wider one is as good. More of it would let luck
# choose: a narrow residual that happens to be small would be taken at its word.
LEVEL = 0.02


def lpm_wide(
    u: Array,
    y: Array | Mapping[str, Array],
    fs: float,
    *,
    f_lo: float = 0.0,
    f_hi: float | None = None,
    step: int = 1,
    order: int = ORDER,
    halves: tuple[int, ...] = HALVES,
    input: str = "u",
) -> Frf:
    """`lpm` where each bin takes the widest of `halves` (growing) whose residual is no larger than the narrower one's.

    Judged by an F test on the noise of every channel: a neighbourhood too wide for a resonance leaves its misfit in the
    residual. The test uses the residuals only, which are independent of the error of H, so that regions stay honest.
    nu is that of the chosen fit; `correlation` is that of the widest. Arguments, units and errors as `lpm`.
    """
    problem = LpmTransforms.of(u, y, fs, f_lo, f_hi, step, input)
    local = LocalRegression.of(order, halves[0])
    bins = problem.bins(halves[0])
    best = problem.fit(bins, local)
    nu = np.full(bins.shape, float(local.dof))
    for half in halves[1:]:
        local = LocalRegression.of(order, half)
        room = np.flatnonzero((bins > half) & (bins + half <= (problem.n - 1) // 2))
        if room.size:
            best, nu = _widen(best, nu, problem.fit(bins[room], local), float(local.dof), room)
    note = f"local polynomials of order {order} over +-{' or '.join(map(str, halves))} bins of {fs / len(u):.4g} Hz"
    return problem.frf(bins, best, nu, halves[0], "lpm_wide", note)


def _widen(
    best: LocalPolynomialFit, nu: Array, wide: LocalPolynomialFit, dof: float, room: np.ndarray
) -> tuple[LocalPolynomialFit, Array]:
    """The wide fit, known at the bins `room` of best, wherever it is as good."""
    take = _as_good(best.noise[room], nu[room], wide.noise, dof) & (best.power[room] > 0.0)
    at = room[take]
    H, noise, power, nu = best.H.copy(), best.noise.copy(), best.power.copy(), nu.copy()
    H[at], noise[at], power[at], nu[at] = wide.H[take], wide.noise[take], wide.power[take], dof
    return LocalPolynomialFit(H, noise, power, wide.weights), nu


def _as_good(narrow: np.ndarray, nu: Array, wide: np.ndarray, dof: float) -> Mask:
    """Bins whose noise (B, C, C) in the wide fit chance can explain by that of the narrow one, in every channel."""
    ratio = fdtri(2.0 * dof, 2.0 * nu, 1.0 - LEVEL)[:, None]
    before, after = np.einsum("bcc->bc", narrow).real, np.einsum("bcc->bc", wide).real
    return np.asarray((after <= ratio * before).all(axis=1))
