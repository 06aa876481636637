"""Each unit of a batch fitted for itself: with the file's priors and with its misalignment free, so that it is not
mistaken for a shift of the batch, and with free latencies of its channels, which no file states."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, TypeVar

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.calibrate import Calibration, quicker, with_likelier_damping
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.fitting.fit import FitPoint, coarse_fits, finish, free_of
from checks.fitting.goodness import gaps, misfit
from checks.misalignment.estimate_types import DX, DY
from checks.model.channel_paths import CHANNELS, LATENCIES
from checks.model.joint_prior import JointPrior
from checks.model.learned_bench import LearnedBench
from checks.model.model import Model
from checks.population.bench_factor import BenchFactor, learn_factor, local_mean

OFFSETS = {DX: 60.0, DY: 180.0}  # [um] 1 sd, of a strut that was not aligned with care
LATENCY_SD_US = 50.0  # of converters, interpolators and filters that no file states
FEW_BINS = 400  # for all fits but the last
WIDER = (2.0, 1.0, 1.0, 1.0)  # times what a fit leaves is tolerated in the next one
ROUNDS = 3  # of fitting units beside a bench and learning the bench from them
FAR = 0.05  # of a response
BAND = 0.1  # of f, over which that is averaged
UNLIKE = 1 / 3  # share of the band of a channel from which on a unit has nothing in common with the others
COUNTS = 0.3  # weight below which a unit's own misfit is tolerated, too
G_MOST = 2.0  # on records that were not fitted; above, a unit has something that no value of the model gives

Say = Callable[[str], None]
T = TypeVar("T")
Gs = Mapping[str, float]
Values = Mapping[str, float]


class Progress(Protocol):
    """Passes items on and shows the progress through them."""

    def __call__(self, items: Sequence[T], words: str) -> Iterable[T]: ...


@dataclass(frozen=True, eq=False)
class UnitOfBatch:
    """A unit to learn from: the model with its payload, and its responses. first: to fit; second: another realisation
    of the same, to judge with, or None; payload_kg: as weighed, or None."""

    serial: str
    model: Model
    first: Dataset
    second: Dataset | None = None
    payload_kg: float | None = None

    def on_bench(self, learned: LearnedBench | None) -> "UnitOfBatch":
        """Return the same with the scatter between units of a learned bench."""
        second = None if self.second is None else self.second.on_bench(learned)
        return replace(self, first=self.first.on_bench(learned), second=second)


@dataclass(frozen=True, eq=False)
class UnitFit:
    """A unit fitted for itself: names (p,), theta (p,), cov (p, p) in the names' units; G: by channel on records that
    were not fitted, or on the fitted ones if there are no others; G_before: without the learned bench and with the
    latencies of the file; unlike: by channel, the share of the band in which it differs from the others."""

    unit: UnitOfBatch
    model: Model
    names: tuple[str, ...]
    theta: Array
    cov: Array
    G: Gs
    converged: bool
    G_before: Gs
    unlike: Gs = field(default_factory=dict)

    @property
    def serial(self) -> str:
        return self.unit.serial

    @property
    def fits(self) -> bool:
        return self.converged and self.worst <= G_MOST and max(self.unlike.values(), default=0.0) < UNLIKE

    @property
    def worst(self) -> float:
        return max(self.G.values(), default=np.inf)

    @property
    def at(self) -> dict[str, float]:
        """Return the fitted values by name."""
        return dict(zip(self.names, (float(v) for v in self.theta), strict=True))


@dataclass(frozen=True, eq=False)
class UnitRatios:
    """Residuals of the fits of units, on the union (F,) of their frequencies: H / H_model - 1 and its noise, the
    model's |H|, (n, F, C) each; serials (n,)."""

    f: Array
    channels: tuple[str, ...]
    ratios: Complex
    noise: Array
    sizes: Array
    serials: tuple[str, ...]

    def unlike(self, bench: LearnedBench, serial: str) -> dict[str, float]:
        """Return channel -> share of the band, octaves counting alike, in which a unit differs from what all have in
        common by more than `FAR`. A tolerance that is learned is as wide as units differ, so that G alone would call
        any units a batch."""
        i, octaves = self.serials.index(serial), np.gradient(np.log2(self.f))
        common = np.array([bench.at(self.f, c) for c in self.channels]).T - 1.0
        off = local_mean(self.f, np.abs(self.ratios[i] - common) ** 2 - self.noise[i], BAND) > FAR**2
        return dict(zip(self.channels, (octaves @ off / octaves.sum()).tolist(), strict=True))

    def learned(self, without: str | None = None) -> BenchFactor:
        """Return the factor that these units have in common. without: serial of a unit that is left out."""
        i = np.array([s != without for s in self.serials])
        return learn_factor(self.f, self.ratios[i], self.noise[i], self.sizes[i], self.channels)


