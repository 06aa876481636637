"""Ticks of logarithmic axes: plain numbers where they are short, few enough to read and quick to draw."""

import math

from matplotlib.axis import Axis
from matplotlib.ticker import AutoLocator, FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullLocator

from accept.pictures.words import number


def set_log_ticks(axis: Axis) -> None:
    """Set ticks for the limits that the axis has now.

    matplotlib's own labels are set as formulas, and its minor ticks are made though they are not shown: half of the
    time of a drawing."""
    low, high = sorted(axis.get_view_interval())
    decades = math.log10(high / low)
    if decades < 0.9:
        axis.set_major_locator(MaxNLocator(5))
    else:
        axis.set_major_locator(LogLocator(subs=(1.0,) if decades > 2.2 else (1.0, 2.0, 5.0), numticks=8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))
    axis.set_minor_locator(NullLocator())


def set_degree_ticks(axis: Axis) -> None:
    """Set ticks at quarters of a turn if the axis spans half a turn or more: a phase is read against -180, -90, 0."""
    low, high = sorted(axis.get_view_interval())
    axis.set_major_locator(MultipleLocator(90.0) if high - low >= 180.0 else AutoLocator())
