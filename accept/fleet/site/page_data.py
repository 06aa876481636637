"""What the page shows, as one JSON document: judgements, their findings, trends and gap answers."""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from accept.fleet.measurements import bench_of
from accept.pictures.labels import label_of
from accept.pictures.words import pretty
from accept.store import Event
from accept.store.payloads import UnitJudged
from checks.picture import Line, Panel

FINDING = ("check", "quantity", "value", "U", "lower", "upper", "verdict", "reason")
SHOWN_POINTS = 400  # of a curve: a page holds those of many units


def document(events: Iterable[Event], curves: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, Any]:
    """Return judgements: a row per judgement in the order of the store, its findings as lists in the order of
    `FINDING`; quantities: name -> unit as people write it; labels: name -> words; curves: title -> [{serial, x, y}]
    with the axes' labels."""
    judgements: list[dict[str, Any]] = []
    attempts: dict[str, int] = {}
    units: dict[str, str] = {}
    for event in events:
        result = UnitJudged.of(event).result
        attempts[event.subject] = attempts.get(event.subject, 0) + 1
        units |= {f.quantity: "" if f.unit == "1" else pretty(f.unit) for f in result.findings}
        judgements.append(
            {
                "serial": event.subject,
                "time": event.time[:19],
                "operator": event.who,
                "bench": bench_of(result),
                "kind": result.kind,
                "attempt": attempts[event.subject],
                "verdict": str(result.verdict),
                "spec": event.spec.split("@")[0],
                "findings": [[_shown(name, getattr(finding, name)) for name in FINDING] for finding in result.findings],
                "notes": result.notes,
                "gap": _gap(result.gap),
            }
        )
    labels = {name: label_of(name) for name in units}
    return {
        "finding": FINDING,
        "quantities": units,
        "labels": labels,
        "judgements": judgements,
        "curves": dict(curves),
    }


def _shown(name: str, value: Any) -> Any:
    return pretty(value) if name == "reason" and isinstance(value, str) else value


def _gap(answer: Mapping[str, Any] | None) -> dict[str, Any] | None:
    if answer is None:
        return None
    named = [str(n["effect"]) for n in answer.get("named") or ()]
    return {"verdict": answer.get("verdict"), "named": named}


def curves(panels: Mapping[str, Mapping[str, Panel]]) -> dict[str, list[dict[str, Any]]]:
    """Return measured curves by the title of their picture. panels: serial -> name -> picture."""
    found: dict[str, list[dict[str, Any]]] = {}
    for serial, pictures in panels.items():
        for panel in pictures.values():
            lines = [item for item in panel.items if isinstance(item, Line) and item.role in ("data", "auto")]
            if lines:
                found.setdefault(panel.title, []).append(_curve(serial, panel, lines[0]))
    return {title: rows for title, rows in found.items() if len(rows) > 1}


def _curve(serial: str, panel: Panel, line: Line) -> dict[str, Any]:
    step = max(1, line.x.size // SHOWN_POINTS)
    x, y = np.asarray(line.x)[::step], np.asarray(line.y)[::step]
    good = np.isfinite(x) & np.isfinite(y)
    return {
        "serial": serial,
        "x": [float(f"{v:.6g}") for v in x[good]],
        "y": [float(f"{v:.6g}") for v in y[good]],
        "x_label": pretty(panel.x_label),
        "y_label": pretty(panel.y_label),
        "x_log": panel.x_log,
        "y_log": panel.y_log,
    }


def script(content: Mapping[str, Any]) -> str:
    """Return the document as a script that only assigns it: no text of a unit can end the script or begin another."""
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return "window.FLEET=" + text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026") + ";\n"
