"""What is said of struts that differ from their model as real ones do: intervals that hold, and a risk that is what it
is said to be. In full with ACCEPT_SOAK=1; `pytest -s` shows the tables.
"""

import os
from time import process_time

import numpy as np
import pytest
from scipy import stats

from checks.cause import NoResult
from checks.misalignment.estimate import estimate_misalignment
from checks.verdict import probability_outside
from specs.spec import Limit
from tests.checks.misalignment.as_built import AsBuilt, stated, strut

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
STRUTS = 30 if SOAK else 2  # of a scatter
LIMITED = 134 if SOAK else 2  # near a limit, of a scatter
LIMIT_UM = {"dx": 50.0, "dy": 100.0}
NEAR_UM = 12.0
OUTSIDE = 0.0005  # each tail of the 99.9 % band
PROMISED = float(stats.chi2.cdf(4.0, 1))  # 95.45 %, by k = 2
RMS_UM = (5.0, 3.0)
SECONDS = 5.0, 30.0  # median and worst of one core

SCATTERS = pytest.mark.parametrize("scatter", [0.01, *(pytest.param(s, marks=pytest.mark.soak) for s in (0.005, 0.02))])

pytestmark = pytest.mark.takes_data


def answer(s: AsBuilt, scatter: float, beside: bool = False) -> tuple[float, float, float, float] | None:
    """dx, U, dy, U [um], or None where there is no result."""
    model, table = stated(scatter, beside)
    try:
        found = estimate_misalignment(model, s.first, table, s.second)
    except NoResult:
        return None
    return None if found.reason is not None else (found.dx.value, found.dx.U, found.dy.value, found.dy.U)


def least_inside(n: int) -> int:
    return int(stats.binom.ppf(OUTSIDE, n, PROMISED))


@SCATTERS
def test_intervals_hold_where_modes_scatter(scatter: float) -> None:
    rng, rows, seconds = np.random.default_rng([14, round(1e4 * scatter)]), [], []
    for _ in range(STRUTS):
        at = float(rng.uniform(-100.0, 100.0)), float(rng.uniform(-350.0, 350.0))
        s = strut(rng, scatter, at)
        began = process_time()
        found = answer(s, scatter)
        seconds.append(process_time() - began)
        if found is not None:
            rows.append((found[0] - s.dx, found[1], found[2] - s.dy, found[3]))
    got = np.array(rows)
    error, U = got[:, ::2], got[:, 1::2]
    rms, inside = np.sqrt(np.mean(error**2, axis=0)), (np.abs(error) <= U).sum(axis=0)
    print(
        f"\nscatter {100 * scatter:g} %: {len(got)} of {STRUTS} answered; RMS dx {rms[0]:.2f}, dy {rms[1]:.2f} um; "
        f"within U dx {inside[0]}, dy {inside[1]}; median U {np.median(U[:, 0]):.1f}, {np.median(U[:, 1]):.1f} um; "
        f"{np.median(seconds):.1f} s, worst {max(seconds):.1f} s"
    )
    assert len(got) >= 0.9 * STRUTS
    assert (inside >= least_inside(len(got))).all()
    if SOAK:
        assert np.median(seconds) <= SECONDS[0]
        assert max(seconds) <= SECONDS[1]
        if scatter <= 0.01:
            assert (rms <= RMS_UM).all()


@SCATTERS
def test_false_acceptance_is_no_more_frequent_than_stated(scatter: float) -> None:
    """Struts about a limit, judged by `simple`: of those inside by the estimate, as many are outside in truth as their
    stated probabilities say, within chance. Stated by the posterior, for a strut that may lie anywhere (JCGM 106)."""
    rng = np.random.default_rng([15, round(1e4 * scatter)])
    risks, wrong = [], 0
    for k in range(LIMITED):
        axis = "dx" if k % 2 == 0 else "dy"
        size = LIMIT_UM[axis] + rng.uniform(-NEAR_UM, NEAR_UM)
        side = rng.choice([-1.0, 1.0]) * size
        at = (side, float(rng.uniform(-50, 50))) if axis == "dx" else (float(rng.uniform(-25, 25)), side)
        found = answer(strut(rng, scatter, at), scatter)
        if found is None:
            continue
        value, U = found[:2] if axis == "dx" else found[2:]
        if abs(value) <= LIMIT_UM[axis]:
            limit = Limit(lower=-LIMIT_UM[axis], upper=LIMIT_UM[axis], unit="um", rule="simple", source="proof")
            risks.append(probability_outside(value, U, limit))
            wrong += size > LIMIT_UM[axis]
    expected, spread = sum(risks), float(np.sqrt(sum(p * (1 - p) for p in risks)))
    print(
        f"\nscatter {100 * scatter:g} %: {len(risks)} of {LIMITED} accepted; stated {expected:.1f} outside "
        f"(sd {spread:.1f}), observed {wrong}"
    )
    assert wrong <= expected + 3.3 * spread + 1.0
