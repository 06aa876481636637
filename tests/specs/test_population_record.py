"""The section [population] of a model file is read strictly."""

import pytest
from pydantic import ValidationError

from specs.model_sections import PopulationRecord

POPULATION = {
    "names": ["a", "b"],
    "mean": [1.0, 2.0],
    "scatter": [0.1, 0.2],
    "mean_sd": [0.05, 0.1],
    "covariance": [[0.02], [0.01, 0.05]],
    "units": ["S-1", "S-2", "S-3"],
    "model": "m",
    "model_sha256": "0",
}


def test_a_batch_states_its_covariance_by_its_lower_half() -> None:
    assert PopulationRecord.model_validate(POPULATION).full == [[0.02, 0.01], [0.01, 0.05]]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"names": ["a", "a"]}, "'a' occurs twice"),
        ({"mean": [1.0]}, "mean: has 1 entries"),
        ({"covariance": [[0.02], [0.01]]}, "row 2 has 1 numbers"),
        ({"covariance": [[0.02], [0.01, -0.05]]}, "expected above 0"),
        ({"scatter": [0.1, 0.0]}, "greater than 0"),
        ({"mean": [1.0, float("inf")]}, "finite"),
        ({"sd": [1.0]}, "Extra inputs"),
    ],
)
def test_a_batch_that_does_not_add_up_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        PopulationRecord.model_validate(POPULATION | changes)
