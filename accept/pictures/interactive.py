"""Panels as one HTML page to zoom in, drawn by plotly, which is written into the page: it opens without a network.

Magnitude and phase of one channel share their frequency axis, the phase below; everything else stands alone.
"""

from collections.abc import Mapping, Sequence
from html import escape
from importlib.util import find_spec
from typing import Any

import numpy as np

from accept.pictures.colours import MAP_STEPS, colour
from accept.pictures.formats import PictureError
from accept.pictures.words import pretty
from checks.picture import Band, Heights, Image, Line, Mark, Panel, Span

MISSING = "interactive plots need plotly: pip install 'accept[site]'"
_DASH = {"solid": "solid", "dashed": "dash", "points": "solid"}


def page(panels: Mapping[str, Panel], title: str) -> bytes:
    """One HTML page of all panels. Raises PictureError where plotly is not installed or nothing is to be drawn."""
    if find_spec("plotly") is None:
        raise PictureError(MISSING)
    if not panels:
        raise PictureError("there is nothing to draw: no panels")
    from plotly.offline import get_plotlyjs  # large: only when a page is wanted

    parts = [_figure(group).to_html(full_html=False, include_plotlyjs=False) for group in grouped(panels)]
    style = "body{font-family:system-ui,sans-serif;margin:1rem auto;max-width:72rem;color:#222}h1{font-size:1.3rem}"
    head = f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{escape(title)}</title><style>{style}</style>"
    return f"{head}<script>{get_plotlyjs()}</script><h1>{escape(title)}</h1>{''.join(parts)}</html>".encode()


def grouped(panels: Mapping[str, Panel]) -> list[list[Panel]]:
    """Panels that share an axis: the phase of a channel below its magnitude, by their names `de magnitude`,
    `de phase`."""
    pairs = {f"{name.removesuffix(' phase')} magnitude": name for name in panels if name.endswith(" phase")}
    below = {above: name for above, name in pairs.items() if above in panels}
    alone = [name for name in panels if name not in below.values()]
    return [[panels[name], *([panels[below[name]]] if name in below else [])] for name in alone]


def _figure(group: Sequence[Panel]) -> Any:
    from plotly.subplots import make_subplots

    heights = [2.0, 1.0][: len(group)]
    figure = make_subplots(rows=len(group), cols=1, shared_xaxes=True, vertical_spacing=0.04, row_heights=heights)
    for row, panel in enumerate(group, start=1):
        for nth, item in enumerate(panel.items):
            _draw(figure, item, nth, row)
        figure.update_yaxes(title=pretty(panel.y_label), type="log" if panel.y_log else "linear", row=row, col=1)
        figure.update_xaxes(type="log" if panel.x_log else "linear", row=row, col=1)
        if panel.y_range is not None:
            lo, hi = (np.log10(v) if panel.y_log else v for v in panel.y_range)
            figure.update_yaxes(range=[lo, hi], row=row, col=1)
    if group[0].x_range is not None:
        lo, hi = (np.log10(v) if group[0].x_log else v for v in group[0].x_range)
        figure.update_xaxes(range=[lo, hi])
    figure.update_xaxes(title=pretty(group[-1].x_label), row=len(group), col=1)
    layout = {"template": "plotly_white", "title": pretty(group[0].title), "height": 360 + 180 * (len(group) - 1)}
    figure.update_layout(**layout, legend={"x": 1.01, "y": 1.0}, margin={"t": 50, "r": 170})
    return figure


def _draw(figure: Any, item: object, nth: int, row: int) -> None:
    match item:
        case Line():
            mode = "markers" if item.style == "points" else "lines"
            ink = {"color": colour(item.role, nth), "dash": _DASH[item.style]} if mode == "lines" else None
            dots = {"color": colour(item.role, nth), "size": 4}
            figure.add_scatter(x=item.x, y=item.y, mode=mode, line=ink, marker=dots, name=pretty(item.label),
                               showlegend=bool(item.label), row=row, col=1)  # fmt: skip
        case Band():
            x, y = np.concatenate([item.x, item.x[::-1]]), np.concatenate([item.hi, item.lo[::-1]])
            figure.add_scatter(x=x, y=y, fill="toself", mode="none", fillcolor="rgba(0,114,178,0.18)",
                               name=pretty(item.label), showlegend=bool(item.label), row=row, col=1)  # fmt: skip
        case Mark():
            add = figure.add_vline if item.axis == "x" else figure.add_hline
            words = {"annotation_text": pretty(item.label)} if item.label else {}
            add(item.at, line={"color": colour(item.role, nth), "dash": "dot"}, row=row, col=1, **words)
        case Span() if np.isfinite([item.lo, item.hi]).all():
            add = figure.add_vrect if item.axis == "x" else figure.add_hrect
            add(item.lo, item.hi, fillcolor="rgba(120,120,120,0.15)", line_width=0, row=row, col=1)
        case Image():
            scale = [[i / (len(MAP_STEPS) - 1), step] for i, step in enumerate(MAP_STEPS)]
            figure.add_heatmap(x=item.x, y=item.y, z=item.z, colorscale=scale, name=pretty(item.label), row=row, col=1)
        case Heights():
            dots = {"color": item.z, "colorscale": "Cividis", "size": 12, "showscale": True}
            figure.add_scatter(x=item.x, y=item.y, mode="markers", marker=dots, name=pretty(item.label), row=row, col=1)
        case _:
            return
