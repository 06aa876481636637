"""The answer of the gap workflow to look at: where model and data disagree, and both before and after."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from checks.gap.adequacy import energies
from checks.gap.result import Result
from checks.model.fit_panels import UNITS
from checks.picture import Band, Image, Item, Line, Mark, Panel, Span

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

CELLS = 120  # of the map along log f
LARGEST = 12.0  # of the map: from one part in 10^12 on the colour stays


def panels(result: Result) -> dict[str, Panel]:
    """The map, then for every channel magnitude and residual, on records that were not fitted."""
    data = result.before.data
    out = {"map": disagreement(result)}
    before, after = responses(result)
    for c, name in enumerate(data.channels):
        out[f"{name} magnitude"] = _magnitude(data.f, name, data.H[:, c], before[:, c], after[:, c])
    for c, name in enumerate(data.channels):
        out[f"{name} residual"] = _residual(result, c, before[:, c], after[:, c])
    return out


def responses(result: Result) -> tuple[Complex, Complex]:
    """(F, C) of the model before and after at the bins of the unseen records."""
    data = result.before.data
    return tuple(p.response.frf(data.f, p.at, data.channels) for p in (result.before, result.after))  # type: ignore[return-value]


def disagreement(result: Result) -> Panel:
    """Map over frequency and channel of -log10 of the chance of what was left before."""
    data = result.before.data
    chance = energies(result.before) / 2.0 / np.log(10.0)
    edges = np.geomspace(data.f[0], data.f[-1] * (1 + 1e-9), CELLS + 1)
    place = np.clip(np.searchsorted(edges, data.f, side="right") - 1, 0, CELLS - 1)
    z = np.zeros((len(data.channels), CELLS))
    for c in range(len(data.channels)):
        np.maximum.at(z[c], place, np.minimum(chance[:, c], LARGEST))
    middle = np.sqrt(edges[1:] * edges[:-1])
    image = Image(np.log10(middle), np.arange(len(data.channels), dtype=float), z, "-log10 p")
    names = ", ".join(f"{i} {c}" for i, c in enumerate(data.channels))
    return Panel(f"Chance of the residual before (channels: {names})", "log10 of frequency [Hz]", "", (image,))


def _magnitude(f: Array, name: str, H: Complex, before: Complex, after: Complex) -> Panel:
    lines = (
        Line(f, np.abs(H), "measured", "points", "data"),
        Line(f, np.abs(before), "model before", "dashed", "before"),
        Line(f, np.abs(after), "model after", "solid", "model"),
    )
    return Panel(f"{name} / Va", "frequency [Hz]", f"|{name} / Va| [{UNITS.get(name, '')}]", lines, True, True)


def _residual(result: Result, c: int, before: Complex, after: Complex) -> Panel:
    data = result.before.data
    name, size = data.channels[c], np.abs(data.H[:, c])
    allowed = np.sqrt(-np.log(0.05) * data.variance[:, c]) / size  # of a complex normal error of this variance
    worst = [w for w in result.where if w.channel == name][:4]
    items: list[Item] = [
        Span(w.f_lo_Hz, max(w.f_hi_Hz, 1.01 * w.f_lo_Hz), label="" if k else "disagrees, before", role="quiet")
        for k, w in enumerate(worst)
    ]
    items += [
        Band(data.f, np.full(data.f.size, 1e-4), np.maximum(allowed, 1e-4), "95 % of noise and tolerance", "quiet"),
        Line(*_smooth(data.f, np.abs(data.H[:, c] - before) / size), "before", "solid", "before"),
        Line(*_smooth(data.f, np.abs(data.H[:, c] - after) / size), "after", "solid", "model"),
    ]
    items += [Mark(f, label=f"pole {f:.1f} Hz") for u in result.unnamed if u.channel == name for f in u.poles_Hz[:1]]
    return Panel(f"{name}: what is left", "frequency [Hz]", "|data - model| / |data|", tuple(items), True, True)


def _smooth(f: Array, x: Array) -> tuple[Array, Array]:
    """Root mean square within cells of 1 % of f: what the eye would see of the noise."""
    place = np.floor(np.log(f / f[0]) / 0.01).astype(int)
    _, inverse, counts = np.unique(place, return_inverse=True, return_counts=True)
    mean = np.sqrt(np.bincount(inverse, x**2) / counts)
    middle = np.exp(np.bincount(inverse, np.log(f)) / counts)
    return middle, np.maximum(mean, 1e-4)


def errors(result: Result) -> Mapping[str, tuple[float, float, float, float]]:
    """Channel -> rms of the level [dB] and of the phase [deg] before, then after, over bins that are not noise."""
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
