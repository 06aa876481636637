"""Comparing units of a kind: every quantity that several of them have, and the curves behind it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from accept.base.documents.results import Information, UnitRecord
from accept.batch.outliers import MIN_UNITS, Scores, robust_scale, scores
from checks.arrays import Array
from checks.picture import Item, Line, Panel, PanelKind
from checks.quantity import COVERAGE_FACTOR
from checks.verdict import Finding
from specs.units import unit_of

OVERLAID = (PanelKind.RESPONSE, PanelKind.CURVE)
COMPARED_HZ = (10.0, 2000.0)  # the widest band in which a channel must be coherent ([STB] 3.2)
GRID = 400  # frequencies, equally spaced in their logarithm
CURVE_U = 0.1  # relative standard uncertainty of a distance: two realisations of one unit differ as much


@dataclass(frozen=True)
class Member:
    """One unit's part in a comparison. p: probability of such a distance by chance."""

    serial: str
    value: float
    U: float | None
    score: float
    p: float
    outlier: bool


@dataclass(frozen=True)
class Comparison:
    """One quantity or curve over the fleet. unit: "dB" for the distance of a curve from the fleet's median."""

    name: str
    unit: str
    median: float
    scale: float
    members: tuple[Member, ...]
    curve: bool = False


@dataclass(frozen=True)
class Fleet:
    """quantities and curves of a kind; too_few: what fewer than MIN_UNITS units have."""

    kind: str
    serials: tuple[str, ...]
    compared: tuple[Comparison, ...]
    too_few: tuple[str, ...]

    @property
    def outliers(self) -> dict[str, list[str]]:
        """Return serial -> names of the quantities and curves in which it is an outlier."""
        odd: dict[str, list[str]] = {}
        for c in self.compared:
            for m in c.members:
                if m.outlier:
                    odd.setdefault(m.serial, []).append(c.name)
        return odd


def compare(results: Sequence[UnitRecord]) -> Fleet:
    """Return the comparison of units of one kind."""
    values = _values(results)
    curves = _curves(results, (PanelKind.RESPONSE,))  # compared in dB over a logarithmic axis
    enough = {name: per for name, per in values.items() if len(per) >= MIN_UNITS}
    compared = [_quantity(name, per) for name, per in enough.items()]
    compared += [_curve(name, per) for name, per in curves.items() if len(per) >= MIN_UNITS]
    few = [name for group in (values, curves) for name, per in group.items() if 1 < len(per) < MIN_UNITS]
    return Fleet(results[0].kind, tuple(r.serial for r in results), tuple(compared), tuple(few))


def _values(results: Sequence[UnitRecord]) -> dict[str, dict[str, tuple[float, float | None]]]:
    """Return quantity -> serial -> (value, U), judged or not."""
    found: dict[str, dict[str, tuple[float, float | None]]] = {}
    for r in results:
        rows: list[Finding | Information] = [*r.findings, *r.information]
        for row in rows:
            if row.value is not None:
                found.setdefault(row.quantity, {})[r.serial] = row.value, row.U
    return found


def _quantity(name: str, per: dict[str, tuple[float, float | None]]) -> Comparison:
    x = np.array([value for value, _ in per.values()])
    u = np.array([(U or 0.0) / COVERAGE_FACTOR for _, U in per.values()])
    return _comparison(name, unit_of(name), list(per), x, [U for _, U in per.values()], scores(x, u))


def _comparison(
    name: str, unit: str, serials: list[str], x: Array, U: Sequence[float | None], s: Scores, curve: bool = False
) -> Comparison:
    rows = zip(serials, x, U, s.score, s.p, s.outlier, strict=True)
    members = tuple(Member(n, float(v), U_v, float(z), float(p), bool(o)) for n, v, U_v, z, p, o in rows)
    return Comparison(name, unit, s.median, s.scale, members, curve)


