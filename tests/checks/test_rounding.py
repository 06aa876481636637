"""Numbers as they are shown."""

import pytest

from checks.rounding import with_U


@pytest.mark.parametrize(
    ("value", "U", "words"),
    [
        (93.91813, 0.0188, "93.918 ± 0.019"),
        (0.2956875, 1.0e-6, "0.2957 ± less than 0.0001"),  # a damping that nobody knows to seven digits
        (-4.8e6, 2.9e5, "-4800000 ± 290000"),
        (1234.567, 0.001, "1235 ± less than 1"),
        (0.0, 0.01, "0.000 ± 0.010"),
    ],
)
def test_no_more_digits_than_anybody_believes(value: float, U: float, words: str) -> None:
    assert with_U(value, U) == words
