"""A strut with a high-pass, analysed once for the reports that are made of it."""

import pytest

from accept.gap import analyse_unit
from checks.gap.decision.result import Result
from tests.checks.gap.gap_units import HIGHPASS, make_strut


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory) -> Result:
    unit = make_strut(tmp_path_factory.mktemp("units") / "X-1", "X-1", HIGHPASS)
    return analyse_unit.analyse(unit, "strut").result
