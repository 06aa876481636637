"""The answer that reports are made of."""

import pytest

from checks.gap import Result
from tests.shared.gap_run import GapRun


@pytest.fixture(scope="session")
def result(gap_run: GapRun) -> Result:
    return gap_run.done.result
