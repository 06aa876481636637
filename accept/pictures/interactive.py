"""Panels as one HTML page to zoom in, drawn by plotly, which is written into the page: it opens without a network.

Magnitude, phase and residual of a channel share their frequency axis. The page's policy lets only its own two scripts
run, by their hashes, so no text of a unit can become a script."""

import base64
import hashlib
from collections.abc import Mapping, Sequence
from html import escape
from importlib.util import find_spec
from typing import Any

import numpy as np

from accept.pictures.blocks import Table
from accept.pictures.colours import MAP_STEPS, colour
from accept.pictures.formats import PictureError
from accept.pictures.scale import runs
from accept.pictures.words import pretty
from checks.arrays import Array
from checks.picture import Band, Heights, Image, Line, Mark, Panel, PanelKind, Span
from specs.distribution import install

MISSING = f"interactive plots need plotly: {install('site')}"
BELOW = (" phase", " deviation", " residual")  # of a channel, under ` magnitude`
_DASH = {"solid": "solid", "dashed": "dash", "points": "solid"}
_STYLE = (
    "body{font-family:system-ui,sans-serif;margin:1rem auto;max-width:76rem;padding:0 1rem;color:#222}"
    "h1{font-size:1.4rem}h2{font-size:1.05rem;margin:1.4rem 0 .3rem}p{margin:.3rem 0}"
    "table{border-collapse:collapse;font-size:.85rem}"
    "th{text-align:left;color:#666}td,th{padding:.15rem .9rem .15rem 0;border-bottom:1px solid #ddd;vertical-align:top}"
)
_DRAW = (  # without the button that uploads a chart
    "for(const[id,f]of Object.entries(FIGURES))Plotly.newPlot(id,f.data,f.layout,"
    '{responsive:true,displaylogo:false,showSendToCloud:false,plotlyServerURL:""})'
)


def page(panels: Mapping[str, Panel], title: str, words: Sequence[str] = (), tables: Sequence[Table] = ()) -> bytes:
    """Return one HTML page: paragraphs, all panels, tables. Raises PictureError without plotly or panels."""
    if find_spec("plotly") is None:
        raise PictureError(MISSING)
    if not panels:
        raise PictureError("there is nothing to draw: no panels")
    from plotly.offline import get_plotlyjs  # large: only when a page is wanted

    figures = [_figure(group) for group in group_panels(panels)]
    places = "".join(f'<div id="plot-{n}" class="plotly-graph-div"></div>' for n in range(len(figures)))
    content = ",".join(f'"plot-{n}":{_safe(figure.to_json())}' for n, figure in enumerate(figures))
    scripts = [get_plotlyjs(), f"const FIGURES={{{content}}};{_DRAW}"]
    hashes = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{each}'" for each in hashes)
    policy = f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:"
    body = f"<h1>{escape(title)}</h1>{''.join(f'<p>{escape(w)}</p>' for w in words)}{places}"
    body += "".join(map(_table_html, tables))
    head = (
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>"
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>"
    )
    run = "".join(f"<script>{s}</script>" for s in scripts)
    return f"{head}<body>{body}{run}</body></html>\n".encode()


def group_panels(panels: Mapping[str, Panel]) -> list[list[Panel]]:
    """Return groups of panels that share an axis: phase and residual of a channel below its magnitude, by their names
    `de magnitude`, `de phase`, `de deviation`."""
    below = {
        name: f"{name.removesuffix(end)} magnitude"
        for name in panels
        for end in BELOW
        if name.endswith(end) and f"{name.removesuffix(end)} magnitude" in panels
    }
    alone = [name for name in panels if name not in below]
    return [[panels[name], *(panels[b] for b, above in below.items() if above == name)] for name in alone]


def _safe(json: str) -> str:
    """Return JSON within a script: no text in it can end the script."""
    return json.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _table_html(table: Table) -> str:
    head = "".join(f"<th>{escape(pretty(h))}</th>" for h in table.head)
    rows = "".join(f"<tr>{''.join(f'<td>{escape(pretty(v))}</td>' for v in row)}</tr>" for row in table.rows)
    return (
        f"<h2>{escape(table.title)}</h2><p>{escape(table.note)}</p>"
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    )


