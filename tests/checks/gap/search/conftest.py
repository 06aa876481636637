"""The answer to a strut with bellows at its payload, searched for once in a process of tests."""

import pytest

from checks.gap.decision.result import Result
from tests.checks.gap.search.test_elements import BELLOWS, found


@pytest.fixture(scope="session")
def of_bellows() -> Result:
    return found(BELLOWS)
