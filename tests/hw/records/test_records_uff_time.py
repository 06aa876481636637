"""Time records of universal files as pyuff writes them: units by label and data set 164, abscissa, starts, filled
lines."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import accept
from accept.cli.main import app
from checks.declare import Series
from checks.errors import RecordError
from hw.records import read
from tests.hw.records.test_responses_universal import units, write

N, STEP = 4001, 2.5e-4
RNG = np.random.default_rng(2)
VA = RNG.standard_normal(N)
DE = 2e-6 * VA
SERIES = Series("record", "any", {"Va": "V", "de": "m"})
DIGITS = 1e-9  # of 12 written digits


def record(name: str, y: np.ndarray, start: float = 0.0, **more: object) -> dict:
    return {
        "type": 58, "func_type": 1, "rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0, "rsp_ent_name": name,
        "x": start + STEP * np.arange(y.size), "data": y, "abscissa_spacing": 1, "binary": 0, "ord_data_type": 4,
        "abscissa_spec_data_type": 17, "orddenom_spec_data_type": 0, "id1": name,
    } | more  # fmt: skip


DISPLACEMENT, VOLTAGE = {"ordinate_spec_data_type": 8}, {"ordinate_axis_lab": "Voltage"}
METRES = {"ordinate_axis_units_lab": "m"}
TAKEN = {
    "SI": ([record("Va", VA), record("de", DE)]),
    "labels": ([record("Va", VA, ordinate_axis_units_lab="V"), record("de", DE, ordinate_axis_units_lab="m")]),
    "a voltage of another type": [record("Va", VA, **DISPLACEMENT, ordinate_axis_units_lab="V"), record("de", DE)],
    "mm by 164": [units(5, 1e3, 1e3), record("Va", VA, **VOLTAGE), record("de", 1e3 * DE, **DISPLACEMENT)],
    "ms": (
        [record(n, y, x=1e3 * STEP * np.arange(N), abscissa_axis_units_lab="ms") for n, y in (("Va", VA), ("de", DE))]
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", TAKEN)
def test_units_of_time_records_are_used(case: str, tmp_path: Path) -> None:
    found = read(write(tmp_path / "a.uff", *TAKEN[case]), SERIES)
    np.testing.assert_allclose(found["de"], DE, rtol=DIGITS, atol=1e-18)
    np.testing.assert_allclose(found["Va"], VA, rtol=DIGITS)
    np.testing.assert_allclose(found.t, STEP * np.arange(N), rtol=1e-6)


REFUSED = {
    "acceleration": ([record("Va", VA), record("de", DE, ordinate_spec_data_type=12)], "m/s2 does not fit here; use m"),
    "contradiction": ([record("Va", VA), record("de", DE, ordinate_spec_data_type=12, **METRES)], "contradict"),
    "label against 164": ([units(5, 1e3, 1e3), record("Va", VA, **VOLTAGE), record("de", DE, **METRES)], "set 164 has"),
    "frequency": ([record("Va", VA, abscissa_spec_data_type=18), record("de", DE)], "expected a time"),
    "Hz": ([record("Va", VA, abscissa_axis_units_lab="Hz"), record("de", DE)], "expected s, ms or us"),
    "part of a sample": ([record("Va", VA), record("de", DE, 0.4 * STEP)], "no whole number"),
    "other step": ([record("Va", VA), record("de", DE, x=2 * STEP * np.arange(N))], "0.0005 s and of 0.00025 s"),
    "no time in common": ([record("Va", VA), record("de", DE, 10.0)], "no time in common"),
    "spectra": ([record("Va", VA, func_type=9, abscissa_spec_data_type=18)], r"spectral density \(type 9\) of Va"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_time_record_contradicts_is_refused(case: str, tmp_path: Path) -> None:
    sets, words = REFUSED[case]
    with pytest.raises(RecordError, match=words):
        read(write(tmp_path / "a.uff", *sets), SERIES)


@pytest.mark.parametrize("late", [3, -7])
def test_records_that_start_apart_are_aligned(late: int, tmp_path: Path) -> None:
    """The encoder's set starts some samples later: its first value belongs to a later one of the drive."""
    start = 1.0 + late * STEP
    shifted = np.roll(DE, -late)[:-10] if late > 0 else np.concatenate([np.zeros(-late), DE])
    path = write(tmp_path / "a.uff", record("Va", VA, 1.0), record("de", shifted, start))
    found = read(path, SERIES)
    np.testing.assert_allclose(found["de"], 2e-6 * found["Va"], rtol=1e-9)
    assert found.t[0] == pytest.approx(max(1.0, start), rel=1e-6)
    assert found.t.size == (N - 10 if late > 0 else N)


def test_a_last_line_filled_with_zeros_is_read(tmp_path: Path) -> None:
    path = write(tmp_path / "a.uff", record("Va", VA), record("de", DE))  # 4001 values: one in the last line
    lines = path.read_text().split("\n")
    closing = [i for i, line in enumerate(lines) if line.strip() == "-1"][1::2]
    for i in closing:
        lines[i - 1] += f"{0.0:20.11e}" * 3
    path.write_text("\n".join(lines))
    found = read(path, SERIES)
    np.testing.assert_allclose(found["de"], DE, rtol=DIGITS, atol=1e-18)
    lines[closing[0] - 1] = lines[closing[0] - 1].replace(f"{0.0:20.11e}", f"{0.5:20.11e}")
    path.write_text("\n".join(lines))
    with pytest.raises(RecordError, match="declares 4001 values"):
        read(path, SERIES)


@pytest.mark.needs_data
def test_a_padded_file_of_another_program(tmp_path: Path) -> None:
    place = Path(__file__).parents[3] / "../shared/field/15-uff-time/pad.uff"
    found = CliRunner().invoke(app, ["frf", str(place)], env={"COLUMNS": "200"})
    assert found.exit_code == 0, found.stderr
    resonance = accept.frequency_response(place).resonances["de"]
    assert resonance.f_Hz == pytest.approx(120.0, abs=0.05)  # the truth of its record
