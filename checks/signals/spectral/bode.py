"""Bode plots as data: magnitude and phase with the region that holds the truth, and coherence."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.picture import Band, Item, Line, Mark, Panel, PanelKind
from checks.signals.spectral.frf import Frf

MAX_POINTS = 1500  # per line: more than a page or a screen resolves
P = 0.95  # that a band holds the true value
REGION = f"{100 * P:g} % region"


def bode(frf: Frf, units: Mapping[str, str] | None = None, *, merge_Hz: float | None = None) -> dict[str, Panel]:
    """Return the panels "<channel> magnitude" and "<channel> phase" of every channel, and "coherence" of all of them.

    units : unit of each channel (per unit of the input: "m/V"). merge_Hz is marked in every panel. The bands hold the
    true value with probability P each; a variance of NaN is not known and has no band. Bins of infinite variance are
    left out, and so is the phase if the region holds 0. Logarithmic frequency axis: 0 Hz is left out."""
    marks = () if merge_Hz is None else (Mark(merge_Hz, "x", f"merged at {merge_Hz:g} Hz", "quiet"),)
    panels: dict[str, Panel] = {}
    for c, name in enumerate(frf.channels):
        unit = (units or {}).get(name, "")
        title = f"{name} / {frf.input}"
        good = ~np.isinf(frf.var[:, c]) & (np.abs(frf.H[:, c]) > 0) & (frf.f > 0)
        at = thinned(frf.f, good)
        f, H, r = frf.f[at], frf.H[at, c], frf.radius(P)[at, c]
        panels[f"{name} magnitude"] = _magnitude(title, unit, f, H, r, marks)
        panels[f"{name} phase"] = _phase(title, f, H, r, marks)
    if np.isfinite(frf.coherence).any():
        panels["coherence"] = _coherence(frf, marks)
    above = frf.f[frf.f > 0]
    ends = (float(above[0]), float(above[-1])) if above.size > 1 else None
    return {name: replace(panel, x_range=ends) for name, panel in panels.items()}  # one axis for all of them


def _magnitude(title: str, unit: str, f: Array, H: Complex, r: Array, marks: tuple[Mark, ...]) -> Panel:
    size = np.abs(H)
    # A region that holds 0, or a bin of infinite variance, would stretch a logarithmic axis without end.
    lo, hi = np.maximum(size - r, 0.1 * size), np.minimum(size + r, 10.0 * size)
    items: list[Item] = [Line(f, size, "measured", role="data")]
    if np.isfinite(r).any():
        items.insert(0, Band(f, lo, hi, REGION))
    label = f"magnitude [{unit}]" if unit else "magnitude"
    return Panel(title, "frequency [Hz]", label, (*items, *marks), x_log=True, y_log=True, kind=PanelKind.RESPONSE)


def _phase(title: str, f: Array, H: Complex, r: Array, marks: tuple[Mark, ...]) -> Panel:
    has_phase = ~(r >= np.abs(H))
    x, angle = f[has_phase], np.degrees(np.angle(H[has_phase]))
    items: list[Item] = [Line(x, angle, "measured", "points", "data")]
    if np.isfinite(r).any():
        spread = np.degrees(np.arcsin(r[has_phase] / np.abs(H[has_phase])))
        items.append(Line(x, angle - spread, REGION, "points", "quiet"))
        items.append(Line(x, angle + spread, "", "points", "quiet"))
    return Panel(
        title,
        "frequency [Hz]",
        "phase [deg]",
        (*items, *marks),
        x_log=True,
        y_range=(-200.0, 200.0),
        kind=PanelKind.PHASE,
    )


def _coherence(frf: Frf, marks: tuple[Mark, ...]) -> Panel:
    at = thinned(frf.f, frf.f > 0)
    stated = [c for c in range(len(frf.channels)) if np.isfinite(frf.coherence[:, c]).any()]
    lines = tuple(Line(frf.f[at], frf.coherence[at, c], frf.channels[c]) for c in stated)
    return Panel(
        f"coherence with {frf.input}",
        "frequency [Hz]",
        "coherence",
        (*lines, *marks),
        x_log=True,
        y_range=(0.0, 1.05),
        kind=PanelKind.COHERENCE,
    )


def thinned(f: Array, good: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the indices of at most MAX_POINTS of the good bins, evenly spread over log f."""
    at = np.flatnonzero(good)
    if at.size <= MAX_POINTS:
        return at
    wanted = np.geomspace(f[at[0]], f[at[-1]], MAX_POINTS)
    return np.unique(at[np.minimum(np.searchsorted(f[at], wanted * (1 - 1e-12)), at.size - 1)])
