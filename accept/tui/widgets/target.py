"""The place of a strut's APA beside the axis of its joints, as a target: allowed box, what U spans, the way back."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from checks.picture import Line, Panel, Text
from checks.verdict import Finding, Verdict

DX, DY = "dx_um", "dy_um"
# Heads of the arrow back, by its axis and whether it leads towards smaller values.
_HEADS = {("x", True): "◀", ("x", False): "▶", ("y", True): "▼", ("y", False): "▲"}


def offset_panel(findings: Sequence[Finding], earlier: Sequence[Mapping[str, float]] = ()) -> Panel | None:
    """Return the offset at equal scales, None unless both components are known. earlier: of the units before."""
    found = {f.quantity: f for f in findings}
    if any(quantity not in found or found[quantity].value is None for quantity in (DX, DY)):
        return None
    dx, dy = found[DX], found[DY]
    x, y = (f.value or 0.0 for f in (dx, dy))
    good = all(f.verdict is Verdict.PASS for f in (dx, dy))
    role, turn = "good" if good else "bad", np.linspace(0.0, 2.0 * np.pi, 90)
    before = [(unit[DX], unit[DY]) for unit in earlier if DX in unit and DY in unit]
    items: list[Line | Text] = [*_allowed(dx, dy)]
    if before:
        label = f"{len(before)} unit{'s' if len(before) > 1 else ''} before"
        places = np.array(before, dtype=float)
        items.append(Line(places[:, 0], places[:, 1], label, "points", "before"))
    if dx.U and dy.U:
        items.append(Line(x + dx.U * np.cos(turn), y + dy.U * np.sin(turn), "± U", role=role))
    words = way_back(findings)
    if words:
        items += [*_arrow(dx, dy, role), Text(-math.inf, -math.inf if y > 0 else math.inf, words, role)]
    items.append(Text(x, y, "◆", role))
    return Panel("Offset of the APA, seen along the strut", "dx [um]", "dy [um]", tuple(items), equal=True)


def way_back(findings: Sequence[Finding]) -> str:
    """Return what the mechanic does, "" if nothing is known to be off: an offset within its U may be none."""
    moves = [
        f"{abs(f.value):.0f} µm towards {'-' if f.value > 0 else '+'}{f.quantity[1]}"
        for f in findings
        if f.quantity in (DX, DY) and f.value is not None and _is_off(f)
    ]
    outside = any(f.verdict is not Verdict.PASS for f in findings if f.quantity in (DX, DY))
    return f"Move the APA by {' and '.join(moves)}" if moves and outside else ""


def _is_off(f: Finding) -> bool:
    """Return whether a component differs from zero beyond its U; without U it is not known."""
    return f.value is not None and f.U is not None and abs(f.value) > f.U


def _allowed(dx: Finding, dy: Finding) -> list[Line]:
    """Return the box that the limits allow, as far as they do."""
    ends = [(f.lower, f.upper) for f in (dx, dy)]
    if any(limit is None for pair in ends for limit in pair):
        return []
    (left, right), (low, high) = ends
    return [Line(np.array([left, right, right, left, left], float), np.array([low, low, high, high, low], float),
                 "allowed", role="good")]  # fmt: skip


def _arrow(dx: Finding, dy: Finding, role: str) -> list[Line | Text]:
    """Return the way from where the APA is to where it belongs, with its head."""
    at = np.array([dx.value, dy.value], dtype=float)
    to = np.array([0.0 if _is_off(f) else v for f, v in zip((dx, dy), at, strict=True)])
    far = at - to
    axis = "x" if abs(far[0]) > abs(far[1]) else "y"
    head = _HEADS[axis, bool(far[0 if axis == "x" else 1] > 0)]
    return [
        Line(np.array([at[0], to[0]]), np.array([at[1], to[1]]), style="dashed", role=role),
        Text(float(to[0]), float(to[1]), head, role),
    ]
