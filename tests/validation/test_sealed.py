"""Elements drawn anywhere on the independent generator, and how an answer is scored."""

from dataclasses import replace

import numpy as np
import pytest

from validation.bench import World, frf
from validation.cases import draw_cases, least_misfit, whiteners
from validation.strut import Attached, priors
from validation.studies.anywhere import BAND_HZ, BINS, DRAWN, SEEN, Seen, Truth, Unit, draw_anywhere
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


@pytest.mark.parametrize(("place", "along", "kind", "most"), [("payload", 2, "m", 0.5), ("head", 1, "k", 30e6)])
def test_no_other_values_do_what_is_said_to_be_seen(place: str, along: int, kind: str, most: float) -> None:
    """A mass at the payload is what the payload's own kilograms are but for their prior. It was said to be seen by one
    standard deviation where other values of the strut left 0.04, and the spring where they left 0.2."""

    def attached(world: World, part: float) -> World:
        return replace(world, strut=replace(world.strut, attached=(Attached(place, along, **{kind: part}),)))

    case = draw_cases(1, 3, "S", {"none": 1.0})[0]
    unit = Unit("", attached, lambda _: HOLDER, most)
    one, f = 1.0 / Seen(case, 0.0).per_part(unit), np.geomspace(*BAND_HZ, BINS)
    whiten = whiteners(frf(case.world, f), case.setting, f)
    target = frf(unit.world(case.world, one), f)
    # by a fit of all values, with nothing of the element; a third for what bends in between
    assert least_misfit(target, case.strut, whiten, f, np.zeros(len(priors()))) == pytest.approx(1.0, rel=1 / 3)


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
