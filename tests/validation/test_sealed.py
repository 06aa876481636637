"""Elements drawn anywhere on the independent generator, and how an answer is scored."""

from dataclasses import replace

import numpy as np
import pytest

from validation.bench import frf
from validation.studies.anywhere import DRAWN, SEEN, Truth, draw_anywhere
from validation.studies.sealed import interval, judged, table

HOLDER = Truth("spring", (("top interface", "ground"),), "z", {"k_N_per_um": 0.2, "m_kg": 0.03}, ("payload_mass",))
PLACE = {"part": "top interface", "against": "ground", "direction": "z", "point_mm": None}
FOUND = {
    "kind": "spring",
    "places": [PLACE, PLACE | {"part": "payload"}],
    "parameters": {"k_N_per_um": {"ci95": [0.19, 0.21]}, "m_kg": {"ci95": [0.04, 0.05]}},
    "sentence": "Something like a spring.",
}


def test_a_unit_is_the_same_however_many_are_drawn_and_is_seen_as_much_as_stated() -> None:
    units = list(draw_anywhere(3, 5, 0.0))
    (name, case, truth) = next(iter(draw_anywhere(1, 5, 0.0)))
    assert (name, truth) == (units[0][0], units[0][2])
    assert SEEN[0] <= truth.seen <= SEEN[1]
    f = np.geomspace(10.0, 700.0, 50)
    bare = frf(replace(case, hidden=None).world, f)
    changed = np.abs(frf(case.world, f) / bare - 1.0).max()
    assert 1e-4 < changed < 10.0
    silent = units[DRAWN.index(None)]
    assert silent[2].kind == "nothing"
    assert silent[1].hidden is None


def test_an_answer_is_scored_by_place_kind_class_and_values() -> None:
    row = judged(HOLDER, {"verdict": "explained", "elements": [FOUND], "named": [{"effect": "crosstalk"}]})
    assert (row["place"], row["kind"], row["class"], row["false"]) == (True, True, 2, ["crosstalk"])
    assert row["inside"] == [True, False]
    elsewhere = FOUND | {"places": [PLACE | {"part": "head"}], "kind": "mass"}
    row = judged(HOLDER, {"verdict": "explained", "elements": [elsewhere], "named": []})
    assert (row["said"], row["place"], row["kind"], row["inside"]) == (True, False, False, [])
    row = judged(HOLDER, {"verdict": "explained", "elements": [], "named": [{"effect": "payload_mass"}]})
    assert (row["place"], row["kind"], row["false"]) == (True, True, [])


@pytest.mark.parametrize(("hits", "n", "lo", "hi"), [(0, 20, 0.0, 0.168), (20, 20, 0.832, 1.0), (9, 10, 0.555, 0.997)])
def test_an_interval_is_that_of_clopper_and_pearson(hits: int, n: int, lo: float, hi: float) -> None:
    assert interval(hits, n) == pytest.approx((lo, hi), abs=1e-3)


def test_an_error_counts_and_scores_nothing() -> None:
    lines = table([{"hidden": "spring", "error": "LinAlgError: singular"}])
    assert lines[0].startswith("errors: 1 of 1")
    assert "place in the class, of what hides: none to count" in lines
