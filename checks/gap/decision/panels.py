"""The answer of the gap workflow to look at: where model and data disagree, and both before and after."""

from collections.abc import Mapping, Sequence

import numpy as np

from checks.arrays import Array, Complex
from checks.gap.decision.result import Result
from checks.gap.statistics.projected_residual import Projected
from checks.picture import Band, Image, Item, Line, Mark, Panel, Span
from specs.units import RESPONSE_UNITS

CELLS = 120  # of the map along log f
WORST = 4  # bands that a picture marks
LEAST = 1e-4  # of |H|: less than any tolerance, so nothing to look at
Curve = tuple[Array, Array]
SHOWN = 0.0, 4.0  # of log10 G on the map: below it agrees, above the colour stays


def gap_panels(result: Result) -> dict[str, Panel]:
    """Return the map, then for every channel magnitude and residual, on records that were not fitted."""
    data = result.before.data
    out = {"map": disagreement_map(result)}
    before, after = responses(result)
    for c, name in enumerate(data.channels):
        sizes = (np.abs(H[:, c]) for H in (data.H, before, after))
        out[f"{name} magnitude"] = magnitude_panel(name, *((data.f, size) for size in sizes))
    for c, name in enumerate(data.channels):
        out[f"{name} residual"] = _residual(result, c, before[:, c], after[:, c])
    return out


def responses(result: Result) -> tuple[Complex, Complex]:
    """Return the responses (F, C) of the model before and after at the bins of the unseen records."""
    data = result.before.data
    return tuple(p.response.frf(data.f, p.at, data.channels) for p in shown(result))  # type: ignore[return-value]


def shown(result: Result) -> tuple[Projected, Projected]:
    """Return the models before and after; the same twice if nothing was found: then G before and after are equal
    too."""
    return (result.before, result.after) if result.found else (result.after, result.after)


def disagreement_map(result: Result) -> Panel:
    """Return the map over frequency and channel, before and after if something was named: log10 of the squared residual
    over noise and tolerance."""
    data = result.before.data
    edges = np.geomspace(data.f[0], data.f[-1] * (1 + 1e-9), CELLS + 1)
    middle = np.sqrt(edges[1:] * edges[:-1])
    rows, names = [], []
    for c, name in enumerate(data.channels):
        for words, H in list(zip(("before", "after"), responses(result), strict=True))[: 2 if result.found else 1]:
            near = data.around(H)
            G = np.abs(data.H[:, c] - H[:, c]) ** 2 / np.maximum(near.variance[:, c], 1e-300)
            rows.append(np.clip(np.log10(np.maximum(_by_cell(data.f, G, edges), 1e-3)), *SHOWN))
            names.append(f"{name} {words}" if result.found else name)
    image = Image(middle, np.arange(len(rows), dtype=float), np.array(rows), "log10 of G")
    title = "G by frequency and channel (dark: within noise and tolerance)"
    order = len(rows) - 0.5, -0.5  # the first channel on top
    return Panel(title, "frequency [Hz]", "", (image,), x_log=True, y_range=order, y_names=tuple(names))


def _by_cell(f: Array, G: Array, edges: Array) -> Array:
    """Return the mean in every cell; a cell without a bin takes the value of the nearest bin."""
    place = np.clip(np.searchsorted(edges, f, side="right") - 1, 0, edges.size - 2)
    count = np.bincount(place, minlength=edges.size - 1)
    mean = np.bincount(place, G, minlength=edges.size - 1) / np.maximum(count, 1)
    filled = np.flatnonzero(count)
    nearest = filled[np.abs(np.arange(count.size)[:, None] - filled).argmin(axis=1)]
    return np.asarray(mean[nearest])


def magnitude_panel(name: str, measured: Curve, before: Curve, after: Curve) -> Panel:
    """Return the magnitudes of a channel."""
    lines = (
        Line(*measured, "measured", "points", "data"),
        Line(*before, "model before", "dashed", "before"),
        Line(*after, "model after", "solid", "model"),
    )
    return Panel(f"{name} / Va", "frequency [Hz]", f"|{name} / Va| [{RESPONSE_UNITS.get(name, '')}]", lines, True, True)


def _residual(result: Result, c: int, before: Complex, after: Complex) -> Panel:
    data = result.before.data
    name, size = data.channels[c], np.abs(data.H[:, c])
    allowed = np.sqrt(-np.log(0.05) * data.variance[:, c]) / size  # of a complex normal error of this variance
    left, after_left = (smooth(data.f, np.abs(data.H[:, c] - H) / size) for H in (before, after))
    where = [(w.f_lo_Hz, w.f_hi_Hz) for w in result.where if w.channel == name]
    poles = [f for u in result.unnamed if u.channel == name for f in u.poles_Hz[:1]]
    return residual_panel(name, (data.f, allowed), left, after_left, where, poles)


def residual_panel(
    name: str,
    allowed: Curve,
    before: Curve,
    after: Curve,
    where: Sequence[tuple[float, float]],
    poles_Hz: Sequence[float],
) -> Panel:
    """Return the panel of a channel's residual. where: bands [Hz] in which the channel disagrees, the worst first."""
    f, most = allowed
    items: list[Item] = [
        Span(lo, max(hi, 1.01 * lo), label="" if k else "disagrees, before", role="quiet")
        for k, (lo, hi) in enumerate(where[:WORST])
    ]
    items += [
        Band(f, np.full(f.size, LEAST), np.maximum(most, LEAST), "95 % of noise and tolerance", "quiet"),
        Line(*before, "before", "solid", "before"),
        Line(*after, "after", "solid", "model"),
    ]
    items += [Mark(f, label=f"pole {f:.1f} Hz") for f in poles_Hz]
    return Panel(f"{name}: what is left", "frequency [Hz]", "|data - model| / |data|", tuple(items), True, True)


def smooth(f: Array, x: Array) -> tuple[Array, Array]:
    """Return the root mean square within cells of 1 % of f: the noise as the eye would see it."""
    place = np.floor(np.log(f / f[0]) / 0.01).astype(int)
    _, inverse, counts = np.unique(place, return_inverse=True, return_counts=True)
    mean = np.sqrt(np.bincount(inverse, x**2) / counts)
    middle = np.exp(np.bincount(inverse, np.log(f)) / counts)
    return middle, np.maximum(mean, LEAST)


def channel_errors(result: Result) -> Mapping[str, tuple[float, float, float, float]]:
    """Return by channel the rms of the level [dB] and of the phase [deg], before and after, over bins that are not
    noise."""
    data = result.before.data
    out = {}
    before, after = responses(result)
    for c, name in enumerate(data.channels):
        told = data.noise[:, c] < 0.01 * np.abs(data.H[:, c]) ** 2
        parts: list[float] = []
        for H in (before, after):
            ratio = data.H[told, c] / H[told, c]
            parts += [_rms(20.0 * np.log10(np.abs(ratio))), _rms(np.degrees(np.angle(ratio)))]
        out[name] = (parts[0], parts[1], parts[2], parts[3])
    return out


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2))) if x.size else float("nan")
