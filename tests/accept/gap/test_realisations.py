"""What is said of two realisations that differ: modes that moved are no gain, and a gain is no mode."""

import re

import pytest

from accept.gap.unit_responses import SEARCH_LO, Responses, realisations
from checks.fitting import Dataset
from checks.record import Record
from tests.shared.strut_records import strut_record

MERGE_HZ = 340.0


def measured(first: Record, second: Record) -> Responses:
    A, B = (Dataset.from_records(r, f_lo=SEARCH_LO, f_hi=MERGE_HZ) for r in (first, second))
    return Responses("R-1", "strut", A, B, MERGE_HZ, records={"low": first, "low_repeat": second})


def notes(faster: float = 1.0, gain: float = 1.0) -> str:
    *_, found = realisations(measured(strut_record(1), strut_record(2, faster, gain)), 0.0)
    return "; ".join(found)


@pytest.mark.parametrize("faster", [1.002, 0.998])
def test_modes_that_moved_are_called_so(faster: float) -> None:
    """Red before: a gain of Vs by +0.4 or -0.5 %."""
    said = notes(faster)
    assert "modes shifted between the records" in said
    assert said.count(f"{100 * (faster - 1):+.1f} %") == 3  # the axial mode and two of the strut's own
    assert "gain" not in said


def test_a_gain_is_called_a_gain() -> None:
    said = notes(gain=1.01)
    assert "shifted" not in said
    assert "gain of the second realisation over the first: Vs +1.0 %, de +1.0 %, da +1.0 %" in said


def test_both_are_said_where_both_are() -> None:
    said = notes(1.002, 1.02)
    assert "modes shifted" in said
    sizes = [float(x) for x in re.findall(r"(?:Vs|de|da) ([+-][\d.]+) %", said)]
    assert sizes == pytest.approx([2.0, 2.0, 2.0], abs=0.4)  # away from the modes a shift of 0.2 % is twice that


def test_nothing_is_said_of_two_alike() -> None:
    assert notes() == ""