def _curves(results: Sequence[UnitRecord], kinds: tuple[PanelKind, ...]) -> dict[str, dict[str, Line]]:
    """Return panel of one of these kinds -> serial -> its measured curve."""
    found: dict[str, dict[str, Line]] = {}
    for r in results:
        for name, panel in r.panels.items():
            if panel.kind in kinds and (line := measured_line(panel)) is not None:
                found.setdefault(name, {})[r.serial] = line
    return found


def measured_line(panel: Panel) -> Line | None:
    """Return the measured curve: the one drawn as data, else the last of a series (the largest of the loops)."""
    lines = [i for i in panel.items if isinstance(i, Line) and i.style == "solid" and i.x.size > 1]
    data = [line for line in lines if line.role == "data"]
    return data[0] if data else lines[-1] if lines else None


def _curve(name: str, per: dict[str, Line]) -> Comparison:
    """Return the comparison of each curve's rms distance in dB from the fleet's median; only far ones are outliers."""
    distance = distances([(line.x, line.y) for line in per.values()])
    # A sum of squares to the power 1/3 is nearly normal [WH31], as the test asks.
    even = distance ** (2 / 3)
    s = scores(even, 2 / 3 * CURVE_U * even, only_high=True)
    in_dB = Scores(float(np.median(distance)), robust_scale(distance), s.score, s.p, s.outlier)
    return _comparison(name, "dB", list(per), distance, [None] * distance.size, in_dB, curve=True)


def distances(curves: Sequence[tuple[Array, Array]]) -> Array:
    """Return the rms difference (n,) [dB] of each curve's level from the median level, over log f in the part of
    `COMPARED_HZ` that all curves cover, at least 1e-6. curves: n pairs of f (F,) [Hz], rising, and |H| (F,)."""
    lo = max(COMPARED_HZ[0], *(float(x[0]) for x, _ in curves))
    hi = min(COMPARED_HZ[1], *(float(x[-1]) for x, _ in curves))
    f = np.geomspace(lo, hi, GRID)
    levels = np.array([np.interp(np.log(f), np.log(x), 20 * np.log10(np.maximum(y, 1e-300))) for x, y in curves])
    apart = np.sqrt(np.mean((levels - np.median(levels, axis=0)) ** 2, axis=1))
    return np.asarray(np.maximum(apart, 1e-6))


def pictures(results: Sequence[UnitRecord], fleet: Fleet) -> list[Panel]:
    """Return the quantities as scores, then overlays of the curves; units that stand out are drawn last, and named.

    Loops and steps are overlaid, not scored: their numbers are among the quantities.
    """
    panels = [score_panel(fleet)] if fleet.compared else []
    templates = {name: panel for r in results for name, panel in r.panels.items()}
    odd = {c.name: {m.serial for m in c.members if m.outlier} for c in fleet.compared}
    for name, per in _curves(results, OVERLAID).items():
        if len(per) > 1:
            panels.append(overlay(name, templates[name], per, odd.get(name, set())))
    return panels


def overlay(name: str, template: Panel, per: dict[str, Line], odd: set[str]) -> Panel:
    """Return the curves of all units in one panel."""
    items: list[Item] = []
    for serial, line in sorted(per.items(), key=lambda pair: pair[0] in odd):
        items.append(Line(line.x, line.y, serial, role="bad" if serial in odd else "auto"))
    title = name.replace("/", ": ").replace("_", " ")
    return Panel(title, template.x_label, template.y_label, tuple(items), template.x_log, template.y_log)


def score_panel(fleet: Fleet) -> Panel:
    """Return the score of every unit in every quantity and curve, by their number in the table."""
    items: list[Item] = []
    for outlier, role, label in ((False, "data", "within the fleet"), (True, "bad", "stands out")):
        points = [(n, m.score) for n, c in enumerate(fleet.compared, 1) for m in c.members if m.outlier is outlier]
        if points:
            x, y = np.array(points, dtype=float).T
            items.append(Line(x, np.sign(y) * np.log10(1 + np.abs(y)), label, "points", role))
    return Panel("scores", "quantity (number in the table)", "sign x log10(1 + |score|)", tuple(items))
