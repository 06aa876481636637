"""One contract for every effect of the library, on units that share nothing with it: made by the blind generator with
the effect they are found by name, with its values; made without it they are not."""

import os
from pathlib import Path

import numpy as np
import pytest

from accept.gap.analyse_unit import run_gap
from checks.gap.effects import EFFECTS
from tests.checks.model.units_model import NOMINAL
from validation.bench import Setting
from validation.cases import Case
from validation.effects import LIBRARY
from validation.strut import nominal

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
SEED = 11  # of development
QUICK = ("creep", "crosstalk")  # one that slow records show, one that responses show
# Not in the blind mix: test_read_point.py makes the first by the same generator, test_gap.py the others by the model.
ELSEWHERE = (
    "encoder_read_point",
    *(f"channel_{what}_{channel}" for what in ("latency", "lowpass") for channel in ("Vs", "de", "da")),
    "amplifier_second_order",
    "charge_highpass",
    "sensor_pickup",
    "support_mode",
)

pytestmark = pytest.mark.takes_data


def unit(name: str | None) -> Case:
    rng = np.random.default_rng(SEED)
    effects = {name: LIBRARY[name].draw(rng)} if name else {}
    return Case(f"C-{name or 'none'}", "one" if name else "none", SEED, nominal(), Setting(), effects, {})


def test_the_generator_knows_every_effect() -> None:
    assert set(LIBRARY) | set(ELSEWHERE) == set(EFFECTS)


@pytest.mark.parametrize("name", sorted(LIBRARY) if SOAK else QUICK)
def test_found_by_name_with_its_values(name: str, tmp_path: Path) -> None:
    case = unit(name)
    found = run_gap(case.write(tmp_path), NOMINAL)
    assert [n["effect"] for n in found["named"]] == [name]
    assert found["verdict"] == "explained"
    for key, value in case.effects[name].items():
        p = found["named"][0]["parameters"][key]
        # Twice the half-width: 95 % intervals miss one in twenty by themselves, and here are up to twenty values.
        assert abs(p["value"] - value) <= p["ci95"][1] - p["ci95"][0], key


def test_not_named_where_it_is_not(tmp_path: Path) -> None:
    found = run_gap(unit(None).write(tmp_path), NOMINAL)
    assert found["verdict"] == "no_missing_effect"
    assert not found["named"]
