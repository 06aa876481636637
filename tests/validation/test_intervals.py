"""Stated intervals hold the truth: every quantity with a U, over units of a simulator of its own."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from checks.acceptance import CHECKS
from tests.soak import SOAK
from validation.intervals.coverage import BY_OTHER_PROOFS, SECTIONS, WITHOUT_U, Score, scores, table
from validation.intervals.parts import Plays, smallest_zone

REPEATS, LONG = (200, 200) if SOAK else (20, 6)  # LONG: of units that take some seconds
CHANCE = 1e-4  # of a sound interval to be called too short, for each of some sixty quantities


@pytest.mark.parametrize(
    "section",
    [pytest.param(name, marks=pytest.mark.takes_data) if name == "constants of a strut" else name for name in SECTIONS],
)
@pytest.mark.slow
def test_every_interval_holds_the_truth(section: str) -> None:
    """Red before: loop widths of the stroke held 45 of 100, the ratio of stiffnesses 74, harmonics of bending and the
    moved mass a third."""
    repeats = LONG if section.startswith(("frf", "spurious")) else REPEATS
    least = int(binom.ppf(CHANCE, repeats, 0.95))
    found = scores(section, repeats)
    assert {name: score.covered for name, score in found.items() if score.covered < least} == {}
    assert all(score.missing <= 0.05 * repeats for score in found.values())


def test_every_quantity_is_looked_at() -> None:
    """Here, or by the proof that is named; or it states no U."""
    seen = set(WITHOUT_U) | set(BY_OTHER_PROOFS)
    rng = np.random.default_rng(1)
    for section in SECTIONS.values():
        seen |= set(section.simulated(rng).truth)
    assert {q for check in CHECKS.values() for q in check.quantities} <= seen


def test_the_page_has_a_row_for_each() -> None:
    page = (Path(__file__).parents[2] / "docs" / "explanation" / "intervals.md").read_text()
    assert [q for check in CHECKS.values() for q in check.quantities if f"`{q}`" not in page] == []


def test_what_states_no_U_states_none() -> None:
    for section in ("hysteresis", "sensor_highpass"):
        found = SECTIONS[section].measure(SECTIONS[section].simulated(np.random.default_rng(2)).values)
        assert all(q.U is None for q in found if q.name in WITHOUT_U)


def test_the_smallest_zone_of_four_points_has_its_closed_form() -> None:
    """The corners of a square, one raised by 4: half of the zone is 1."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 4.0], [0.0, 1.0, 0.0]])
    assert smallest_zone(points) == pytest.approx(1.0)


def test_plays_have_the_loop_that_their_closed_form_says() -> None:
    plays, t = Plays(2.0, 0.3, 5.0), np.linspace(0.0, 1.0, 4001)
    y = plays.response(-4.0 * np.cos(2.0 * np.pi * t), plays.settled(-4.0, 4.0))
    assert np.ptp(y) == pytest.approx(plays.height(4.0), rel=1e-6)
    assert y[3000] - y[1000] == pytest.approx(plays.opening(4.0), rel=1e-3)


def test_an_interval_that_is_too_short_shows() -> None:
    assert Score([0.2, -1.4, 1.0], [0.1, 0.1, 0.1]).covered == 2
    (row,) = table("here", {"x_um": Score([0.5, -1.5], [0.1, 0.3], 1)})
    assert row == "| here | `x_um` | 1 of 2 | 20 % | -0.50 U | 1 without a value |"
