"""The answer of the gap workflow as Bode plots: measured, model before and after, each with its uncertainty.

Three panels of a channel share one frequency axis: magnitude, phase, and what is left over. All on records that were
not fitted. A band is the 95 % interval at one frequency: of the measurement by its noise; of the fitted model by its
stated tolerance and the covariance of all calibrated values, the scatter of an APA's modes among them; of units as the
model's file describes them, drawn from its priors and scatter.
"""

from collections.abc import Mapping

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.prior import prior_rows
from checks.gap.decision.panels import LEAST, disagreement_map, shown, smooth
from checks.gap.decision.result import Result
from checks.gap.statistics.projected_residual import Projected
from checks.model.unidentified import UnidentifiedElement
from checks.picture import Band, Item, Line, Mark, Panel, PanelKind
from checks.quantity import TWO_SIDED_95
from specs.units import RESPONSE_UNITS

GRID = 1200  # frequencies of a curve of the model, beside those of the bins
DRAWS = 80  # of units as the model's file describes them: the 2.5 % ends are then good to a third of their distance
CUTS = range(-360, 0, 15)  # [deg] where the circle may be cut for an axis
AFTER, ELEMENT = "model after", "with the unidentified element"


def bode_panels(result: Result, elements: Mapping[str, UnidentifiedElement] | None = None) -> dict[str, Panel]:
    """Return the panels "map", "<channel> magnitude", "<channel> phase", "<channel> deviation". elements: those added
    to the improved model without a name, by channel."""
    data = result.before.data
    f = np.union1d(data.f, np.geomspace(data.f[0], data.f[-1], GRID))
    names = data.channels
    first, last = shown(result)
    before, after = (p.response.frf(f, p.at, names) for p in (first, last))
    units = _units_of_the_file(first, f)
    along, across = _spread(last, f, after)
    out = {"map": disagreement_map(result)}
    for c, name in enumerate(names):
        added = (elements or {}).get(name)
        extra = None if added is None else after[:, c] * added.factor(f)
        curves = {"model before": before[:, c], AFTER: after[:, c]} | ({} if extra is None else {ELEMENT: extra})
        size = np.abs(after[:, c])
        high, low = size + TWO_SIDED_95 * along[:, c], np.maximum(size - TWO_SIDED_95 * along[:, c], 0.05 * size)
        bands = [Band(f, low, high, "95 % of the model after", "model")]
        if units is not None:
            bands.append(Band(f, units[0][:, c], units[1][:, c], "95 % of units, model file", "quiet"))
        out[f"{name} magnitude"] = _magnitude(result, c, f, curves, bands)
        out[f"{name} phase"] = _phase(result, c, f, curves, np.degrees(across[:, c] / size))
        out[f"{name} deviation"] = _deviation(result, c, f, np.hypot(along[:, c], across[:, c]) / size, added)
    return out


def _spread(fitted: Projected, f: Array, H: Complex) -> tuple[Array, Array]:
    """Return the standard uncertainty (F, C) of a fitted response along itself and across it, in its unit: tolerance
    and the covariance of the calibrated values."""
    names, L = _covariance(fitted)
    D = np.einsum("pq,pfc->qfc", L, fitted.response.jacobian(f, names, fitted.at, fitted.data.channels))
    turned = D * np.exp(-1j * np.angle(H))
    tolerance = 0.5 * (fitted.data.relative * np.abs(H)) ** 2
    return np.sqrt((turned.real**2).sum(0) + tolerance), np.sqrt((turned.imag**2).sum(0) + tolerance)


def _covariance(fitted: Projected) -> tuple[tuple[str, ...], Array]:
    """Return the names, and L (p, q) with L L^T the covariance of their values given data and priors."""
    free = fitted.response.free()
    names = tuple(p.name for p in free)
    scale = np.array([p.unit for p in free])
    D = fitted.response.jacobian(fitted.data.f, names, fitted.at, fitted.data.channels) * scale[:, None, None]
    J = np.vstack([fitted.data.whitener(D).T, prior_rows(free, fitted.response.model.joint) * scale])
    _, s, Vt = np.linalg.svd(J, full_matrices=False)
    told = s > 1e-9 * s[0]
    return names, scale[:, None] * (Vt[told].T / s[told])


def _units_of_the_file(base: Projected, f: Array) -> tuple[Array, Array] | None:
    """Return the two magnitudes (F, C) between which 95 % of the units described by the model's file lie; None if it
    states no uncertain value. Parameters without a prior stay as fitted."""
    known = [p for p in base.response.free() if np.isfinite(p.sd) and p.sd > 0.0]
    if not known:
        return None
    rng, W = np.random.default_rng(0), prior_rows(known, base.response.model.joint)
    drawn = []
    for z in rng.standard_normal((DRAWS, len(known))):
        moved = np.linalg.solve(W, z)
        values = {p.name: float(np.clip(p.prior + d, p.lo, p.hi)) for p, d in zip(known, moved, strict=True)}
        try:
            drawn.append(np.abs(base.response.frf(f, {**base.at, **values}, base.data.channels)))
        except ModelError:  # a draw outside what can be built is no unit
            continue
    if len(drawn) < DRAWS // 2:
        return None
    low, high = np.quantile(drawn, (0.025, 0.975), axis=0)
    return low, high


_LOOKS = {"model before": ("dashed", "before"), AFTER: ("solid", "model"), ELEMENT: ("dashed", "good")}


