"""The quick look at every member of the library: how much of the residual could it explain, and from where to start."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.fitting.misplaced_modes import peaks as peaks_of
from checks.gap.modelling.augmented import columns_of, evaluated, slope
from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.thresholds import PER_PARAMETER
from checks.gap.statistics.projected_residual import Projected, energies

APART = 0.05  # of f: nearer starts are the same
LACKS = 2.0  # times the model and its surroundings: no calibrated parameter does this
BESIDE = 1  # bins: a zero is no wider, the mode of a strut beside it is


@dataclass(frozen=True)
class Score:
    """The score of a member of the library. gain: of twice the log-likelihood, linearised; dof; looked: places tried;
    starts: values to fit from, best first; failure: why the member could be evaluated nowhere, or ""."""

    member: Effect
    gain: float
    dof: int
    looked: int
    starts: tuple[dict[str, float], ...]
    failure: str = ""

    @property
    def net(self) -> float:
        """Return the gain in log-likelihood less the cost of parameters."""
        return 0.5 * self.gain - PER_PARAMETER * self.dof

    @property
    def p(self) -> float:
        """Return the chance of so large a gain somewhere if nothing is missing."""
        return float(min(1.0, self.looked * stats.chi2.sf(self.gain, self.dof)))


def screen(projected: Projected, member: Effect, starts: int = 2) -> Score:
    """Return the gain of one member on top of a calibrated response, the calibrated parameters free to follow."""
    if (score := _pulled(projected, member)) is not None:
        return score
    lacking = _too_small(projected, member)
    problems: list[str] = []
    tried = list(_tried(projected, member, lacking, problems))
    if not tried:
        failure = problems[0] if problems and member.factor is not None else ""
        return Score(member, 0.0, 1, 1, ({p.name: p.start for p in member.parameters},), failure)
    tried.sort(key=lambda t: -t[0])
    kept: list[dict[str, float]] = []
    for _, values in tried:
        if len(kept) < starts and all(_differ(values, k) for k in kept):
            kept.append(values)
    # A fit begins there whatever it promises: beside something so large nothing is in proportion.
    for f in lacking[:1]:
        kept += [values for _, values in tried if values.get("f_Hz") == f][:1]
    return Score(member, max(0.0, tried[0][0]), max(1, len(member.parameters)), len(tried), tuple(kept))


def _pulled(projected: Projected, effect: Effect) -> Score | None:
    """Score an effect that stands for a calibrated parameter by what the prior costs and by the calibrated value; None
    if the model does not calibrate that parameter."""
    model, pulls = projected.response.model, projected.pulls
    found = [t for t in effect.stands_for(model) if t in pulls and t in projected.at]
    if not found or len(effect.parameters) != 1:
        return None
    p = effect.parameters[0]
    away = [projected.at[t] - (model.values[t] if effect.adds else 0.0) for t in found]
    value = float(np.clip(np.mean(away), p.lo, p.hi))
    return Score(effect, float(sum(pulls[t] ** 2 for t in found)), len(found), 1, ({p.name: value},))


def _differ(a: Mapping[str, float], b: Mapping[str, float]) -> bool:
    if "f_Hz" in a:
        return abs(a["f_Hz"] - b["f_Hz"]) > APART * b["f_Hz"]
    return any(abs(a[k] - b[k]) > 1e-9 for k in a)


def _grid(projected: Projected, member: Effect, lacking: Sequence[float]) -> Iterator[dict[str, float]]:
    shapes = [p for p in member.parameters if not p.linear]
    axes = [(*p.places, *((*peaks(projected, member.channels), *lacking) if p.name == "f_Hz" else ())) for p in shapes]
    for values in product(*axes):
        yield {p.name: float(np.clip(v, p.lo, p.hi)) for p, v in zip(shapes, values, strict=True)}


def peaks(projected: Projected, channels: Sequence[str]) -> list[float]:
    """Return the frequencies [Hz] at which some channels leave the largest residual, by `misplaced_modes.peaks`."""
    e = energies(projected)
    columns = [projected.data.channels.index(c) for c in channels if c in projected.data.channels]
    return peaks_of(projected.data.f, e[:, columns].sum(axis=1))


def _too_small(projected: Projected, member: Effect) -> list[float]:
    """Return the frequencies [Hz] at which the data are far above the model on the channels of a member without linear
    parameters, the worst first.

    The residual does not show a tall resonance that the model lacks: it is large in a few bins there, and in many above
    the resonance, where the model is too large. The model is taken at its largest among neighbouring bins, so that its
    zeros do not count."""
    if any(p.linear for p in member.parameters):
        return []
    data, size = projected.data, np.abs(projected.modelled)
    columns = [data.channels.index(c) for c in member.channels if c in data.channels]
    around = sliding_window_view(np.pad(size, ((BESIDE, BESIDE), (0, 0)), mode="edge"), 2 * BESIDE + 1, axis=0)
    known = np.maximum(around.max(axis=-1), np.sqrt(data.noise))
    times = (np.abs(data.H) / known)[:, columns].max(axis=1)
    return [f for f in peaks_of(data.f, times) if times[data.f == f].max() > LACKS]


def _tried(
    projected: Projected, member: Effect, lacking: Sequence[float], problems: list[str]
) -> Iterator[tuple[float, dict[str, float]]]:
    """Yield (gain, values) at every place of the grid that the model can hold, with the linear parameters at their
    best. problems: takes why the others cannot be."""
    linear = [p for p in member.parameters if p.linear]
    shapes, changes = [], []
    for shape in _grid(projected, member, lacking):
        try:
            changes.append(_changes(projected, member, {**shape, **{p.name: 0.0 for p in linear}}))
        except ValueError as e:
            problems.append(str(e))
            continue
        shapes.append(shape)
    if not shapes:
        return
    # All at once: taking them through the whitener one by one would take most of the time.
    for D, shape in zip(projected.rows(np.array(changes)), shapes, strict=True):
        yield _at_best(projected, D, linear, shape) if linear else _along(projected, member, D[0], shape)


def _at_best(
    projected: Projected, D: Array, linear: Sequence[Parameter], shape: Mapping[str, float]
) -> tuple[float, dict[str, float]]:
    r = projected.left
    best, *_ = np.linalg.lstsq(D.T, r, rcond=None)
    gain = float(r @ r - np.sum((r - best @ D) ** 2))
    return gain, {**shape, **{p.name: float(np.clip(b, p.lo, p.hi)) for p, b in zip(linear, best, strict=True)}}


def _along(
    projected: Projected, member: Effect, d: Array, shape: Mapping[str, float]
) -> tuple[float, dict[str, float]]:
    """Return the same for values that are not linear: the gain if the effect had its best size, and, if a value of no
    effect exists, that size; a grid's own values may all be far too large."""
    share = max(float(d @ projected.left), 0.0) / max(float(d @ d), 1e-300)
    gain = share * share * float(d @ d)
    p = member.parameters[0]
    if len(shape) == 1 and np.isfinite(p.off):
        return gain, {p.name: float(np.clip(p.off + share * (shape[p.name] - p.off), p.lo, p.hi))}
    return gain, dict(shape)