def _figure(group: Sequence[Panel]) -> Any:
    from plotly.subplots import make_subplots

    heights = [2.0, 1.0, 1.0][: len(group)]
    figure = make_subplots(rows=len(group), cols=1, shared_xaxes=True, vertical_spacing=0.04, row_heights=heights)
    layout: dict[str, Any] = {"template": "plotly_white", "title": _plain(group[0].title)}
    for row, panel in enumerate(group, start=1):
        for nth, item in enumerate(panel.items):
            _draw(figure, item, nth, row)
        figure.update_yaxes(title=_plain(panel.y_label), type="log" if panel.y_log else "linear", row=row, col=1)
        figure.update_xaxes(type="log" if panel.x_log else "linear", row=row, col=1)
        if panel.y_range is not None:
            ends = _ends(panel.y_range, panel.y_log)
            decades = {"dtick": 1} if panel.y_log and abs(ends[1] - ends[0]) > 2.0 else {}
            figure.update_yaxes(range=ends, exponentformat="power", **decades, row=row, col=1)
        if panel.kind is PanelKind.PHASE:
            figure.update_yaxes(dtick=90, row=row, col=1)
        if panel.y_names:
            names = {"tickvals": list(range(len(panel.y_names))), "ticktext": [*map(_plain, panel.y_names)]}
            figure.update_yaxes(**names, row=row, col=1)
        at = next(figure.select_yaxes(row=row, col=1)).domain[1]
        layout[_legend(row)] = {"x": 1.01, "y": at, "yanchor": "top"}
    if group[0].x_range is not None:
        figure.update_xaxes(range=_ends(group[0].x_range, group[0].x_log))
    figure.update_xaxes(title=_plain(group[-1].x_label), row=len(group), col=1)
    figure.update_layout(**layout, height=360 + 180 * (len(group) - 1), margin={"t": 50, "r": 210}, hovermode="x")
    return figure


def _ends(ends: tuple[float, float], log: bool) -> list[float]:
    return [float(np.log10(v)) if log else float(v) for v in ends]


def _legend(row: int) -> str:
    return "legend" if row == 1 else f"legend{row}"


def _plain(words: str) -> str:
    """Escape a text, because plotly takes tags in it for formatting."""
    return escape(pretty(words), quote=False)


def _draw(figure: Any, item: object, nth: int, row: int) -> None:
    at: dict[str, Any] = {"row": row, "col": 1}
    named: dict[str, Any] = {}
    if label := getattr(item, "label", ""):
        named = {"name": _plain(label), "legend": _legend(row)}
    match item:
        case Line():
            points = item.style == "points"
            ink = None if points else {"color": colour(item.role, nth), "dash": _DASH[item.style], "width": 1.5}
            dots = {"color": colour(item.role, nth), "size": 3.5}
            look = {"mode": "markers" if points else "lines", "line": ink, "marker": dots}
            figure.add_scatter(x=_short(item.x), y=_short(item.y), showlegend=bool(named), **look, **named, **at)
        case Band():
            x, y = _outline(item)
            red, green, blue = (int(colour(item.role, nth)[k : k + 2], 16) for k in (1, 3, 5))
            look = {
                "mode": "none",
                "fill": "toself",
                "fillcolor": f"rgba({red},{green},{blue},0.25)",
                "hoverinfo": "skip",
            }
            figure.add_scatter(x=_short(x), y=_short(y), showlegend=bool(named), **look, **named, **at)
        case Mark():
            add = figure.add_vline if item.axis == "x" else figure.add_hline
            words = {"annotation_text": _plain(item.label)} if item.label else {}
            add(item.at, line={"color": colour(item.role, nth), "dash": "dot"}, **at, **words)
        case Span() if np.isfinite([item.lo, item.hi]).all():
            add = figure.add_vrect if item.axis == "x" else figure.add_hrect
            add(item.lo, item.hi, fillcolor="rgba(120,120,120,0.15)", line_width=0, **at)
        case Image():
            scale = [[i / (len(MAP_STEPS) - 1), step] for i, step in enumerate(MAP_STEPS)]
            bar = {"title": _plain(item.label)}
            figure.add_heatmap(x=item.x, y=item.y, z=item.z, colorscale=scale, colorbar=bar, **at)
        case Heights():
            dots = {"color": item.z, "colorscale": "Cividis", "size": 12, "showscale": True}
            figure.add_scatter(x=item.x, y=item.y, mode="markers", marker=dots, showlegend=False, **at)


def _short(values: Array) -> Array:
    """Return a number with seven digits: half the size of the page."""
    return np.asarray(values, np.float32)


def _outline(band: Band) -> tuple[Array, Array]:
    """Return the outline around every stretch without NaN, there and back."""
    x, y = [np.empty(0)], [np.empty(0)]
    for part in runs(band.x, band.lo, band.hi):
        x += [band.x[part], band.x[part][::-1], np.array([np.nan])]
        y += [band.hi[part], band.lo[part][::-1], np.array([np.nan])]
    return np.concatenate(x), np.concatenate(y)
