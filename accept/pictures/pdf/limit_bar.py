"""Position of a value inside its limits, drawn to scale beside its numbers."""

import math
from collections.abc import Mapping
from typing import Any

from reportlab.graphics.shapes import Circle, Drawing, Line, Polygon, Rect
from reportlab.lib.colors import HexColor

from accept.pictures.pdf.page_style import FINDING_SIGNS, INK_COLOUR, PALE_COLOUR, ZEBRA

ZONE = HexColor("#cfe3ee")  # inside the limits, and of a guarded limit what U leaves of it


def limit_bar(finding: Mapping[str, Any], width: float, height: float) -> Drawing:
    """Return the drawing of the zone between the limits, its part inside the guard band, and the value with ±U."""
    drawing = Drawing(width, height)
    value, U = finding["value"], finding["U"] or 0.0
    low, high = _view(finding["lower"], finding["upper"], value, U)

    def at(x: float) -> float:
        return min(max((x - low) / (high - low), 0.0), 1.0) * width

    middle = height / 2
    drawing.add(Rect(0, middle - 3, width, 6, fillColor=ZEBRA, strokeColor=None))
    _zone(drawing, finding, U, at, middle)
    if value is not None:
        _value(drawing, value, U, (low, high), at, middle, FINDING_SIGNS[finding["verdict"]].fill)
    return drawing


def _view(lower: float | None, upper: float | None, value: float | None, U: float) -> tuple[float, float]:
    """Return the axis's ends: both limits and half a zone outside, or enough around one limit for the value."""
    if lower is not None and upper is not None:
        half = (upper - lower) / 2
        return lower - half, upper + half
    limit = upper if upper is not None else lower
    limit = 0.0 if limit is None else limit
    distance = 0.0 if value is None else abs(value - limit)
    span = max(1.25 * (distance + U), 0.05 * abs(limit), 1e-12)
    return limit - span, limit + span


def _zone(drawing: Drawing, finding: Mapping[str, Any], U: float, at: Any, middle: float) -> None:
    """Draw the limits and the zone between them; with the guarded rule, the zone is narrower by U at each limit."""
    lower, upper = finding["lower"], finding["upper"]
    left = at(-math.inf if lower is None else lower)
    right = at(math.inf if upper is None else upper)
    guarded = finding["rule"] == "guarded" and U > 0
    drawing.add(Rect(left, middle - 3, right - left, 6, fillColor=PALE_COLOUR if guarded else ZONE, strokeColor=None))
    if guarded:
        inner = (
            left if lower is None else at(lower + U),
            right if upper is None else at(upper - U),
        )
        if inner[0] < inner[1]:
            drawing.add(Rect(inner[0], middle - 3, inner[1] - inner[0], 6, fillColor=ZONE, strokeColor=None))
    for limit in (lower, upper):
        if limit is not None:
            drawing.add(Line(at(limit), middle - 5, at(limit), middle + 5, strokeColor=INK_COLOUR, strokeWidth=0.8))


def _value(
    drawing: Drawing, value: float, U: float, view: tuple[float, float], at: Any, middle: float, fill: Any
) -> None:
    if not view[0] <= value <= view[1]:
        _arrow(drawing, value > view[1], at(value), middle, fill)
        return
    left, right = at(value - U), at(value + U)
    drawing.add(Line(left, middle, right, middle, strokeColor=INK_COLOUR, strokeWidth=0.9))
    for end in (left, right):
        drawing.add(Line(end, middle - 1.8, end, middle + 1.8, strokeColor=INK_COLOUR, strokeWidth=0.7))
    drawing.add(Circle(at(value), middle, 2.1, fillColor=fill, strokeColor=INK_COLOUR, strokeWidth=0.5))


def _arrow(drawing: Drawing, above: bool, tip: float, middle: float, fill: Any) -> None:
    back = tip - 6 if above else tip + 6
    points = [tip, middle, back, middle + 3.2, back, middle - 3.2]
    drawing.add(Polygon(points, fillColor=fill, strokeColor=INK_COLOUR, strokeWidth=0.5))
