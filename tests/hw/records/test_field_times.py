"""Files that were built from public reports of wrong readings, with the right answer beside each."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import accept
from checks.errors import RecordError

FIELD = Path(__file__).parents[4] / "shared" / "field"
pytestmark = pytest.mark.needs_data
if not FIELD.is_dir():  # one skip, not one for each file
    pytest.skip("the files of other people (../shared/field) are not beside the repository", allow_module_level=True)


@pytest.mark.parametrize("name", ["10-tdms-start/shifted.tdms", "18-mat-records/tt_shift.mat"])
def test_channels_that_start_apart(name: str) -> None:
    """-0.6 degrees at 50 Hz by the closed form of the plant; a start that is ignored gives +89.6."""
    frf = accept.frequency_response(accept.read_record(FIELD / name)).frf
    H = frf.H[np.argmin(np.abs(frf.f - 50.0)), 0]
    assert np.degrees(np.angle(H)) == pytest.approx(-0.6, abs=0.15)  # half of the last digit, and the noise


def test_a_corner_from_a_file_whose_channels_start_apart(tmp_path: Path) -> None:
    unit = shutil.copytree(FIELD / "56-highpass-tdms-start" / "A-01", tmp_path / "A-01")
    found = {f.quantity: f for f in accept.judge(unit).findings}
    corner = found["sensor_highpass_Hz"]
    assert corner.value == pytest.approx(0.387, abs=0.0005)  # the last digit
    assert corner.verdict.value == "pass"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("05-time-ms/plain.csv", "is the time in ms"),
        ("06-epoch/epoch_ms.csv", "is the time in ms"),
        ("07-adc/only_va.csv", r"Va moves by 5.33e\+03; expected 0.001 to 10.5"),
        ("07-adc/counts.csv", "did you mean nm"),
        ("18-mat-records/dt.mat", "is the time in ms"),
    ],
)
def test_files_that_are_refused(name: str, words: str) -> None:
    with pytest.raises(RecordError, match=words):
        accept.frequency_response(FIELD / name)


@pytest.mark.parametrize("name", ["05-time-ms/labelled.csv", "05-time-ms/time_ms.csv", "05-time-ms/us.csv"])
def test_times_with_a_unit(name: str) -> None:
    mode = accept.frequency_response(FIELD / name).resonances["de"]
    assert mode.f_Hz == pytest.approx(120.0, abs=0.024)  # U of the estimate


def test_a_hit_that_a_genuine_analyser_stored() -> None:
    record = accept.read_record(FIELD / "60-dataphysics" / "hammer_point.mat", "X1")
    assert record.units == {"X1": "N", "X2": "g", "X3": "g", "X4": "g"}
    assert record.t[0] == -0.009765625
    with pytest.raises(RecordError, match="1 of 1 impacts good: two good hits are needed"):
        accept.hammer_response(record, input="X1")
