"""The comparison of intervals with and without a disagreement: what counts, and that the two ways differ."""

import numpy as np
import pytest

from checks.gap.decision import build_result
from validation.cases import Case
from validation.effects import LIBRARY
from validation.outsiders import OUTSIDERS
from validation.studies.coverage import BESIDE, EFFECTS, draw, intervals, noise_alone, report

pytestmark = pytest.mark.takes_data


def case_of(effect: str) -> Case:
    return next(c for c in draw(5, 24, benches=True) if effect in c.effects)


@pytest.mark.parametrize("benches", [False, True])
def test_every_unit_hides_one_effect_that_nothing_else_adds_to(benches: bool) -> None:
    cases = draw(5, 24, benches)
    assert len(cases) == 24
    assert all(len(c.effects) == 1 and set(c.effects) <= set(EFFECTS) & set(LIBRARY) for c in cases)
    assert not any(set(c.alike) & set(EFFECTS) - {"bench_mode"} for c in cases)


def test_without_benches_each_has_an_outsider_beside_and_all_kinds_take_turns() -> None:
    cases = draw(5, 24, benches=False)
    assert all(c.bench is None and len(c.outside) == 1 for c in cases)
    assert {kind for c in cases for kind in c.outside} == set(BESIDE) <= set(OUTSIDERS)
    assert not any(c.outside for c in draw(5, 24, benches=True))


def test_intervals_are_those_of_the_hidden_effect_with_its_truth() -> None:
    case = case_of("crosstalk")
    (true,) = case.effects["crosstalk"].values()

    class Fitted:
        def interval(self, name: str) -> tuple[float, float]:
            assert name == "crosstalk.V_per_V"
            return 0.1, 0.2

    assert intervals(Fitted(), case) == {"V_per_V": (0.1, 0.2, true)}  # type: ignore[arg-type]


def test_noise_alone_is_the_way_without_and_ends() -> None:
    usual, data, left = build_result.with_disagreement, object(), np.ones(3)
    with noise_alone():
        assert build_result.with_disagreement(data, left) is data  # type: ignore[arg-type, comparison-overlap]
    assert build_result.with_disagreement is usual


def test_only_units_named_beside_something_count() -> None:
    holds, misses = [0.0, 1.96, 0.0], [0.0, 1.96, 3.92]  # one and three standard deviations off
    answers = [
        {"with": {"a": holds, "b": holds}, "without": {"a": misses, "b": holds}},
        {},
    ]
    words = report(answers)
    assert "2 units, 1 named" in words
    assert "with disagreement: 1.000 of 2" in words
    assert "without disagreement: 0.500 of 2" in words
    assert "RMS error 1.96 sd" in words.splitlines()[1]
    assert "median 1.00" in words
