"""The answer to a strut with bellows at its payload, searched for once a run."""

import pytest

from checks.gap.decision.result import Result
from tests.checks.gap.search.test_elements import BELLOWS, found
from tests.shared.once import once


@pytest.fixture(scope="session")
def of_bellows(tmp_path_factory: pytest.TempPathFactory) -> Result:
    return once(tmp_path_factory, "bellows", lambda _: found(BELLOWS))
