"""Ticks of logarithmic axes: round numbers within the limits, enough of them to read a value off."""

import hypothesis.strategies as st
import pytest
from hypothesis import given
from matplotlib.figure import Figure

from accept.pictures.items import set_log_ticks
from accept.pictures.words import number


@pytest.mark.parametrize(
    ("value", "shown"),
    [(1.0, "1"), (0.05, "0.05"), (20000.0, "20000"), (1e-6, "10⁻⁶"), (2e-7, "2·10⁻⁷"), (1e5, "10⁵"), (5e12, "5·10¹²")],
)
def test_a_number_is_short(value: float, shown: str) -> None:
    assert number(value) == shown


@given(low=st.floats(-12.0, 6.0), decades=st.floats(0.05, 12.0))
def test_every_axis_has_ticks_to_read_it_by(low: float, decades: float) -> None:
    """Two at the least, nine at the most, within the limits of any axis."""
    axes = Figure().add_axes((0.1, 0.1, 0.8, 0.8))
    axes.set_xscale("log")
    axes.set_xlim(10.0**low, 10.0 ** (low + decades))
    set_log_ticks(axes.xaxis)
    inside = [t for t in axes.get_xticks() if 10.0**low <= t <= 10.0 ** (low + decades)]
    assert 2 <= len(inside) <= 9