@dataclass(frozen=True, eq=False)
class FittedUnits:
    """Every unit's fit beside the bench that all of them make, and their residuals without it; None if units have too
    little in common to learn a bench from."""

    fits: tuple[UnitFit, ...]
    bench: LearnedBench | None
    left: UnitRatios | None


def alone(model: Model) -> Model:
    """Return the model without an earlier batch and bench; the latency of each channel and the misalignment of a strut
    are uncertain, unless its file states an uncertainty."""
    unknown = {LATENCIES[c]: LATENCY_SD_US for c in model.channels}
    unknown |= OFFSETS if any(name.startswith("joint.") for name in model.values) else {}
    return replace(model, joint=None, learned=None, sds={**model.sds, **unknown, **model.sds})


def fit_all(units: Sequence[UnitOfBatch], say: Say, steps: Progress) -> FittedUnits:
    """Fit every unit by itself together with the common factor of the bench, which is learned on the way.

    First each unit is fitted alone, with its misfit tolerated band by band; then in turns the bench is learned from the
    residuals of the units, and the units are fitted on that bench; at last every unit is fitted on all bins. A unit
    with an effect of its own has little weight in the bands where it shows."""
    models = [quicker(u.model) if u.model.scatters else u.model for u in units]
    places = [_fit_alone(model, u.first) for model, u in zip(models, steps(units, "units fitted alone"), strict=True)]
    bench: LearnedBench | None = None
    left: UnitRatios | None = None
    for turn in range(ROUNDS):
        left = remaining_ratios(units, models, places)
        if left is None:
            break
        found = left.learned()
        bench = found.learned
        say(f"bench learned from {len(left.serials)} units, turn {turn + 1} of {ROUNDS}")
        if turn + 1 < ROUNDS:
            places = [_fit_beside(m, u, at, found, left) for m, u, at in zip(models, units, places, strict=True)]
    last = zip(models, steps(units, "units fitted beside the bench"), places, strict=True)
    fits = []
    for model, u, at in last:
        fit = _last_fit(model, u, at, bench)
        gaps = ", ".join(f"{c} {G:.3g}" for c, G in fit.G.items())
        say(f"{fit.serial}: G {gaps}" if gaps else f"{fit.serial}: no values of the model come near its responses")
        fits.append(fit)
    if bench is not None and left is not None:
        ratios = left
        fits = [replace(f, unlike=ratios.unlike(bench, f.serial)) if f.serial in ratios.serials else f for f in fits]
    return FittedUnits(tuple(fits), bench, left)


def remaining_ratios(
    units: Sequence[UnitOfBatch], models: Sequence[Model], places: Sequence[Values | None]
) -> UnitRatios | None:
    """Return what fits at these places leave, on the bins of the unit with the fewest; None for fewer than three."""
    usable = [(r, m, at) for r, m, at in zip(units, models, places, strict=True) if at is not None]
    if len(usable) < 3:
        return None
    channels = tuple(c for c in CHANNELS if all(c in r.first.channels for r, _, _ in usable))
    f = min((r.first.f for r, _, _ in usable), key=lambda f: f.size)
    f = f[(f >= max(r.first.f[0] for r, _, _ in usable)) & (f <= min(r.first.f[-1] for r, _, _ in usable))]
    if not channels or f.size < 2:
        return None
    ratios, noise, sizes = [], [], []
    for r, model, at in usable:
        data = r.first.select(channels)
        H = model.frf(data.f, at, channels)
        ratio, size = data.H / H - 1.0, np.abs(H)
        parts = [_interpolate(f, data.f, x) for x in (ratio.real, ratio.imag, data.noise / size**2, size)]
        ratios.append(parts[0] + 1j * parts[1])
        noise.append(parts[2])
        sizes.append(parts[3])
    serials = tuple(r.serial for r, _, _ in usable)
    return UnitRatios(f, channels, np.array(ratios), np.array(noise), np.array(sizes), serials)


def _interpolate(f: Array, own: Array, values: Array) -> Array:
    """Return values (F, C), given at frequencies `own`, interpolated to f."""
    if f.shape == own.shape and np.allclose(f, own):
        return values
    return np.array([np.interp(f, own, column) for column in values.T]).T


