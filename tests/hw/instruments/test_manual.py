"""Typed readings: number, unit and plausibility."""

import pytest

from hw.errors import Garbled, Implausible, SettingsError
from hw.instruments.manual import Manual, ManualSettings


def manual(typed, measure="capacitance", unit="uF", ends=(0.1, 50.0)):
    return Manual("meter", ManualSettings(measure=measure, unit=unit, range=list(ends)), lambda words: typed, "M", "1")


@pytest.mark.parametrize(
    ("typed", "farads"),
    [
        ("4.99 uF", 4.99e-6),
        ("4990nF", 4.99e-6),
        (" 4.99 µF ", 4.99e-6),
        ("+5 μF", 5e-6),
        (".5uF", 5e-7),
        ("4.99e-6", None),
    ],
)
def test_capacitances(typed, farads):
    if farads is None:  # an exponent without a unit
        with pytest.raises(Garbled):
            manual(typed).read()
    else:
        reading = manual(typed).read()
        assert reading.value == pytest.approx(farads)
        assert (reading.unit, reading.raw) == ("F", (typed.encode(),))


@pytest.mark.parametrize(("typed", "metres"), [("365.5 um", 365.5e-6), ("-0.0035 mm", -3.5e-6), ("0.01 in", 254e-6)])
def test_displacements(typed, metres):
    assert manual(typed, "displacement", "mm", (-1.0, 1.0)).read().value == pytest.approx(metres)


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        ("4,99 uF", "comma"), ("4.99", "its unit"), ("uF", "its unit"), ("", "its unit"), ("4.99 mH", "unknown unit"),
        ("4.99 UF", "unknown unit"), ("4.9.9 uF", "its unit"), ("- 4.99 uF", "its unit"), ("nan uF", "its unit"),
        ("inf uF", "its unit"), ("٤.٩ uF", "its unit"), ("1 4.99 uF", "its unit"),
    ],
)  # fmt: skip
def test_what_is_no_number_with_a_unit(typed, words):
    with pytest.raises(Garbled, match=words):
        manual(typed).read()


@pytest.mark.parametrize("typed", ["4.99 F", "4.99 nF", "-4.99 uF", "0 uF"])
def test_what_is_not_plausible(typed):
    with pytest.raises(Implausible, match=r"outside 0\.1 to 50 uF"):
        manual(typed).read()


def test_a_unit_of_another_quantity_in_the_bench_file():
    with pytest.raises(SettingsError, match="expected one of"):
        manual("", unit="mm")
