"""Flatness against [STB] table 2.1 (both columns), closed forms and invariants."""

import numpy as np
import pytest
from scipy.optimize import minimize

from accept.simulate.published_units import SEED_APAS
from checks.acceptance.flatness import POSITIONS_MM, measure, minimum_zone
from checks.cause import Cause
from specs.spec import CheckSpec, StatedU
from tests.causes import no_result

POSITIONS = np.array(POSITIONS_MM) * 1e-3
SPEC = CheckSpec(required=False, uncertainty={"z_um": StatedU(U=0.5, source="probe")})
# Exact half-widths [um] of the published description, APA 1..6 and 7b.
EXACT = {1: 6.48, 2: 1.88, 3: 2.07, 4: 2.02, 5: 1.45, 6: 6.44, 7: 2.43}


def quantities(z_um: np.ndarray) -> dict:
    return {q.name: q for q in measure({"z_um": np.asarray(z_um, dtype=float)}, SPEC).quantities}


@pytest.mark.parametrize("apa", SEED_APAS, ids=lambda a: a.serial)
def test_exact_column(apa) -> None:
    found = quantities(apa.heights_um)
    assert found["flatness_um"].value == pytest.approx(EXACT[apa.number], abs=0.0051)  # printed with two decimals
    assert found["flatness_pv_um"].value == pytest.approx(2 * found["flatness_um"].value)


def test_first_measurement_of_apa_7() -> None:
    assert quantities([0, 19.5, -8, -29.5, 75, 97.5, 70, 48])["flatness_um"].value == pytest.approx(1.45, abs=0.0051)


@pytest.mark.parametrize("apa", SEED_APAS, ids=lambda a: a.serial)
def test_published_column_is_the_published_algorithm_stopped_early(apa) -> None:
    """Nelder-Mead on the objective of [STB] 2.1.2 in metres from zeros, first steps 0.00025 and both tolerances
    1e-4."""
    points = np.column_stack([POSITIONS, np.array(apa.heights_um) * 1e-6])

    def worst_distance(x: np.ndarray) -> float:
        normal = np.array([x[1], x[2], 1.0])
        return float(np.abs((points - [0, 0, x[0]]) @ (normal / np.linalg.norm(normal))).max())

    simplex = np.vstack([np.zeros(3), 0.00025 * np.eye(3)])
    options = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-4}
    found = minimize(worst_distance, np.zeros(3), method="Nelder-Mead", options=options)
    assert round(found.fun * 1e6, 1) == apa.published_flatness_um
    # and it is not converged: the exact zone is narrower
    assert minimum_zone(*points.T).half_width < found.fun


@pytest.mark.parametrize("apa", SEED_APAS, ids=lambda a: a.serial)
def test_no_plane_does_better(apa) -> None:
    """The linear programme against a general minimiser started from its answer and from random planes."""
    x, y = POSITIONS.T
    z = np.array(apa.heights_um) * 1e-6
    zone = minimum_zone(x, y, z)
    rng = np.random.default_rng(apa.number)
    best = min(np.ptp(z - a * x - b * y) / 2 for a, b in zone.slope + rng.normal(0, 2e-5, (2000, 2)))
    assert zone.half_width <= best * (1 + 1e-9)


def test_closed_form_zone() -> None:
    """A plane with four corners raised by +h and -h across its diagonals: half-width h, any tilt, to 1e-6."""
    x, y = POSITIONS.T
    h = 3e-6
    saddle = h * np.sign(x) * np.sign(y)
    zone = minimum_zone(x, y, 4e-5 + 1e-3 * x - 2e-3 * y + saddle)
    assert zone.half_width == pytest.approx(h / np.sqrt(1 + 5e-6), rel=1e-9)
    assert zone.slope == pytest.approx([1e-3, -2e-3], rel=1e-6)


def test_invariance_under_tilt_shift_and_turn() -> None:
    rng = np.random.default_rng(3)
    z = rng.normal(0, 5, 8)
    before = quantities(z)["flatness_um"].value
    plane = 17.0 + 300 * POSITIONS[:, 0] - 500 * POSITIONS[:, 1]  # um over m: 0.3 and 0.5 mrad
    assert quantities(z + plane)["flatness_um"].value == pytest.approx(before, rel=1e-6)  # cosine of the tilt
    assert quantities(-z)["flatness_um"].value == pytest.approx(before, rel=1e-9)


