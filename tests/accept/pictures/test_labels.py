"""Sentences as people read them: no code name of a record or of a quantity."""

import pytest

from accept.pictures.labels import RECORD_LABELS, with_labels
from checks.acceptance import CHECKS
from checks.cause import Cause, because
from checks.declare import CsvTable, Series


def test_every_record_with_a_code_name_has_words() -> None:
    inputs = [i for check in CHECKS.values() for form in check.forms for i in form.inputs]
    codes = {i.name for i in inputs if isinstance(i, Series | CsvTable) and "_" in i.name}
    assert {"closed_circuit", "torsion_left", "low_repeat"} <= codes <= RECORD_LABELS.keys()


STEPS = because(Cause.STEP_COUNT, record="closed_circuit", found=0, where="")
FILED = STEPS.within("", "closed_circuit.mat")
LIMIT = {"value": "0.9", "unit": "1", "side": "below the lower", "limit": 1.0}


@pytest.mark.parametrize(
    ("said", "read"),
    [
        (str(STEPS), "closed circuit: 0 mass steps found; expected two: mass added and removed"),
        (str(FILED), "closed circuit (closed_circuit.mat): 0 mass steps found; expected two: mass added and removed"),
        (str(because(Cause.OUTSIDE_LIMITS, **LIMIT)), "0.9 is below the lower limit 1"),
        ("units/open_circuit/a.mat: no such file", "units/open_circuit/a.mat: no such file"),
        ("k_ratio of 1 is expected", "Stiffness, open over closed of 1 is expected"),
    ],
)
def test_a_sentence_names_what_people_call_it(said: str, read: str) -> None:
    assert with_labels(said) == read
