"""Panels as JSON and back: so they are attached to a certificate, and so it can be drawn again from its attachments."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from checks.picture import Band, Heights, Image, Item, Line, Mark, Panel, PanelKind, Span, Text

_ITEMS: dict[str, type[Item]] = {c.__name__: c for c in (Line, Band, Span, Mark, Text, Heights, Image)}


def panels_to_json(panels: Mapping[str, Panel]) -> list[dict[str, Any]]:
    """Return panels in their order, as plain data; numbers that JSON does not have are words ("nan", "inf")."""
    return [{"name": name} | _panel(panel) for name, panel in panels.items()]


def panels_from_json(data: Sequence[Mapping[str, Any]]) -> dict[str, Panel]:
    """Read the output of `panels_to_json`. Raises KeyError, TypeError or ValueError on other input."""
    return {panel["name"]: _read_panel(panel) for panel in data}


def _panel(panel: Panel) -> dict[str, Any]:
    plain = {f.name: _plain(getattr(panel, f.name)) for f in fields(panel) if f.name != "items"}
    items = (
        {"type": type(item).__name__} | {f.name: _plain(getattr(item, f.name)) for f in fields(item)}
        for item in panel.items
    )
    return plain | {"items": list(items)}


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        whole = value.dtype == float and bool(np.isfinite(value).all())
        return value.tolist() if whole else [_plain(v) for v in value.tolist()]
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return float(value) if math.isfinite(value) else str(float(value))


def _read_panel(data: Mapping[str, Any]) -> Panel:
    apart = ("name", "items", "y_range", "x_range", "y_names", "kind")
    rest = {key: value for key, value in data.items() if key not in apart}
    y_range = None if data["y_range"] is None else (float(data["y_range"][0]), float(data["y_range"][1]))
    names = tuple(str(name) for name in data.get("y_names", ()))
    kind = PanelKind(data.get("kind", ""))
    items = tuple(_read_item(item) for item in data["items"])
    ends = data.get("x_range")
    x_range = None if ends is None else (float(ends[0]), float(ends[1]))
    return Panel(items=items, y_range=y_range, x_range=x_range, y_names=names, kind=kind, **rest)


def _read_item(data: Mapping[str, Any]) -> Item:
    kind = _ITEMS[data["type"]]
    words = {"label", "style", "role", "axis", "words"}
    rest = {key: value for key, value in data.items() if key != "type"}
    numbers = {k: np.array(v, float) if isinstance(v, list) else float(v) for k, v in rest.items() if k not in words}
    return kind(**rest | numbers)
