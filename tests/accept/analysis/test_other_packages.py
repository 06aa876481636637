"""Poles of a hammer test beside those of another package, on the same response: `pip install sdypy-EMA`."""

import numpy as np
import pytest

import accept
from tests.checks.model.units_model import DATA, needs_data

ema = pytest.importorskip("sdypy.EMA", reason="needs the package sdypy-EMA")

RECORDS = [(unit, record) for unit in ("A-01", "A-02") for record in ("bending_X_top", "bending_Y_top", "torsion_left")]
ORDERS = range(10, 30)  # of its polynomials; a pole is the median over them
F_HZ, DAMPING = 3e-5, 5e-3  # relative: how far its poles go apart from order to order, and its damping from the truth


@needs_data
@pytest.mark.parametrize(("unit", "record"), RECORDS)
@pytest.mark.filterwarnings("ignore")
def test_poles_are_those_of_least_squares_in_the_frequency_domain(unit: str, record: str) -> None:
    struck = accept.hammer_response(DATA / "units" / unit / f"{record}.mat")
    theirs = ema.Model(
        frf=struck.frf.H.T, freq=struck.frf.f, lower=60, upper=1000, pol_order_high=30, frf_form="receptance"
    )
    theirs.get_poles(show_progress=False)
    (ours,) = struck.modes.values()
    ours = [m for m in ours if m.f_Hz < 900.0]  # its band ends there
    assert ours
    for mode in ours:
        found = []
        for order in ORDERS:
            f, damping = (np.array(of[order]) for of in (theirs.pole_freq, theirs.pole_xi))
            k = int(np.argmin(np.abs(f - mode.f_Hz)))
            found.append((f[k], damping[k]))
        f_Hz, damping_ratio = np.median(found, axis=0)
        assert f_Hz == pytest.approx(mode.f_Hz, rel=F_HZ)
        assert damping_ratio == pytest.approx(mode.damping_ratio, rel=DAMPING)
