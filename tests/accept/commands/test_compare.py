"""Who stands out of a fleet: the stiffnesses of [STB] 3.2.1, simulated fleets, curves."""

from pathlib import Path

import numpy as np
import pytest

from accept.batch import fleet_comparison
from accept.batch.outliers import robust_scale, scores
from accept.judging import judge_unit, load_spec
from accept.units import unit_folder
from tests.accept.units.units import GOOD, make_unit

# Seed 3.2.1 (APA 8 among them), with the 2 % (k = 2) that the spec states for a typed stiffness.
APAS = {1: 1.68, 2: 1.69, 4: 1.70, 5: 1.70, 6: 1.70, 7: 1.93, 8: 1.73}
STIFFNESSES = np.array(list(APAS.values()))


@pytest.mark.parametrize("u", [None, 0.01 * STIFFNESSES])
def test_seed_singles_out_apa_7_and_nobody_else(u):
    found = scores(STIFFNESSES, u)
    assert [n for n, odd in zip(APAS, found.outlier, strict=True) if odd] == [7]
    assert found.median == 1.70


def test_whole_seed_through_unit_folders(tmp_path: Path):
    spec = load_spec("apa-basic")
    results = []
    for number, k in APAS.items():
        text = GOOD.replace("k_N_per_um = 1.70", f"k_N_per_um = {k}").replace("373.2", str(370.0 + number))
        results.append(judge_unit(unit_folder.read(make_unit(tmp_path / str(number), f"APA-{number:02d}", text)), spec))
    found = fleet_comparison.compare(results)
    assert found.outliers == {"APA-07": ["k_closed_N_per_um"]}
    assert found.serials[-1] == "APA-08"


def test_rounded_values_that_agree_flag_nobody():
    same = np.array([1.70] * 6 + [1.73])
    assert not scores(same).outlier.any()  # MAD 0: the grid of the values is the least scale
    assert not scores(same, np.full(7, 0.017)).outlier.any()
    assert not scores(np.full(7, 1.7)).outlier.any()


def test_two_bad_units_do_not_hide_each_other():
    x = np.array([1.70, 1.69, 1.71, 1.70, 1.68, 1.95, 1.96, 1.71])
    assert np.flatnonzero(scores(x).outlier).tolist() == [5, 6]


def test_order_scale_and_shift_do_not_matter():
    rng = np.random.default_rng(4)
    x = np.append(rng.standard_normal(9), 12.0)
    base, order = scores(x), rng.permutation(10)
    assert np.allclose(scores(x[order]).p, base.p[order])
    moved = scores(1e-6 * x + 3.0)
    assert np.allclose(moved.score, base.score, rtol=1e-6)


@pytest.mark.parametrize("n", [4, 7, 20])
@pytest.mark.parametrize("only_high", [False, True])
def test_false_alarms_are_as_rare_as_stated(n, only_high):
    """1 % of the fleets; 1000 of them: within 3.3 standard deviations, 1.04 %, above it."""
    rng = np.random.default_rng(n)
    alarms = sum(scores(rng.standard_normal(n), only_high=only_high).outlier.any() for _ in range(1000))
    assert alarms <= 1000 * (0.01 + 0.0104)


def test_robust_scale_is_right_on_average():
    rng = np.random.default_rng(0)
    for n in (5, 7, 30):
        scale = np.mean([robust_scale(rng.standard_normal(n)) for _ in range(2000)])
        assert scale == pytest.approx(1.0, abs=0.05)  # the printed factors have three digits; 2000 draws, 1.5 %


@pytest.mark.parametrize("x", [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0, np.nan], [1.0, 2.0, np.inf, 3.0]])
def test_what_cannot_be_scored_is_refused(x):
    with pytest.raises(ValueError, match=r"needed|finite"):
        scores(np.array(x))


def test_distance_of_curves_in_decibels():
    """A curve 1 dB above all others is 1 dB away, wherever the others were sampled."""
    curves = [(np.geomspace(1.0, 3000.0, 500 + 7 * k), np.full(500 + 7 * k, 2.0)) for k in range(5)]
    x, y = curves[3]
    curves[3] = x, y * 10 ** (1 / 20)
    found = fleet_comparison.distances(curves)
    assert found[3] == pytest.approx(1.0)
    assert max(found[[0, 1, 2, 4]]) < 1e-5
