"""A model with effects in it, as something that can be fitted: its own uncertain parameters and those of the
effects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.fit import free_of
from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.shift import AS_IT_IS, Shift
from checks.gap.modelling.unmodelled_modes import UnmodelledMode, is_path
from checks.model.model import Model
from checks.model.parameters import is_mode_factor
from checks.model.structure.attached import PlaceReceptances

Values = Mapping[str, float]
Held = tuple[tuple[str, float], ...]
PAYLOAD = "bench.payload_kg"
LEAST = 1e-3  # of a parameter's prior: a stiffness of nothing has no derivative
STEP = 1e-5  # of a parameter's scale: derivative of a stand-in


@dataclass(frozen=True, eq=False)
class Augmented:
    """Values by flat name: the model's own, and `effect.parameter` of every member. held: factors of the APA's modes
    that a search does not vary, with their values; shift: the condition at the bench."""

    model: Model
    members: tuple[Effect, ...] = ()
    held: Held = ()
    shift: Shift = AS_IT_IS

    def holding_scatter(self, at: Values | None = None) -> "Augmented":
        """Return the same with the factors of the APA's modes held at values, or at their priors."""
        names = [n for n in self.model.sds if is_mode_factor(n)]
        return replace(self, held=tuple((n, (at or {}).get(n, self.model.values[n])) for n in names))

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the members, in order."""
        return tuple(m.name for m in self.members)

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the labels of the members, for reports, without the paths of a bench."""
        return tuple(m.label for m in self.members if not is_path(m))

    @property
    def effects(self) -> tuple[Effect, ...]:
        return tuple(m for m in self.members if not m.stands_in)

    @property
    def unmodelled_modes(self) -> tuple[UnmodelledMode, ...]:
        return tuple(m for m in self.members if isinstance(m, UnmodelledMode) and m.counts and m.stands_in)

    @property
    def paths(self) -> tuple[UnmodelledMode, ...]:
        """Return the paths of a bench that is fitted too."""
        return tuple(m for m in self.members if is_path(m))

    @property
    def counted(self) -> tuple[Effect, ...]:
        """Return the members that mean that something is missing, unmodelled modes first."""
        return (*self.unmodelled_modes, *self.effects)

    def with_member(self, member: Effect) -> "Augmented":
        return replace(self, members=(*self.members, member), model=_attached(self.model, member))

    def without(self, *names: str) -> "Augmented":
        model = self.model
        for m in self.members:
            if m.name in names:
                model = _detached(model, m)
        return replace(self, members=tuple(m for m in self.members if m.name not in names), model=model)

    def free(self, start: Values | None = None) -> list[Free]:
        """Return all fitted parameters. An effect that stands for a calibrated parameter takes its place, without
        prior."""
        at = start or {}
        taken = {t for e in self.effects if not e.adds for t in e.stands_for(self.model)}
        taken |= {name for name, _ in self.held}
        base = [_beginning(p, at.get(p.name)) for p in _own(self.model) if p.name not in taken]
        added = []
        for m in self.members:
            for p in m.parameters:
                name = f"{m.name}.{p.name}"
                added.append(
                    Free(name, prior=0.0, sd=p.sd, lo=p.lo, hi=p.hi, start=at.get(name, p.start), scale=p.scale)
                )
        return [*base, *added]

    def own_values(self, at: Values) -> dict[str, float]:
        """Return the values of the fitted parameters, of those that are not given where they begin."""
        return {p.name: at.get(p.name, p.begin) for p in self.free()}

    def of(self, values: Values, member: str) -> dict[str, float]:
        """Return the values of one member, by its own parameter names."""
        prefix = f"{member}."
        return {k.removeprefix(prefix): v for k, v in values.items() if k.startswith(prefix)}

    def places(self, f: Array, values: Values, channels: tuple[str, ...]) -> PlaceReceptances:
        """Return what an element at any place of the model sees and changes."""
        found = self.model.place_receptances(f, self.changes(values), channels)
        return replace(found, seen=found.seen * self._factor(f, values, channels))

    def changes(self, values: Values) -> dict[str, float]:
        """Return the model's changes that the values amount to."""
        inside = self._stand_for
        own = dict(self.held) | {k: v for k, v in values.items() if k not in inside}
        for e in self.effects:
            for p in e.parameters:
                name = f"{e.name}.{p.name}"
                for target in inside[name]:
                    start = own.get(target, self.model.values[target]) if target in p.adds else 0.0
                    own[target] = start + values[name]
        return self.shift.applied(own, values, self.model.values)

    def payload(self, values: Values) -> float:
        """Return the payload [kg]."""
        return self.changes(values).get(PAYLOAD, self.model.values[PAYLOAD])

    def frf(self, f: Array, changes: Values, channels: tuple[str, ...]) -> Complex:
        """Return the response (F, C)."""
        return self._bare(f, self.changes(changes), channels) * self._factor(f, changes, channels)

    def jacobian(self, f: Array, names: Sequence[str], changes: Values, channels: tuple[str, ...]) -> Complex:
        """Return the derivatives (P, F, C) per unit of each name."""
        at = self.changes(changes)
        targets = [self._targets(n) for n in names]
        out = self._of_model(f, names, targets, at, channels)
        if not self._factors:
            return out
        s = np.asarray(2j * np.pi * f, dtype=np.complex128)
        own = [(m, columns_of(m, channels), evaluated(m, self.of(changes, m.name), s)) for m in self._factors]
        out *= _product(own, f.size, len(channels))
        H = self._bare(f, at, channels)
        for m, columns, _ in own:
            others = H * _product([o for o in own if o[0] is not m], f.size, len(channels))
            for p in m.parameters:
                if (n := f"{m.name}.{p.name}") in names:
                    change = slope(m, p, self.of(changes, m.name), s)
                    row = out[names.index(n)]
                    row[:] = 0.0
                    row[:, columns] = others[:, columns] * change[:, None]
        return out

    def _bare(self, f: Array, at: Values, channels: tuple[str, ...]) -> Complex:
        """Return the response (F, C) of the model at changes `at`; the array is read-only."""
        return _modelled(self.model, tuple(at.items()), f.tobytes(), channels)

    def _of_model(
        self,
        f: Array,
        names: Sequence[str],
        targets: Sequence[tuple[str, ...]],
        at: Values,
        channels: tuple[str, ...],
    ) -> Complex:
        """Return the derivatives (P, F, C) of the model's own response, zero for a name that does not act on it."""
        needed = list(dict.fromkeys(t for each in targets for t in each))
        slopes = np.zeros((len(names), len(needed)))
        for i, (name, each) in enumerate(zip(names, targets, strict=True)):
            for t in each:
                slopes[i, needed.index(t)] = self.shift.slope(name, t)
        if not needed:
            return np.zeros((len(names), f.size, len(channels)), dtype=complex)
        D = self.model.jacobian(f, needed, at, channels)
        if np.array_equal(slopes, np.eye(len(names), len(needed))) and len(names) == len(needed):
            return D
        out = np.zeros((len(names), len(channels), f.size), dtype=complex).swapaxes(1, 2)
        for i, j in np.argwhere(slopes):
            out[i] += slopes[i, j] * D[j]
        return out

    def _targets(self, name: str) -> tuple[str, ...]:
        return self._stand_for.get(name, (name,))

    @cached_property
    def _stand_for(self) -> dict[str, tuple[str, ...]]:
        """Return the model's parameters behind each name that is not the model's own; none for factors on channels."""
        out: dict[str, tuple[str, ...]] = {f"{m.name}.{p.name}": () for m in self._factors for p in m.parameters}
        out |= {f"{e.name}.{p.name}": p.targets(self.model) for e in self.effects for p in e.parameters}
        return out | {o.free.name: (o.target,) for o in self.shift.own}

    @cached_property
    def _factors(self) -> tuple[Effect, ...]:
        return tuple(m for m in self.members if m.factor is not None)

    def _factor(self, f: Array, values: Values, channels: tuple[str, ...]) -> Complex:
        s = np.asarray(2j * np.pi * f, dtype=np.complex128)
        own = [(m, columns_of(m, channels), evaluated(m, self.of(values, m.name), s)) for m in self._factors]
        return _product(own, f.size, len(channels))


