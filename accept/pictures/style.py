"""The house look: all settings of matplotlib."""

from typing import Any

import matplotlib as mpl

from accept.pictures.colours import GREY, GRID, INK

MAP = "cividis"  # monotone in lightness ([NUNEZ18])

_TICKS: dict[str, Any] = {  # of both axes
    "labelsize": 6.0,
    "color": GREY,
    "labelcolor": INK,
    "major.size": 2.0,
    "major.width": 0.5,
    "minor.size": 0.0,
    "major.pad": 2.0,
}
_OURS: dict[str, Any] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 6.5,
    "axes.titlesize": 7.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 5.0,
    "axes.titley": 1.0,  # fixed: looking for a free place above the ticks takes a quarter of the drawing time
    "axes.labelsize": 6.5,
    "axes.labelpad": 2.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    **{f"{axis}tick.{part}": value for axis in "xy" for part, value in _TICKS.items()},
    "lines.linewidth": 0.9,
    "lines.markersize": 2.5,
    "legend.fontsize": 5.8,
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "legend.borderpad": 0.25,
    "legend.labelspacing": 0.25,
    "legend.handlelength": 1.6,
    "legend.borderaxespad": 0.3,
    "pdf.fonttype": 3,
    "pdf.compression": 6,
    "svg.hashsalt": "accept",  # without it the ids in an SVG are random
    "svg.fonttype": "path",
    "path.simplify": True,
}


def settings() -> Any:
    """Return every matplotlib setting, so that a user's matplotlibrc changes no picture."""
    default = {key: value for key, value in mpl.rcParamsDefault.items() if not key.startswith("backend")}
    return default | _OURS