def test_weights_are_the_derivative_of_the_half_width() -> None:
    x, y = POSITIONS.T
    # no round numbers: with five points touching the zone the derivative would differ to either side
    z = np.random.default_rng(5).normal(0, 5e-6, 8)
    zone = minimum_zone(x, y, z)
    step = 1e-9
    slope = [(minimum_zone(x, y, z + step * e).half_width - zone.half_width) / step for e in np.eye(8)]
    assert zone.weights == pytest.approx(slope, abs=1e-4)  # the cosine of the tilt and the solver's 1e-9 stay below
    assert np.abs(zone.weights).sum() == pytest.approx(1.0, abs=1e-6)


def test_uncertainty_covers_the_scatter_of_repeated_probing() -> None:
    """Zone of a clearly unflat unit probed 400 times with 0.25 um noise: the stated u is the scatter's, within 15 %
    (standard error of a standard deviation of 400: 3.5 %; the rest for the zone's kinks)."""
    rng = np.random.default_rng(11)
    z = np.array(SEED_APAS[0].heights_um)
    repeats = [quantities(z + rng.normal(0, 0.25, 8))["flatness_um"] for _ in range(400)]
    stated = quantities(z)["flatness_um"].U / 2
    assert np.std([q.value for q in repeats]) == pytest.approx(stated, rel=0.15)


def test_interface_tilt() -> None:
    """The right interface turned by 0.4 mrad about y: the tilt is found, whatever the common plane."""
    x, y = POSITIONS.T
    z = 1e-3 * x + 2e-3 * y + np.where(x > 0, 0.4e-3 * x, 0.0)
    assert quantities(z * 1e6)["interface_tilt_urad"].value == pytest.approx(400, rel=1e-6)


@pytest.mark.parametrize("keep", [3, 4, 7])
def test_too_few_points_are_no_result(keep: int) -> None:
    table = {"x_mm": POSITIONS[:keep, 0] * 1e3, "y_mm": POSITIONS[:keep, 1] * 1e3, "z_um": np.zeros(keep)}
    with no_result(Cause.POINTS_MISSING):
        measure({"points": table}, SPEC)


def test_points_on_a_line_are_no_result() -> None:
    x = np.array([-30.0, -25, -20, -15, 15, 20, 25, 30])
    with no_result(Cause.POINTS_IN_LINE):
        measure({"points": {"x_mm": x, "y_mm": np.zeros(8), "z_um": x}}, SPEC)


def test_without_a_stated_accuracy_the_uncertainty_is_unknown() -> None:
    found = measure({"z_um": np.arange(8.0)}, CheckSpec(required=False)).quantities
    assert all(q.U is None for q in found)


@pytest.mark.parametrize("heights", [np.zeros(8), np.full(8, 12.5), np.array(SEED_APAS[0].heights_um) * 1e-3])
def test_heights_more_alike_than_the_probe_reads_are_no_result(heights: np.ndarray) -> None:
    """A probe that was never read, or heights in mm, would else be the flattest of parts."""
    with no_result(Cause.HEIGHTS_ALIKE):
        quantities(heights)


def test_heights_that_are_no_heights_show_no_flat_part() -> None:
    """A tilt so steep that its square overflows was taken for a part without thickness: the zone is no less wide."""
    x, y = np.array(POSITIONS_MM, float).T * 1e-3
    heights = np.array(SEED_APAS[0].heights_um) * 1e-6
    steep, absurd = (minimum_zone(x, y, scale * heights).half_width for scale in (1e6, 1e200))
    assert steep > 1e-3
    assert absurd == pytest.approx(steep, rel=0.01)


@pytest.mark.parametrize("scale", [1e3, 1e6])
def test_heights_in_nm_are_no_result_and_no_bent_part(scale: float) -> None:
    with no_result(Cause.HEIGHTS_APART):
        quantities(scale * np.array(SEED_APAS[0].heights_um))


def test_a_position_read_twice_is_no_result() -> None:
    x, y = np.array(POSITIONS_MM, dtype=float).T
    x[7], y[7] = x[6], y[6]
    table = {"x_mm": x, "y_mm": y, "z_um": np.array(SEED_APAS[0].heights_um, dtype=float)}
    with no_result(Cause.POINT_TWICE, first=7, second=8):
        measure({"points": table}, SPEC)
