"""Pictures of an estimated misalignment: model against data, and how likely each place is."""

import numpy as np

from checks.arrays import Array
from checks.fitting.common_drive import Driven
from checks.misalignment.estimate_types import DX, DY, MisalignmentEstimate
from checks.misalignment.gates import ratio_noise
from checks.picture import Image, Line, Mark, Panel

SHOWN_FROM = 50.0  # [Hz] below, the ratio is one
IN_ELLIPSE = 2.4477  # radius that holds 95 % of a normal in two dimensions: sqrt(-2 ln 0.05)


def panels(found: MisalignmentEstimate) -> dict[str, Panel]:
    """Magnitude and phase of the ratio, and the map. Without a result no place is marked and no number stands."""
    data = found.data.band(SHOWN_FROM, np.inf)
    known = ratio_noise(data) < 1.0
    f, R = data.f[known], data.H[known, 0] / data.H[known, 1]
    H = Driven(found.model).frf(f, found.fit.at, data.channels)
    straight = found.model.frf(f, _aligned(found), data.channels)
    curves = {"measured": R, "model": H[:, 0] / H[:, 1], "the same, aligned": straight[:, 0] / straight[:, 1]}
    roles = {"measured": "data", "model": "model", "the same, aligned": "before"}
    styles = {"measured": "points", "model": "solid", "the same, aligned": "dashed"}
    size = [Line(f, np.abs(c), n, styles[n], roles[n]) for n, c in curves.items()]
    angle = [Line(f, np.degrees(np.angle(c)), n, "points", roles[n]) for n, c in curves.items()]
    title = f"de / da: dx {found.dx.value:.1f} ± {found.dx.U:.1f}, dy {found.dy.value:.1f} ± {found.dy.U:.1f} um"
    if found.reason is not None:
        title = "de / da: no result"
    return {
        "ratio": Panel(title, "frequency [Hz]", "|de / da|", tuple(size), x_log=True, y_log=True),
        "ratio phase": Panel(
            "phase of de / da", "frequency [Hz]", "phase [deg]", tuple(angle), x_log=True, y_range=(-200.0, 200.0)
        ),
        "map": _map(found),
    }


def _aligned(found: MisalignmentEstimate) -> dict[str, float]:
    own = {n: v for n, v in found.fit.at.items() if n in found.model.values}
    return {**own, DX: 0.0, DY: 0.0}


def _map(found: MisalignmentEstimate) -> Panel:
    """Misfit of the table over its least, as a power of ten, and the region of the estimate."""
    m = found.map
    above = np.log10(1.0 + m.misfit - m.misfit.min())
    image = Image(m.dx, m.dy, above.T, "log10(1 + misfit above the least)")
    if found.reason is not None:
        return Panel("misfit of the table; no result", "dx [um]", "dy [um]", (image,))
    x, y = _ellipse(found)
    marks = (Mark(found.dx.value, "x", role="model"), Mark(found.dy.value, "y", role="model"))
    region = Line(x, y, "95 % region", role="model")
    return Panel("where it lies: table and estimate", "dx [um]", "dy [um]", (image, *marks, region))


def _ellipse(found: MisalignmentEstimate) -> tuple[Array, Array]:
    """Outline of the region that holds the truth with 95 %; widened where U is wider than the fit's."""
    i = [found.fit.names.index(n) for n in (DX, DY)]
    wider = np.array([along.U / 2.0 for along in (found.dx, found.dy)]) / np.sqrt(np.diag(found.fit.cov)[i])
    L = np.linalg.cholesky(found.fit.cov[np.ix_(i, i)] * np.outer(wider, wider))
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    x, y = IN_ELLIPSE * L @ np.array([np.cos(turn), np.sin(turn)])
    return found.dx.value + x, found.dy.value + y
