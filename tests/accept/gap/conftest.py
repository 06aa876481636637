"""A strut with a high-pass, analysed once for the reports that are made of it."""

import pytest

from checks.gap.decision.result import Result
from tests.checks.gap.shared.gap_units import highpass_answer


@pytest.fixture(scope="session")
def result() -> Result:
    return highpass_answer()
