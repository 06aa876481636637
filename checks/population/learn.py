"""A model learned from a batch of units, and each unit compared with the prediction of the others.

Every unit is fitted for itself (`unit_fits`). The priors are taken out again and `hierarchy` estimates the batch
from the likelihoods. The misalignments are a random effect like the rest: a mean that all units have in common, of a
jig, of APAs that are lopsided alike or of the model's own error, and the scatter of the units about it, both by t tails
([LLT89]). A unit is misaligned if it lies off that mean by more than the scatter; one unit that does moves neither.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from checks import distributions as stats
from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.fit import free_of
from checks.model.channel_paths import LATENCIES
from checks.model.joint_prior import COMMON, JointPrior
from checks.model.learned_bench import LearnedBench
from checks.model.model import Model
from checks.population.hierarchy import (
    STRENGTH,
    Batch,
    Belonging,
    Prior,
    compare,
    count_covered,
    determined_parameters,
    information,
    learn,
    learn_without_each,
)
from checks.population.unit_fits import (
    FAR,
    G_MOST,
    OFFSETS,
    UNLIKE,
    FittedUnits,
    Gs,
    Progress,
    Say,
    UnitFit,
    UnitOfBatch,
    alone,
    fit_all,
    predicted_gaps,
)
from checks.quantity import TWO_SIDED_95
from specs.errors import AcceptError

FEWEST = 3  # units: of two it cannot be said which one does not belong
LATENCY_SCATTER_US = 0.5  # from unit to unit on one bench
ALIGNED = 0.1  # of the misalignment of a strut that was not aligned with care
BIAS = 2.0  # of a mode: sd of what the model is wrong by in all units alike, in sds of the scatter
STRANGE = 1e-3  # chance of a unit that belongs, both of all its parameters and of the worst
HOLDS = 2 / 3  # share of the units that have to belong
NEAR_BOUND = 0.05  # of the way from a physical bound to the given mean
DIGITS = "0123456789"
MODES, PAYLOAD = "apa.mode_", "bench.payload_kg"


class NothingLearned(AcceptError, ValueError):
    """Units of which the model can make nothing."""


@dataclass(frozen=True, eq=False)
class BatchMember:
    """A unit against the batch that the others make. G_left_out: with the values that follow from the others' batch and
    its own data; G_before: without the bench and with the latencies of the file; worst: the parameter that lies
    farthest off, and by how many standard deviations."""

    serial: str
    belongs: bool
    reason: str | None
    G: Gs
    G_left_out: Gs
    G_before: Gs
    belonging: Belonging
    worst: tuple[str, float] | None
    weight: float


@dataclass(frozen=True, eq=False)
class Population:
    """names (p,); model: without an earlier batch and bench; prior, batch: of these names. judged: every unit, in the
    order given; covered: how many parameters of the units that belong lie within the prediction of the others, and how
    many were compared. bench: the unexplained factor that it puts on every unit."""

    names: tuple[str, ...]
    model: Model
    damping: str
    prior: Prior
    batch: Batch
    judged: tuple[BatchMember, ...]
    covered: tuple[int, int]
    bench: LearnedBench | None

    @classmethod
    def of_units(cls, units: Sequence[UnitOfBatch], model: Model, say: Say, steps: Progress) -> "Population":
        """Fit every unit, learn bench and batch, judge each unit by the others. model: as its file describes it. Raises
        ModelError if it has no uncertain value, NothingLearned if no unit can be fitted at all."""
        if not model.sds:
            raise ModelError(f"{model.name}: no value has an sd, so there is nothing to learn")
        fitted = fit_all([replace(u, model=alone(u.model)) for u in units], say, steps)
        if not any(f.G for f in fitted.fits):
            raise NothingLearned(
                f"no values of {model.name} come near the responses of any of {len(units)} units: the model is of "
                "another kind of unit, or its priors are too narrow for these"
            )
        return population_of_fits(fitted, alone(model), steps)

    @property
    def determined(self) -> tuple[Array, tuple[tuple[int, int, float], ...]]:
        """Return how much of its prior's sd is left of each mean (p,), and the pairs that are not told apart."""
        return determined_parameters(self.batch, self.prior)

    @property
    def holds(self) -> bool:
        """Return whether enough units belong to call it a batch."""
        belong = sum(j.belongs for j in self.judged)
        return self.batch.converged and belong >= max(FEWEST, HOLDS * len(self.judged))