def _magnitude(result: Result, c: int, f: Array, curves: Mapping[str, Complex], bands: list[Band]) -> Panel:
    data = result.before.data
    name, size = data.channels[c], np.abs(data.H[:, c])
    half = TWO_SIDED_95 * np.sqrt(0.5 * data.noise[:, c])
    noise = Band(data.f, np.maximum(size - half, 0.05 * size), size + half, "95 % of the measurement", "data")
    lines = [Line(f, np.abs(H), label, *_LOOKS[label]) for label, H in curves.items()]
    items: list[Item] = [*lines, Line(data.f, size, "measured", "points", "data"), noise, *bands]
    seen = np.concatenate([size, *(np.abs(H) for H in curves.values())])
    y_range = 0.6 * float(seen.min()), 1.7 * float(seen.max())
    label = f"|{name} / Va| [{RESPONSE_UNITS.get(name, '')}]"
    return Panel(
        f"{name} / Va", "frequency [Hz]", label, tuple(items), True, True, y_range=y_range, x_range=_range(data.f),
        kind=PanelKind.RESPONSE,
    )  # fmt: skip


def _phase(result: Result, c: int, f: Array, curves: Mapping[str, Complex], sd_deg: Array) -> Panel:
    data = result.before.data
    name, measured = data.channels[c], np.degrees(np.angle(data.H[:, c]))
    modelled = {label: np.degrees(np.angle(H)) for label, H in curves.items()}
    start = _cut([measured, modelled[AFTER]])
    noise = np.minimum(TWO_SIDED_95 * np.degrees(np.sqrt(0.5 * data.noise[:, c]) / np.abs(data.H[:, c])), 180.0)
    at, near = _from(measured, start), _from(modelled[AFTER], start)
    f_at, at_, noise_ = _broken(data.f, at, noise)
    f_near, near_, sd_ = _broken(f, near, TWO_SIDED_95 * sd_deg)
    items: list[Item] = [
        *(Line(*_broken(f, _from(phase, start))[:2], "", *_LOOKS[label]) for label, phase in modelled.items()),
        Line(data.f, at, "", "points", "data"),
        Band(f_at, at_ - noise_, at_ + noise_, "", "data"),
        Band(f_near, near_ - sd_, near_ + sd_, "", "model"),
    ]
    return Panel(
        f"{name} phase", "frequency [Hz]", "phase [deg]", tuple(items), x_log=True, y_range=_quarters([at, near]),
        x_range=_range(data.f), kind=PanelKind.PHASE,
    )  # fmt: skip


def _deviation(result: Result, c: int, f: Array, relative_sd: Array, added: UnidentifiedElement | None) -> Panel:
    """Return measured less model, relative to the measured, beside the band of noise and the model's own
    uncertainty."""
    data = result.before.data
    name, H = data.channels[c], data.H[:, c]
    first, last = shown(result)
    models = [("residual before", first.modelled[:, c], "before"), ("residual after", last.modelled[:, c], "model")]
    if added is not None:
        models.append(("residual with the element", models[-1][1] * added.factor(data.f), "good"))
    noise = np.sqrt(-np.log(0.05) * data.noise[:, c]) / np.abs(H)  # of a complex normal error of this variance
    model = np.sqrt(-np.log(0.05)) * relative_sd
    items: list[Item] = [
        Band(f, np.full(f.size, LEAST), np.maximum(model, LEAST), "95 % of the model", "model"),
        Line(*smooth(data.f, np.maximum(noise, LEAST)), "95 % of the noise", "dashed", "data"),
        *(Line(*smooth(data.f, np.abs(H - M) / np.abs(H)), words, "solid", role) for words, M, role in models),
        *(
            Mark(u.poles_Hz[0], label=f"{u.poles_Hz[0]:.1f} Hz")
            for u in result.unnamed
            if u.channel == name and u.poles_Hz
        ),
    ]
    return Panel(
        f"{name} deviation", "frequency [Hz]", "relative error", tuple(items), True, True, y_range=(LEAST, 10.0),
        x_range=_range(data.f),
    )  # fmt: skip


def _range(f: Array) -> tuple[float, float]:
    return float(f[0]) / 1.05, float(f[-1]) * 1.05


def _cut(phases: list[Array]) -> float:
    """Return the start [deg] of an axis of a whole turn at which the fewest curves jump from one end to the other."""
    return float(min(CUTS, key=lambda cut: (_jumps(phases, cut), abs(np.mean(_from(phases[0], cut))))))


def _jumps(phases: list[Array], cut: float) -> int:
    return sum(int(np.count_nonzero(np.abs(np.diff(_from(p, cut))) > 180.0)) for p in phases)


def _from(phase: Array, start: float) -> Array:
    """Return the same angles [deg] in start..start + 360."""
    return np.asarray(start + np.mod(phase - start, 360.0))


def _quarters(phases: list[Array]) -> tuple[float, float]:
    """Return the ends [deg] of an axis, a little beyond whole quarters of a turn."""
    low, high = min(float(p.min()) for p in phases), max(float(p.max()) for p in phases)
    return 90.0 * np.floor(low / 90.0) - 15.0, 90.0 * np.ceil(high / 90.0) + 15.0


def _broken(f: Array, phase: Array, beside: Array | None = None) -> tuple[Array, Array, Array]:
    """Return a curve without the line between its jumps from one end of the axis to the other; beside: values that
    belong to its points."""
    at = np.flatnonzero(np.abs(np.diff(phase)) > 180.0) + 1
    return tuple(np.insert(x, at, np.nan) for x in (f, phase, phase if beside is None else beside))  # type: ignore[return-value]
