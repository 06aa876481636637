"""Panels of a fit: the measured responses with the model before and after, and the residual."""

from collections.abc import Mapping

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset
from checks.picture import Band, Line, Panel, PanelKind
from specs.units import RESPONSE_UNITS

BEFORE, AFTER = "model before the fit", "model fitted"
LEAST_RESIDUAL = 1e-4  # below, a picture shows nothing: no tolerance and no noise is as small


def fit_panels(data: Dataset, before: Complex, after: Complex) -> dict[str, Panel]:
    """Return the panels "<channel> magnitude", "<channel> phase", "<channel> residual" of every channel.

    before, after (F, C): the model at the bins of the data. The residual is drawn beside the 95 % band that noise and
    tolerance allow; a fit that explains stays within it 19 times in 20."""
    panels: dict[str, Panel] = {}
    for c, name in enumerate(data.channels):
        curves = {"measured": data.H[:, c], BEFORE: before[:, c], AFTER: after[:, c]}
        panels[f"{name} magnitude"] = _magnitude(data.f, name, curves)
        panels[f"{name} phase"] = _phase(data.f, name, curves)
        panels[f"{name} residual"] = _residual(data, c, before[:, c], after[:, c])
    return panels


def frf_panels(f: Array, H: Complex, channels: tuple[str, ...]) -> dict[str, Panel]:
    """Return the magnitude and phase of a model's responses H (F, C) alone."""
    panels: dict[str, Panel] = {}
    for c, name in enumerate(channels):
        panels[f"{name} magnitude"] = _magnitude(f, name, {"model": H[:, c]})
        panels[f"{name} phase"] = _phase(f, name, {"model": H[:, c]})
    return panels


_ROLES = {"measured": "data", BEFORE: "before", AFTER: "model", "model": "model"}


def _magnitude(f: Array, name: str, curves: Mapping[str, Complex]) -> Panel:
    lines = tuple(Line(f, np.abs(H), label, _style(label), _ROLES[label]) for label, H in curves.items())
    label = f"|{name} / Va| [{RESPONSE_UNITS.get(name, '')}]"
    return Panel(f"{name} / Va", "frequency [Hz]", label, lines, x_log=True, y_log=True)


def _phase(f: Array, name: str, curves: Mapping[str, Complex]) -> Panel:
    lines = tuple(Line(f, np.degrees(np.angle(H)), label, "points", _ROLES[label]) for label, H in curves.items())
    return Panel(
        f"{name} phase",
        "frequency [Hz]",
        "phase [deg]",
        lines,
        x_log=True,
        y_range=(-190.0, 190.0),
        kind=PanelKind.PHASE,
    )


def _residual(data: Dataset, c: int, before: Complex, after: Complex) -> Panel:
    size = np.abs(data.reference[:, c])
    allowed = np.sqrt(-np.log(0.05) * data.variance[:, c]) / size  # of a complex normal error of this variance
    left = {BEFORE: np.abs(data.H[:, c] - before) / size, AFTER: np.abs(data.H[:, c] - after) / size}
    lines = tuple(
        Line(data.f, np.maximum(r, LEAST_RESIDUAL), label, _style(label), _ROLES[label]) for label, r in left.items()
    )
    band = Band(
        data.f,
        np.full(data.f.size, LEAST_RESIDUAL),
        np.maximum(allowed, LEAST_RESIDUAL),
        "within noise and tolerance (95 %)",
    )
    title = f"{data.channels[c]} residual"
    return Panel(title, "frequency [Hz]", "|data - model| / |model|", (band, *lines), x_log=True, y_log=True)


def _style(label: str) -> str:
    return "dashed" if label == BEFORE else "solid"
