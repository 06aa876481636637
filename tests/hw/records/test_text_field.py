"""Text files of a field trial, with the right answer stated beside each: read, or refused with its own reason."""

from pathlib import Path

import numpy as np
import pytest

from accept.analysis.record_responses import EstimatorSettings, read_any, responses_of
from accept.fleet import gauge
from accept.fleet.errors import FleetError
from accept.units.loaded_unit import loaded
from checks.acceptance.hysteresis import CHECK as HYSTERESIS
from checks.errors import RecordError
from specs.spec import load

FIELD = Path(__file__).parents[3] / "../shared/field"
pytestmark = pytest.mark.needs_data
if not FIELD.is_dir():  # one skip, not one for each file
    pytest.skip("the files of other people (../shared/field) are not beside the repository", allow_module_level=True)


@pytest.mark.parametrize(
    "file",
    [
        "01-german-thousands/right.csv",
        "04-preamble/rec.csv",
        "04-preamble/sep.csv",
        "05-time-ms/labelled.csv",
        "05-time-ms/time_ms.csv",
        "05-time-ms/us.csv",
        "06-epoch/date.csv",
        "06-epoch/epoch.csv",
    ],
)
def test_the_resonance_of_the_record_is_found(file):
    """120.000 Hz and 0.994 % are stated; the estimate's own uncertainty is 0.024 Hz, of which 0.1 Hz is four."""
    (found,) = responses_of([read_any(FIELD / file, "Va", {}, None)], EstimatorSettings(input="Va"))
    (mode,) = found.resonances.values()
    assert mode.f_Hz == pytest.approx(120.0, abs=0.1)
    assert 100.0 * mode.damping_ratio == pytest.approx(0.994, abs=0.01)


@pytest.mark.parametrize("file", ["rec.csv", "rec.txt"])
def test_utf16_is_read(file):
    record = read_any(FIELD / "03-utf16" / file, "Va", {}, None)
    assert record.fs == pytest.approx(4000.0)
    assert np.ptp(record["de"]) < 1e-4


def test_thousands_points_beside_decimal_commas_are_refused():
    with pytest.raises(RecordError, match=r"'0,000000' in column .*'49.998' in column 'de .nm.'"):
        read_any(FIELD / "01-german-thousands/de.csv", "Va", {}, None)


@pytest.mark.parametrize(
    ("file", "columns", "words"),
    [
        ("33-rr-comma/rr.csv", gauge.COLUMNS, "row 1 has 4 fields, the header has 3"),
        ("33-rr-comma/rr_dupcol.csv", gauge.COLUMNS, "two columns have the name 'value'"),
        ("34-gauge-comma/bias.csv", ("value",), "row 1 has 3 fields, the header has 2"),
    ],
)
def test_gauge_tables_with_decimal_commas_are_refused(file, columns, words):
    with pytest.raises(FleetError, match=words):
        gauge.read_table(FIELD / file, columns)


@pytest.mark.parametrize("case", ["46-flatness-utf16", "47-flatness-trailing-commas"])
def test_heights_are_those_of_the_plain_file(case):
    heights = loaded(FIELD / case / "A-01").values("flatness")["points"]["z_um"]
    assert heights.tolist() == [0.0, -9.0, -15.5, -18.0, -4.5, 6.5, -2.5, -1.0]


def test_heights_with_two_units_are_refused():
    with pytest.raises(RecordError, match="states two units, nm and um"):
        loaded(FIELD / "41-flatness-unit-header/A-01").values("flatness")


@pytest.mark.parametrize("case", ["48-hysteresis-semicolon", "49-hysteresis-cp1252"])
def test_hysteresis_of_a_table_of_another_program(case):
    values = loaded(FIELD / case / "A-01").values("hysteresis")
    found = HYSTERESIS.measure(values, load("apa").checks["hysteresis"])
    (percent,) = (q.value for q in found.quantities if q.name == "hysteresis_percent")
    assert percent == pytest.approx(3.489, abs=5e-4)  # as stated, to its last digit


def test_the_example_of_the_docs_is_read_as_a_unit_folder():
    for name, record in loaded(FIELD / "52-docs-example/S-01").values("frf").items():
        if name in ("low", "high"):
            assert record.fs == pytest.approx(1e4)
            assert set(record.channels) == {"Va", "Vs", "de", "da"}