def _fit_alone(model: Model, data: Dataset) -> Values | None:
    """Return the values of a unit fitted alone: the next fit tolerates the residual of the last one in each band of a
    channel, so that the bands that the model explains decide. None if no search succeeds."""
    few, free = data.thinned(FEW_BINS), free_of(model)
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            at = coarse_fits(model, few, free)[0].at
            for wider in WIDER:
                H = model.frf(few.f, at, few.channels)
                at = finish(model, replace(few, by_frequency=wider * misfit(few, H)), _start_at(free, at)).at
    except (ModelError, np.linalg.LinAlgError):
        return None
    return at


def _fit_beside(model: Model, r: UnitOfBatch, at: Values | None, bench: BenchFactor, left: UnitRatios) -> Values | None:
    """Return the values of a unit fitted beside a learned bench, starting at the given ones. In bands in which the unit
    differs from the others, its own misfit is tolerated too."""
    if at is None:
        return None
    model = replace(model, learned=bench.learned)
    few = r.first.thinned(FEW_BINS)
    tolerated = bench.learned.tolerance_at(few.f, few.channels)
    weight = _interpolate(few.f, left.f, bench.weights[left.serials.index(r.serial)])
    own = misfit(few, model.frf(few.f, at, few.channels))
    for i, c in enumerate(few.channels):
        if c in left.channels:
            unlike = weight[:, left.channels.index(c)] < COUNTS
            tolerated[:, i] = np.where(unlike, np.maximum(tolerated[:, i], own[:, i]), tolerated[:, i])
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return finish(model, replace(few, by_frequency=tolerated), _start_at(free_of(model), at)).at
    except (ModelError, np.linalg.LinAlgError):
        return at


def _start_at(free: Sequence[Free], at: Values) -> FitPoint:
    return FitPoint(tuple(replace(p, start=at[p.name]) for p in free), np.inf)


def _last_fit(model: Model, r: UnitOfBatch, at: Values | None, bench: LearnedBench | None) -> UnitFit:
    """Fit all bins, with the form of damping that the data ask for. If no search succeeds, return the priors without G.

    The tolerance stays that of the file, even if the data of one unit would bear a finer one: the model's error is the
    same in all units of a batch, so it does not average as their noise does."""
    free = free_of(model)
    prior, sds = np.array([p.prior for p in free]), np.array([p.sd for p in free])
    names = tuple(p.name for p in free)
    nothing = UnitFit(r, model, names, prior, np.diag(sds**2), G={}, converged=False, G_before={})
    if at is None:
        return nothing
    on_bench, own = r.on_bench(bench), replace(model, learned=bench)
    unseen = on_bench.second or on_bench.first
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            fit = finish(own, on_bench.first, _start_at(free, at))
            found = with_likelier_damping(Calibration(own, own, fit))
            G = gaps_at(found.model, found.fit.at, unseen)
            in_file = {n: model.values[n] for n in LATENCIES.values() if n in found.fit.at}
            before = gaps_at(replace(found.model, learned=None), found.fit.at | in_file, r.second or r.first)
    except (ModelError, np.linalg.LinAlgError):
        return nothing
    fit = found.fit
    return UnitFit(r, found.model, names, fit.values, fit.cov, G, fit.converged, G_before=before)


def predicted_gaps(fit: UnitFit, prior: JointPrior | None, bench: LearnedBench | None) -> Gs:
    """Return G of a unit with a bench and a prior that were learned without it, fitted to its own data and judged on
    records that were not fitted. Empty if no values of the model come near them."""
    model, r = replace(fit.model, learned=bench), fit.unit.on_bench(bench)
    priors = {} if prior is None else {n: (v, prior.sds[n]) for n, v in prior.values.items()}
    free = [
        replace(p, prior=priors[p.name][0], sd=priors[p.name][1]) if p.name in priors else p for p in free_of(model)
    ]
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            at = finish(model, r.first.thinned(FEW_BINS), _start_at(free, fit.at), joint=prior).at
            return gaps_at(model, at, r.second or r.first)
    except (ModelError, np.linalg.LinAlgError):  # values that no strut has: far from what the others predict
        return {}


def gaps_at(model: Model, values: Mapping[str, float], data: Dataset) -> Gs:
    """Return G by channel of a model at these values."""
    H = model.frf(data.f, values, data.channels)
    return {c: g.G for c, g in gaps([data.around(H)], [data.H - H]).items()}
