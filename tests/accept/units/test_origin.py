"""Where a unit comes from, and what the air was like: read from its folder, listed with its result."""

import pytest

from accept.judging import judge_unit
from accept.units.unit_folder import UnitError, read
from specs.spec import load

UNIT = """serial = "A-1"
kind = "apa"
[origin]
lot = "2026-W40"
supplier = "maker"
[environment]
temperature_C = { value = 21.5, U = 0.5 }
humidity_percent = 45
[measured]
capacitance = 2026-10-13
[capacitance]
sensor_uF = 4.99
actuator_uF = 9.85
"""


def test_a_result_lists_origin_environment_and_days(tmp_path):
    (tmp_path / "unit.toml").write_text(UNIT)
    entry = judge_unit(read(tmp_path), load("apa-basic")).to_json()
    assert entry["origin"] == {"lot": "2026-W40", "supplier": "maker"}
    assert entry["environment"]["temperature_C"] == {"value": 21.5, "U": 0.5}
    assert entry["environment"]["humidity_percent"] == {"value": 45.0, "U": None}
    assert entry["measured"] == {"capacitance": "2026-10-13"}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("[origin]\nbatch = 'x'", "[origin] batch: unknown key (known: manufacturer"),
        ("[environment]\ntemperature_C = 294.5", "[environment] temperature_C = 294.5: expected -20 to 60"),
        ("[environment]\nhumidity_percent = true", "humidity_percent = True: expected 0 to 100"),
        ("[environment]\ntemperature_C = { value = 21, U = 0 }", "expected -20 to 60"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(tmp_path, line, words):
    (tmp_path / "unit.toml").write_text(f"serial = 'A-1'\nkind = 'apa'\n{line}\n")
    with pytest.raises(UnitError) as refused:
        read(tmp_path)
    assert words in str(refused.value)