def population_of_fits(fitted: FittedUnits, model: Model, steps: Progress) -> Population:
    """Make the batch of fitted units. A unit that does not belong is taken out, and the others are learned again."""
    fits = fitted.fits
    free = free_of(model)
    names = tuple(p.name for p in free)
    kept = np.array([i for i, n in enumerate(names) if n not in OFFSETS])
    precision, pull = _likelihoods(fits, free)
    prior = prior_of(free)
    belongs = np.array([f.fits for f in fits])
    while True:
        batches = _batches(precision, pull, prior, belongs)
        # by what it is made of: a unit that is misaligned by anything belongs
        scatters = ([OFFSETS.get(n, s) for n, s in zip(names, b.scatter, strict=True)] for b in batches)
        made = (replace(b, scatter=np.array(scatter)) for b, scatter in zip(batches, scatters, strict=True))
        found = [compare(P, h, b) for P, h, b in zip(precision, pull, made, strict=True)]
        strange = np.array([min(b.p_all, b.p_worst) < STRANGE for b in found])
        if not (belongs & strange).any() or np.sum(belongs & ~strange) < FEWEST:
            break
        belongs &= ~strange
    batches = [replace(b, mean=physical(b.mean, free, prior.mean)) for b in batches]
    batch = learn(precision[belongs], pull[belongs], prior) if belongs.any() else learn(precision, pull, prior)
    batch = replace(_with_few_offsets(batch, names), mean=physical(batch.mean, free, prior.mean))
    weights = np.ones(len(fits))
    weights[belongs] = batch.weights.min(axis=1) if belongs.any() else 1.0
    judged = tuple(
        _judge(fit, names, one, bool(ok), _gaps_left_out(fit, fitted, names, kept, b), float(weight))
        for fit, one, ok, b, weight in zip(
            steps(fits, "units judged by the others"), found, belongs, batches, weights, strict=True
        )
    )
    damping = [f.model.damping for f, ok in zip(fits, belongs, strict=True) if ok] or [model.damping]
    return Population(
        names=names,
        model=model,
        damping=max(sorted(set(damping)), key=damping.count),  # the most frequent, the first by the alphabet if several
        prior=prior,
        batch=batch,
        judged=judged,
        covered=count_covered([b for b, ok in zip(found, belongs, strict=True) if ok]),
        bench=fitted.bench,
    )


def _gaps_left_out(fit: UnitFit, fitted: FittedUnits, names: Sequence[str], kept: Array, others: Batch) -> Gs:
    """Return G of a unit as predicted by the bench and the batch of the others."""
    if not fit.G:
        return {}
    bench = fitted.bench
    if fitted.left is not None and fit.serial in fitted.left.serials and len(fitted.left.serials) > FEWEST:
        bench = fitted.left.learned(without=fit.serial).learned
    both = np.ix_(kept, kept)
    prior = JointPrior(tuple(names[i] for i in kept), others.mean[kept], others.of_one_more[both])
    return predicted_gaps(fit, prior, bench)


def _likelihoods(fits: Sequence[UnitFit], free: Sequence[Free]) -> tuple[Array, Array]:
    """Return precision (n, p, p) and pull (n, p) of the units' fits. An unexplained residual widens them: one that is G
    times too large may have moved every value by as much. A payload that was weighed is a datum of its unit."""
    theta, cov = np.array([f.theta for f in fits]), np.array([f.cov for f in fits])
    mean, sds = np.array([p.prior for p in free]), np.array([p.sd for p in free])
    names = [p.name for p in free]
    wider = np.array([max(f.worst, 1.0) for f in fits])
    precision, pull = information(theta, cov, mean, np.diag(sds**2))
    precision, pull = precision / wider[:, None, None], pull / wider[:, None]
    if PAYLOAD in names:
        k = names.index(PAYLOAD)
        for i, f in enumerate(fits):
            if f.unit.payload_kg is not None:
                precision[i, k, k] += 1 / sds[k] ** 2
                pull[i, k] += f.unit.payload_kg / sds[k] ** 2
    return precision, pull


