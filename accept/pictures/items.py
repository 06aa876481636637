"""The house look of matplotlib, and one function for each kind of item in a panel."""

import math
from collections.abc import Callable
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.font_manager import FontProperties
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import AutoLocator, FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullLocator
from matplotlib.transforms import Bbox

from accept.pictures.colours import GREY, GRID, INK, tinted
from accept.pictures.words import number, pretty
from checks.picture import Band, Heights, Image, Line, Mark, Panel, PanelKind, Span, Text
from checks.rounding import decimals_of

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


def set_log_ticks(axis: Axis) -> None:
    """Set ticks for the limits that the axis has now.

    matplotlib's own labels are set as formulas, and hidden minor ticks take half of the time of a drawing."""
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


MAPS = (Heights, Image)  # items that need room for a colour bar
_BAR_WIDTH_MM = 2.0
_FEW_POINTS = 60  # above this they are a cloud and drawn small
LEGEND_GAP, LEGEND_MOST = 0.03, 0.45  # of the axes' height: below a legend; of a legend that room is made for
_EM_PER_LETTER = 0.66  # of the bold typeface, a little above its mean
_HALO = [withStroke(linewidth=1.5, foreground="white")]  # words can be read across a curve
_DASH = {"solid": "-", "dashed": (0, (4, 2)), "points": "none"}


def draw_panel(axes: Axes, panel: Panel) -> None:
    """Draw one panel: scales first, because they decide what is visible, then items and labels."""
    if panel.x_log:
        axes.set_xscale("log")
    if panel.y_log:
        axes.set_yscale("log")
    # Zones without an end and labels of marks go by the limits, so by everything else: they come last.
    for item, tint, again in tinted(panel.items):
        _DRAWERS[type(item)](axes, item, tint, again)
    _labels(axes, panel)
    if panel.y_range is not None:
        axes.set_ylim(*panel.y_range)
    if panel.x_range is not None:
        axes.set_xlim(*panel.x_range)
    if panel.kind is PanelKind.PHASE:
        set_degree_ticks(axes.yaxis)
    if panel.y_names:
        axes.set_yticks(range(len(panel.y_names)), panel.y_names)
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.12)
    for axis, logarithmic in ((axes.xaxis, panel.x_log), (axes.yaxis, panel.y_log)):
        if logarithmic:
            set_log_ticks(axis)
    legend = _legend(axes)
    if legend is not None and panel.y_range is None and panel.kind is not PanelKind.PHASE and not panel.equal:
        _make_room(axes, legend)


def _labels(axes: Axes, panel: Panel) -> None:
    """Write title and labels, smaller if they would leave the panel."""
    figure, box = axes.figure, axes.get_position()
    wide = 72.0 * figure.get_figwidth() * box.width  # type: ignore[union-attr]
    tall = 72.0 * figure.get_figheight() * box.height  # type: ignore[union-attr]
    # The title may reach over the margins of the axes by an em or two, a vertical label below the axes.
    for text, put, room in (
        (panel.title, axes.set_title, wide + 8.0),
        (panel.x_label, axes.set_xlabel, wide + 8.0),
        (panel.y_label, axes.set_ylabel, tall + 20.0),
    ):
        words = pretty(text)
        stated = mpl.rcParams["axes.titlesize" if put == axes.set_title else "axes.labelsize"]
        size = FontProperties(size=stated).get_size_in_points()  # of axes of one's own it may be "large"
        put(words, fontsize=min(size, room / (_EM_PER_LETTER * max(len(words), 1))))


def _line(axes: Axes, item: Line, tint: str, again: bool) -> None:
    dash = (0, (2, 1)) if again and item.style == "solid" else _DASH[item.style]
    axes.plot(
        item.x,
        item.y,
        color=tint,
        linestyle=dash,
        marker="o" if item.style == "points" else None,
        markeredgewidth=0.0,
        markersize=mpl.rcParams["lines.markersize"] if len(item.x) <= _FEW_POINTS else 1.2,
        label=pretty(item.label) or None,
        zorder=2 if item.role in ("quiet", "before") else 3,
    )


def _band(axes: Axes, item: Band, tint: str, again: bool) -> None:  # noqa: ARG001
    axes.fill_between(
        item.x, item.lo, item.hi, color=tint, alpha=0.35, linewidth=0, label=pretty(item.label) or None, zorder=1
    )


def _span(axes: Axes, item: Span, tint: str, again: bool) -> None:  # noqa: ARG001
    shade = axes.axvspan if item.axis == "x" else axes.axhspan
    edge = axes.get_xlim() if item.axis == "x" else axes.get_ylim()  # a one-sided zone ends where the drawing ends
    low = item.lo if np.isfinite(item.lo) else min(edge)
    high = item.hi if np.isfinite(item.hi) else max(edge)
    shade(low, high, color=tint, alpha=0.28, linewidth=0, label=pretty(item.label) or None, zorder=0.5)


def _mark(axes: Axes, item: Mark, tint: str, again: bool) -> None:  # noqa: ARG001
    across = item.axis == "y"
    rule = axes.axhline if across else axes.axvline
    rule(item.at, color=tint, linestyle=(0, (5, 2)), linewidth=0.8, zorder=2.5)
    if item.label:
        _mark_label(axes, item, across)


