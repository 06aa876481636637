"""Pictures of an estimated misalignment: model and data, and the likelihood of each place."""

import numpy as np

from checks.arrays import Array
from checks.fitting.common_drive import DrivenModel
from checks.misalignment.estimate_types import DX, DY, MisalignmentEstimate
from checks.misalignment.gates import ratio_noise
from checks.picture import Image, Line, Mark, Panel, PanelKind

SHOWN_FROM = 50.0  # [Hz] below, the ratio is one
REACH, PLACES = 5.0, 81  # standard deviations that the map shows to either side, and its points along each axis
IN_ELLIPSE = 2.4477  # radius that holds 95 % of a normal in two dimensions: sqrt(-2 ln 0.05)


def misalignment_panels(found: MisalignmentEstimate) -> dict[str, Panel]:
    """Return magnitude and phase of the ratio, and the map; without a result no number and no map."""
    data = found.data.select(("de", "da")).band(SHOWN_FROM, np.inf)
    precise = ratio_noise(data) < 1.0
    f, R = data.f[precise], data.H[precise, 0] / data.H[precise, 1]
    H = DrivenModel(found.model).frf(f, found.fit.at, data.channels)
    own = {n: v for n, v in found.fit.at.items() if n in found.model.values}
    straight = found.model.frf(f, {**own, DX: 0.0, DY: 0.0}, data.channels)
    # the measured curve comes last, on top of the others
    curves = {"without misalignment": straight[:, 0] / straight[:, 1], "model": H[:, 0] / H[:, 1], "measured": R}
    roles = {"measured": "data", "model": "model", "without misalignment": "before"}
    styles = {"measured": "points", "model": "solid", "without misalignment": "dashed"}
    size = [Line(f, np.abs(c), n, styles[n], roles[n]) for n, c in curves.items()]
    angle = [Line(f, np.degrees(np.angle(c)), n, "points", roles[n]) for n, c in curves.items()]
    title = f"de / da: dx {found.dx.value:.1f} ± {found.dx.U:.1f}, dy {found.dy.value:.1f} ± {found.dy.U:.1f} um"
    if found.reason is not None:
        title = "de / da: no result"
    drawn = {
        "ratio": Panel(title, "frequency [Hz]", "|de / da|", tuple(size), x_log=True, y_log=True),
        "ratio phase": Panel(
            "phase of de / da",
            "frequency [Hz]",
            "phase [deg]",
            tuple(angle),
            x_log=True,
            y_range=(-200.0, 200.0),
            kind=PanelKind.PHASE,
        ),
    }
    return drawn if found.reason is not None else {**drawn, "map": _map(found)}


def _map(found: MisalignmentEstimate) -> Panel:
    """Return the likelihood of each place relative to the answer, everything else fitted again for it (the profile of
    the likelihood, to second order about the answer), and the region that holds the truth."""
    at, C = np.array([found.dx.value, found.dy.value]), _covariance_of_U(found)
    sd = np.sqrt(np.diag(C))
    x, y = (np.linspace(v - REACH * s, v + REACH * s, PLACES) for v, s in zip(at, sd, strict=True))
    away = np.stack(np.meshgrid(x - at[0], y - at[1]), axis=-1)
    unlikely = 0.5 * np.einsum("yxi,ij,yxj->yx", away, np.linalg.inv(C), away)
    image = Image(x, y, np.log10(1.0 + unlikely), "log10(1 + fall of the log-likelihood)")
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    edge = at[:, None] + IN_ELLIPSE * np.linalg.cholesky(C) @ np.array([np.cos(turn), np.sin(turn)])
    marks = (Mark(at[0], "x", role="model"), Mark(at[1], "y", role="model"))
    region = Line(edge[0], edge[1], "95 % region", role="model")
    return Panel("profile of the likelihood about the answer", "dx [um]", "dy [um]", (image, *marks, region))


def _covariance_of_U(found: MisalignmentEstimate) -> Array:
    """Return the covariance (2, 2) [um2] of the fit, scaled up to U."""
    i = [found.fit.names.index(n) for n in (DX, DY)]
    C = found.fit.cov[np.ix_(i, i)]
    wider = np.array([along.U / 2.0 for along in (found.dx, found.dy)]) / np.sqrt(np.diag(C))
    return np.asarray(C * np.outer(wider, wider))