def columns_of(member: Effect, channels: tuple[str, ...]) -> list[int]:
    """Return the places of a member's channels among those measured."""
    return [channels.index(c) for c in member.channels if c in channels]


def _product(own: Sequence[tuple[Effect, list[int], Complex]], bins: int, channels: int) -> Complex:
    """Return the product (F, C) of factors (F,) on their columns."""
    out = np.ones((bins, channels), dtype=complex)
    for _, columns, each in own:
        out[:, columns] *= each[:, None]
    return out


def slope(member: Effect, p: Parameter, values: Values, s: Complex) -> Complex:
    """Return the derivative (F,) of a member's factor by one of its parameters."""
    h, at = STEP * p.scale, values[p.name]
    up, down = min(h, max(p.hi - at, 0.0)), min(h, max(at - p.lo, 0.0))  # no step leaves the bounds
    above, below = (evaluated(member, {**values, p.name: at + d}, s) for d in (up, -down))
    return np.asarray((above - below) / (up + down))


@lru_cache(maxsize=16)
def _modelled(model: Model, at: tuple[tuple[str, float], ...], band: bytes, channels: tuple[str, ...]) -> Complex:
    """Return the model's own response. Cached, because a factor on a channel is tried with many values at one point of
    the model."""
    H = model.frf(np.frombuffer(band), dict(at), channels)
    H.setflags(write=False)
    return H


@lru_cache(maxsize=64)
def _attached(model: Model, member: Effect) -> Model:
    """Return the model with an element. Cached, as its matrices are by the model."""
    return member.attached_to(model)


@lru_cache(maxsize=64)
def _detached(model: Model, member: Effect) -> Model:
    return member.detached_from(model)


@lru_cache(maxsize=32)
def _own(model: Model) -> tuple[Free, ...]:
    """Return the model's own uncertain parameters. Cached, because a search asks for them at every start."""
    return tuple(_of_its_sign(p) for p in free_of(model))


def _beginning(p: Free, start: float | None) -> Free:
    return p if start is None else Free(p.name, p.prior, p.sd, p.lo, p.hi, start)


def _of_its_sign(p: Free) -> Free:
    """Return a parameter bounded to the sign of its prior: a constant that changed sign would undo a reversed
    polarity."""
    least = LEAST * p.prior
    if least > 0.0:
        return replace(p, lo=max(p.lo, least))
    return replace(p, hi=min(p.hi, least)) if least < 0.0 else p


def evaluated(member: Effect, values: Values, s: Complex) -> Complex:
    """Return the factor (F,) of a member. Raises ModelError if it has none, so that a search turns back: an effect may
    be another package's."""
    if member.factor is None:
        raise ModelError(f"effect '{member.name}' multiplies no channel")
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused below, in words
            out = np.asarray(member.factor(values, s), dtype=complex)
    except (ArithmeticError, LookupError, TypeError, ValueError) as e:
        raise ModelError(f"effect '{member.name}': its factor fails at {dict(values)} ({type(e).__name__}: {e})") from e
    if out.shape != s.shape or not np.isfinite(out).all():
        raise ModelError(f"effect '{member.name}': its factor is not finite at {dict(values)}")
    return out