def prior_of(free: Sequence[Free]) -> Prior:
    """Return the prior of a batch.

    A file's sd is how far one unit may lie off; half of its variance is taken for what units have in common. That of a
    mode is its scatter alone, and how far the model is off in all units is learned from all modes. A latency is the
    bench's, and the same in all units but for the clock. Misalignments may have anything in common; that of struts that
    were aligned counts as one value of their scatter, so that the units decide."""
    sds = np.array([p.sd for p in free])
    offset = np.array([p.name in OFFSETS for p in free])
    own = np.array([p.name.startswith(MODES) for p in free])
    of_bench = np.array([p.name in LATENCIES.values() for p in free])
    kinds = [p.name.rstrip(DIGITS) if p.name.startswith(MODES) else p.name for p in free]
    mean_sd = np.select([own, of_bench | offset], [BIAS * sds, sds], COMMON**0.5 * sds)
    few = [sds, np.minimum(sds, LATENCY_SCATTER_US), ALIGNED * sds]
    return Prior(
        mean=np.array([p.prior for p in free]),
        mean_sd=mean_sd,
        scatter=np.select([own, of_bench, offset], few, (1.0 - COMMON) ** 0.5 * sds),
        kinds=np.unique(kinds, return_inverse=True)[1],
        strength=np.where(offset, 1.0, STRENGTH),
    )


def _with_few_offsets(batch: Batch, names: Sequence[str]) -> Batch:
    """Return the batch with mean and scatter of the misalignments as wide as the interval of t: the units and the value
    of the prior are too few to know a scatter ([HARTUNG01], for the mean of a random effect)."""
    wide = float(stats.t.ppf(0.975, len(batch.units))) / TWO_SIDED_95
    wider = np.array([wide if n in OFFSETS else 1.0 for n in names])
    return replace(batch, scatter=batch.scatter * wider, mean_cov=batch.mean_cov * np.outer(wider, wider))


def _batches(precision: Array, pull: Array, prior: Prior, belongs: Array) -> list[Batch]:
    """Return for every unit the batch of those that belong, without itself."""
    if belongs.sum() < FEWEST:
        return learn_without_each(precision, pull, prior)
    inside = learn_without_each(precision[belongs], pull[belongs], prior)
    whole = learn(precision[belongs], pull[belongs], prior)
    left = iter(inside)
    return [next(left) if ok else whole for ok in belongs]


def _judge(
    fit: UnitFit, names: Sequence[str], one: Belonging, belongs: bool, G_left_out: Gs, weight: float
) -> BatchMember:
    z = np.where(np.isfinite(one.z), np.abs(one.z), -1.0)
    k = int(np.argmax(z))
    worst = (names[k], float(one.z[k])) if z[k] >= 0 else None
    reason = _reason(fit, one, worst, belongs)
    return BatchMember(fit.serial, belongs, reason, fit.G, G_left_out, fit.G_before, one, worst, weight)


def _reason(fit: UnitFit, one: Belonging, worst: tuple[str, float] | None, belongs: bool) -> str | None:
    """Return why a unit does not belong, or None if it does."""
    if belongs:
        return None
    if not fit.G:
        return "no values of the model come near its responses"
    if not fit.converged:
        return "the search for its parameters did not settle"
    if fit.worst > G_MOST:
        channel = max(fit.G, key=lambda c: fit.G[c])
        return f"G of {channel} is {fit.worst:.3g} with every value free: it has something that the model does not"
    unlike = max(fit.unlike, key=lambda c: fit.unlike[c], default="")
    if unlike and fit.unlike[unlike] >= UNLIKE:
        return (
            f"{unlike} differs from what the units have alike by more than {100 * FAR:.0f} % in "
            f"{100 * fit.unlike[unlike]:.0f} % of the band"
        )
    where = "" if worst is None else f"; {worst[0]} lies {worst[1]:+.1f} standard deviations off"
    return f"its values are not those of the batch, p = {min(one.p_all, one.p_worst):.1g}{where}"


def physical(mean: Array, free: Sequence[Free], prior: Array) -> Array:
    """Return means (p,) that a model can have. The mean of a batch is an unbounded estimate: of a damping that the
    records hardly show it may come out below zero, and no model could be opened with it. Such a mean lies a twentieth
    of the way from the bound to the mean of the prior."""
    lo, hi = (np.array([getattr(p, end) for p in free]) for end in ("lo", "hi"))
    low, high = (np.where(np.isfinite(end), (1 - NEAR_BOUND) * end, 0.0) for end in (lo, hi))
    low, high = (np.where(np.isfinite(e), near + NEAR_BOUND * prior, e) for e, near in ((lo, low), (hi, high)))
    return np.clip(mean, low, high)
