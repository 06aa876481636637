"""Units in the header of a column, as several countries write them."""

import pytest

from specs.units import parse_column


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [("de [nm]", "de", "nm"), ("de (nm)", "de", "nm"), ("de/nm", "de", "nm"), ("de / nm", "de", "nm"),
     ("de in nm", "de", "nm"), ("de, nm", "de", "nm"), ("Zeit in ms", "Zeit", "ms"), ("de/%", "de", "%")],
)  # fmt: skip
def test_a_unit_behind_a_name(header: str, name: str, unit: str) -> None:
    assert parse_column(header) == (name, unit)


@pytest.mark.parametrize("header", ["de", "m/s", "de/Va", "V/V", "rad/s", "signal in", "sensor in box", "Track, 1", ""])
def test_a_name_without_a_unit(header: str) -> None:
    assert parse_column(header) == (header, "")
