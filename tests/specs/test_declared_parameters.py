"""The table of parameters holds every number of every built-in model, and refuses what no section has."""

import pytest

from accept.models.model_file import open_model
from checks.model.parameters import is_declared, rule
from specs.model import builtin_models
from specs.models.parameters import PARAMETERS


@pytest.mark.parametrize("name", builtin_models())
def test_every_value_of_a_model_is_declared(name: str) -> None:
    assert [n for n in open_model(name).values if not is_declared(n)] == []


@pytest.mark.parametrize(
    "name", ["THE.UNIT.IS_ACCEPTED", "sensor.tau_us", "apa.kz_N_per_um", "joint.dx_um", "kz_N_per_um"]
)
def test_what_no_section_has_is_not(name: str) -> None:
    assert not is_declared(name)


def test_a_default_lies_within_its_bounds_and_one_key_has_one_rule() -> None:
    for p in PARAMETERS:
        assert p.default is None or p.lo <= p.default <= p.hi, p
        assert all((rule(key).lo, rule(key).hi, rule(key).step) == (p.lo, p.hi, p.step) for key in p.keys), p
