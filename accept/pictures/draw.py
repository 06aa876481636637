"""Draws panels side by side with matplotlib. The same panels always give the same bytes."""

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from accept.pictures.formats import FORMATS, PictureError, format_of
from accept.pictures.items import MAPS, draw_panel, settings
from checks.picture import Panel

__all__ = ["FORMATS", "PictureError", "draw", "picture"]

_CANVAS = {"pdf": FigureCanvasPdf, "svg": FigureCanvasSVG, "png": FigureCanvasAgg}
# A date or a program's name in the file would make equal pictures differ.
_METADATA: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
    "svg": {"Date": None},
    "png": {"Software": None},
}
_INCH = 25.4  # mm
_PNG_DPI = 200
_MARGINS = {"left": 13.0, "right": 2.5, "bottom": 8.5, "top": 6.0}  # mm around each panel
_MAP_MARGIN = 13.0  # mm at the right of a panel with a colour bar
PANEL_SIZE = (90.0, 62.0)  # mm, of a panel in a file of its own


def draw(
    panels: Sequence[Panel],
    target: Path | BinaryIO,
    format: str | None = None,
    size_mm: tuple[float, float] | None = None,
    columns: int | None = None,
) -> None:
    """Draw panels into a file or an open binary stream.

    format: "pdf", "png" or "svg", by default the file's ending. size_mm: width, height of the whole picture.
    columns: panels side by side (default: up to 3 for wide pictures, all if fewer). Raises PictureError."""
    if isinstance(target, Path):
        content = picture(panels, format or format_of(target), size_mm, columns)
        target.write_bytes(content)
    else:
        target.write(picture(panels, format or "pdf", size_mm, columns))


def picture(
    panels: Sequence[Panel],
    format: str,
    size_mm: tuple[float, float] | None = None,
    columns: int | None = None,
    dots: float = _PNG_DPI,
) -> bytes:
    """Return the bytes that `draw` writes. dots: per inch, of a PNG."""
    if format not in _CANVAS:
        raise PictureError(f"pictures are written as {', '.join(FORMATS)}, not as '{format}'")
    buffer = io.BytesIO()
    with mpl.rc_context():
        mpl.rcParams.update(settings())
        figure = figure_of(panels, columns, size_mm)
        figure.set_dpi(dots)
        canvas: Any = _CANVAS[format](figure)
        getattr(canvas, f"print_{format}")(buffer, metadata=_METADATA[format])
    return buffer.getvalue()


def figure_of(
    panels: Sequence[Panel], columns: int | None = None, size_mm: tuple[float, float] | None = None
) -> Figure:
    """Return a matplotlib figure of panels, for a script to change. Raises PictureError without panels."""
    if not panels:
        raise PictureError("there is nothing to draw: no panels")
    columns = columns or min(len(panels), 3)
    rows = math.ceil(len(panels) / columns)
    width, height = size_mm or (PANEL_SIZE[0] * columns, PANEL_SIZE[1] * rows)
    figure = Figure(figsize=(width / _INCH, height / _INCH), dpi=_PNG_DPI)
    for place, panel in enumerate(panels):
        row, column = divmod(place, columns)
        axes = figure.add_axes(_rectangle(panel, row, column, rows, columns, width, height))
        draw_panel(axes, panel)
    return figure


def _rectangle(
    panel: Panel, row: int, column: int, rows: int, columns: int, width: float, height: float
) -> tuple[float, float, float, float]:
    """Return the place of one panel's axes in fractions of the figure. Fixed margins line up rows and columns."""
    cell_w, cell_h = width / columns, height / rows
    left = column * cell_w + _MARGINS["left"]
    bottom = (rows - 1 - row) * cell_h + _MARGINS["bottom"]
    right = _MAP_MARGIN if any(isinstance(item, MAPS) for item in panel.items) else _MARGINS["right"]
    inner_w = max(cell_w - _MARGINS["left"] - right, 1.0)
    inner_h = max(cell_h - _MARGINS["bottom"] - _MARGINS["top"], 1.0)
    return left / width, bottom / height, inner_w / width, inner_h / height