def directions(projected: Projected, member: Effect, values: Mapping[str, float]) -> Array:
    """Return the projected rows (k, n) per unit of the linear parameters; without any, the row (1, n) of the effect
    itself at the values."""
    return projected.rows(_changes(projected, member, values))


def _changes(projected: Projected, member: Effect, values: Mapping[str, float]) -> Complex:
    """Return the changes (k, F, C) of the response that `directions` whitens."""
    data, base = projected.data, projected.response
    if member.factor is not None:
        return _by_factor(projected, member, values)
    response = base.with_member(member)
    at = {**projected.at, **{f"{member.name}.{k}": v for k, v in values.items()}}
    linear = [f"{member.name}.{p.name}" for p in member.parameters if p.linear]
    if linear:
        return response.jacobian(data.f, linear, at, data.channels)
    return (response.frf(data.f, at, data.channels) - projected.modelled)[None]


def _by_factor(projected: Projected, member: Effect, values: Mapping[str, float]) -> Complex:
    """Return the same for a member that multiplies its channels: nothing else of the response is evaluated anew."""
    data, s = projected.data, np.asarray(2j * np.pi * projected.data.f, dtype=np.complex128)
    linear = [p for p in member.parameters if p.linear]
    rows = [slope(member, p, values, s) for p in linear] or [evaluated(member, values, s) - 1.0]
    columns = columns_of(member, data.channels)
    out = np.zeros((len(rows), *data.H.shape), dtype=complex)
    out[:, :, columns] = np.array(rows)[:, :, None] * projected.modelled[:, columns]
    return out
