"""Sentences as people read them: no code name of a record or of a quantity."""

import pytest

from accept.pictures.labels import label_and_name, label_of
from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because, record_label
from checks.consistency import RELATIONS, check_consistency
from checks.declare import Check, Series, Vector
from checks.quantity import Quantity
from checks.verdict import judge
from specs.spec import Limit


def test_every_record_with_a_code_name_has_words() -> None:
    inputs = [i for check in CHECKS.values() for form in check.forms for i in form.inputs]
    codes = {i.name for i in inputs if isinstance(i, Series | Vector) and "_" in i.name}
    assert {"closed_circuit", "torsion_left", "low_repeat", "z_um"} <= codes
    assert not [name for name in codes if record_label(name) == name]


def test_every_quantity_is_declared_with_its_label() -> None:
    """And one name has one label, whichever check measures it."""
    labels: dict[str, set[str]] = {}
    for check in CHECKS.values():
        assert all(check.labels.values())
        for name, label in check.labels.items():
            labels.setdefault(name, set()).add(label)
    assert not [name for name, found in labels.items() if len(found) > 1]


def test_a_check_of_another_package_may_declare_names_alone() -> None:
    """Its quantities are called by their names."""
    check = Check("x", "x", ("apa",), (), ("insulation_ohm", "k_left_N_per_um"), lambda *_: None)
    assert check.labels == {"insulation_ohm": "Insulation", "k_left_N_per_um": "K left"}
    assert label_of("insulation_ohm") == "Insulation"
    assert label_and_name("dy_um") == "Misalignment dy (dy_um)"


STEPS = because(Cause.STEP_COUNT, record="closed_circuit", found=0, where="")
FILED = STEPS.within("", "closed_circuit.mat")
LIMIT = {"value": "0.9", "unit": "1", "side": "below the lower", "limit": 1.0}


@pytest.mark.parametrize(
    ("reason", "read"),
    [
        (STEPS, "closed circuit: 0 mass steps found; expected two: mass added and removed"),
        (FILED, "closed circuit (closed_circuit.mat): 0 mass steps found; expected two: mass added and removed"),
        (because(Cause.OUTSIDE_LIMITS, **LIMIT), "0.9 is below the lower limit 1"),
        (because(Cause.OUTSIDE_LIMITS, **(LIMIT | {"unit": "uF"})), "0.9 uF is below the lower limit 1 uF"),
    ],
)
def test_a_sentence_names_what_people_call_it(reason: Reason, read: str) -> None:
    CHECKS["stiffness"]  # declares its records
    assert str(reason) == read


def test_a_contradiction_names_both_quantities_by_their_labels_and_keeps_their_names_for_scripts() -> None:
    relation = next(r for r in RELATIONS if r.other == "sensor_uF")
    found = {
        "sensor_uF": Quantity("sensor_uF", 1.72, 0.01),
        "sensor_capacitance_implied_uF": Quantity("sensor_capacitance_implied_uF", 5.1, 0.02),
    }
    assert relation.is_contradicted(found)
    limit = Limit(lower=1.0, upper=5.5, unit="uF", rule="simple", source="test")
    (finding,) = check_consistency([judge("capacitance", found["sensor_uF"], limit)], found)
    assert finding.reason is not None
    assert "Sensor stack, from the corner = 5.1 uF and Sensor stack = 1.72 uF contradict" in finding.reason
    assert finding.cause is not None
    assert finding.cause.to_json()["other"] == "sensor_uF = 1.72 uF"
    stored = {k: v for k, v in finding.cause.to_json().items() if not k.endswith("_called")}  # as it was before
    assert "sensor_uF = 1.72 uF contradict" in str(Reason.from_json(stored))
