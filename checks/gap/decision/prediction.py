"""Predictions of an explanation under several conditions, and the differences that its parameters could make up for."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.gap.conditions.trial import ConditionTrial, together
from checks.gap.modelling.augmented import Values
from checks.gap.modelling.condition import Together
from checks.gap.modelling.effect import Effect
from checks.gap.search.explanation import Explanation
from checks.model.channel_paths import LATENCIES
from checks.model.model import Model
from checks.model.parameters import is_mode_factor


@dataclass(frozen=True, eq=False)
class Prediction:
    """free, at: the parameters and their values; H: responses (F, C) of each dataset; sets: the datasets, which weigh
    differences."""

    every: Together
    free: list[Free]
    at: Values
    H: list[Complex]
    sets: Sequence[Dataset]

    @classmethod
    def of(
        cls, c: Explanation, sets: Sequence[Dataset], trials: Sequence[ConditionTrial] = (), first: bool = False
    ) -> "Prediction":
        """Return the prediction of an explanation. first: whether its responses are those that weigh differences.
        Raises ModelError."""
        every = together(c.response, trials)
        free = every.free(c.at)
        at = {p.name: p.begin for p in free}
        H = [every.frf(d.f, at, d.channels) for d in sets]
        return cls(every, free, at, H, [replace(d, H=h) for d, h in zip(sets, H, strict=True)] if first else sets)

    @cached_property
    def rows(self) -> Array:
        """Return the whitened derivatives (n, p) by all parameters."""
        names = [p.name for p in self.free]
        return np.hstack([s.whitener(self.every.jacobian(s.f, names, self.at, s.channels)) for s in self.sets]).T

    def left(self, changes: Sequence[Complex], without: Collection[str] = ()) -> tuple[Mapping[str, float], float]:
        """Return what the parameters make up of changes (F, C) of the datasets, by name, and the squared length of the
        rest: twice the gain in log-likelihood to expect of the changes. without: parameters that are held."""
        kept = [i for i, p in enumerate(self.free) if p.name not in without]
        free = [self.free[i] for i in kept]
        limits = np.array([1.0 / p.sd if _is_limited(p.name, self.every.base.model) else 0.0 for p in free])
        d = np.concatenate([s.whitener(c) for s, c in zip(self.sets, changes, strict=True)])
        share, rest = shares(self.rows[:, kept], d, limits)
        return {p.name: float(x) for p, x in zip(free, share, strict=True)}, rest

    def imitated(self, effect: Effect) -> tuple[Mapping[str, float], float]:
        """Return the same of the change by an effect, with other values of calibrated parameters."""
        model = self.every.base.model
        own = {f"{effect.name}.{p.name}" for p in effect.parameters} | set(effect.stands_for(model))
        less = replace(self.every, base=self.every.base.without(effect.name))
        changes = []
        for s, H in zip(self.sets, self.H, strict=True):
            change = self._by_its_size(effect, model, s)
            changes.append(H - less.frf(s.f, self.at, s.channels) if change is None else change)
        return self.left(changes, own)

    def _by_its_size(self, effect: Effect, model: Model, data: Dataset) -> Complex | None:
        """Return the change (F, C) of a response by an effect in it: its derivatives times its size, because an exact
        imitation turns with the parameters. None if its size is unknown."""
        off = effect.off(model)
        if not all(np.isfinite(v) for v in off.values()):
            return None
        names = [f"{effect.name}.{n}" for n in off]
        away = np.array([self.at[name] - nothing for name, nothing in zip(names, off.values(), strict=True)])
        return np.asarray(np.tensordot(away, self.every.jacobian(data.f, names, self.at, data.channels), 1))


def _is_limited(name: str, model: Model) -> bool:
    """Return whether a parameter may imitate an effect only within its prior."""
    if name in LATENCIES.values():
        return model.learned is not None
    return is_mode_factor(name) or name.startswith("unnamed_path")


def shares(J: Array, d: Array, limits: Array) -> tuple[Array, float]:
    """Return the parts (p,) of d (n,) along the columns of J (n, p), in units of a column's length, and the squared
    length of the rest. limits (p,): of each column, one over the standard deviation of its prior, or 0."""
    J, d = np.vstack([J, np.diag(limits)]), np.concatenate([d, np.zeros(limits.size)])
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    share, *_ = np.linalg.lstsq(J / size, d, rcond=1e-9)
    rest = d - (J / size) @ share
    return share, float(rest @ rest)