def _mark_label(axes: Axes, item: Mark, across: bool) -> None:
    transform = axes.get_yaxis_transform() if across else axes.get_xaxis_transform()
    scale = axes.yaxis.get_transform() if across else axes.xaxis.get_transform()
    low, high, at = scale.transform(np.array([*sorted(axes.get_ylim() if across else axes.get_xlim()), item.at]))
    crowded = (at - low) > 0.88 * (high - low) if across else (at - low) < 0.08 * (high - low)
    place: dict[str, Any] = (
        {"xy": (0.985, item.at), "xytext": (0, 0), "ha": "right", "va": "top" if crowded else "bottom"}
        if across
        else {"xy": (item.at, 0.97), "xytext": (1.5 if crowded else -1.5, 0), "ha": "left" if crowded else "right"}
        | {"va": "top", "rotation": 90}
    )
    style: dict[str, Any] = {"fontsize": 5.8, "color": INK, "zorder": 5, "clip_on": True, "path_effects": _HALO}
    axes.annotate(pretty(item.label), xycoords=transform, textcoords="offset points", **place, **style)


def _text(axes: Axes, item: Text, tint: str, again: bool) -> None:  # noqa: ARG001
    axes.annotate(
        pretty(item.words),
        (item.x, item.y),
        xytext=(2, 2),
        textcoords="offset points",
        fontsize=5.8,
        color=tint,
        path_effects=_HALO,
        zorder=5,
    )


def _heights(axes: Axes, item: Heights, tint: str, again: bool) -> None:  # noqa: ARG001
    """Draw numbered dots; the height is written outside, away from the other dots."""
    dots = axes.scatter(item.x, item.y, c=item.z, cmap=MAP, s=64, edgecolors=INK, linewidths=0.5, zorder=3)
    spread = float(np.ptp(item.z)) if len(item.z) else 0.0
    decimals = max(0, decimals_of(spread)) if np.isfinite(spread) and spread > 0 else 1
    for nth, (x, y, z) in enumerate(zip(item.x, item.y, item.z, strict=True), 1):
        side = 1 if y >= np.median(item.y) else -1
        pale = float(np.ravel(dots.norm(z))[0]) > 0.5
        axes.annotate(str(nth), (x, y), ha="center", va="center", fontsize=5, color=INK if pale else "white", zorder=4)
        place: dict[str, Any] = {"xytext": (0, 9 * side), "textcoords": "offset points", "ha": "center", "va": "center"}
        axes.annotate(f"{z:.{decimals}f}", (x, y), fontsize=5.8, color=INK, zorder=4, **place)
    _colour_bar(axes, dots, item.label)


def _image(axes: Axes, item: Image, tint: str, again: bool) -> None:  # noqa: ARG001
    mesh = axes.pcolormesh(item.x, item.y, item.z, cmap=MAP, shading="nearest", rasterized=True)
    axes.grid(False)
    _colour_bar(axes, mesh, item.label)


def _colour_bar(axes: Axes, mapped: ScalarMappable, label: str) -> None:
    figure = axes.figure
    box = axes.get_position()
    mm = 1.0 / (25.4 * figure.get_figwidth())  # type: ignore[union-attr]
    place = figure.add_axes((box.x1 + 1.5 * mm, box.y0, _BAR_WIDTH_MM * mm, box.height))
    bar = figure.colorbar(mapped, cax=place)
    bar.outline.set_visible(False)
    place.tick_params(labelsize=5.5, length=1.5, pad=1.5)
    place.grid(False)
    if label:
        bar.set_label(pretty(label), fontsize=5.8, labelpad=1.5)


def _legend(axes: Axes) -> Legend | None:
    handles, labels = axes.get_legend_handles_labels()
    if not labels:
        return None
    legend = axes.legend(handles, labels, loc="best")
    legend.set_zorder(6)
    legend.get_frame().set_facecolor("white")
    for line in legend.get_texts():
        line.set_color(INK)
    return legend


def _make_room(axes: Axes, legend: Legend) -> None:
    """Lengthen the axis upwards for the legend if even its best place covers a curve."""
    box = Bbox(legend.get_window_extent().get_points())
    low, high = axes.get_ylim()
    part = box.height / axes.get_window_extent().height + LEGEND_GAP
    if part > LEGEND_MOST or low > high or not any(_crosses(line, box) for line in axes.lines):
        return
    scale = axes.yaxis.get_transform()
    bottom, top = scale.transform(np.array([low, high]))
    axes.set_ylim(low, float(scale.inverted().transform(np.array([bottom + (top - bottom) / (1.0 - part)]))[0]))
    legend.set_loc("upper right")


def _crosses(line: Line2D, box: Bbox) -> bool:
    """Return whether a curve or a measured point lies under a box (pixels). Straight marks do not count."""
    path = line.get_transform().transform_path(line.get_path())
    points = np.asarray(path.vertices)
    if len(points) <= 2:
        return False
    if line.get_linestyle() == "None":
        return bool(box.count_contains(points))
    return path.intersects_bbox(box, filled=False)


_DRAWERS: dict[type, Callable[[Axes, Any, str, bool], None]] = {
    Line: _line,
    Band: _band,
    Span: _span,
    Mark: _mark,
    Text: _text,
    Heights: _heights,
    Image: _image,
}
