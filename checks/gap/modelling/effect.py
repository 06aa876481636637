"""What an explanation may consist of: an effect of the library, declared by its parameters, what it changes in the
model, where it shows, which experiment shows it separately and how it is simulated; an element of the mechanics
(`element`); or a filter that stands in for what has no name (`unmodelled_modes`). No other module knows an effect by
its name."""

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.gap.modelling.experiment import Experiment
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.model.model import Model
from checks.model.parameters import is_mechanical
from checks.model.time.partial_fractions import Fractions
from checks.rounding import rounded
from specs.units import DIMENSIONLESS, unit_of, without_unit

Values = Mapping[str, float]
AT_LEAST = 2  # channels of an effect that shows on several: on one alone it is any filter
NO_SLOW_LIMIT: Mapping[str, float] = {}


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect, in the unit that its name ends in ([DESIGN] 6).

    lo, hi: physical bounds, which no value leaves. off: the value at which the effect does nothing (NaN: the model's
    own). start: where a fit begins; scale: what counts as a step. sets, adds: the model's parameters that take the
    value, or the value on top of their own; what a model does not have is passed over. grid: values to begin from when
    the response is not even roughly linear in it (empty: it is, and zero is no effect; if zero is out of bounds, a fit
    begins at `start`). begins: where else a fit from the priors begins. limit_at: the value at which the
    detection limits of the others are stated. sd: of a prior about zero, infinite without one. label: what people call
    it, else the name without its unit ("dx", "damping ratio"); a name that is a unit alone needs one.
    """

    name: str
    _: KW_ONLY
    lo: float
    hi: float
    off: float = 0.0
    start: float = 0.0
    scale: float
    sets: tuple[str, ...] = ()
    adds: tuple[str, ...] = ()
    grid: tuple[float, ...] = ()
    begins: tuple[float, ...] = ()
    limit_at: float | None = None
    sd: float = math.inf
    label: str = ""

    @property
    def symbol(self) -> str:
        """Return its name for readers: "dx" for `dx_um`."""
        return self.label or without_unit(self.name).replace("_", " ")

    @property
    def unit(self) -> str:
        """Return the unit that its name ends in, "" for a pure number."""
        unit = unit_of(self.name)
        return "" if unit == DIMENSIONLESS else unit

    @property
    def linear(self) -> bool:
        """Return whether the response is roughly linear in it about zero: no grid is declared and zero is in bounds."""
        return not self.grid and self.lo <= 0.0 <= self.hi

    @property
    def places(self) -> tuple[float, ...]:
        """Return the values at which a search begins to look: the grid, or the start if zero is out of bounds."""
        return self.grid or (() if self.linear else (self.start,))

    def inside(self, value: float) -> float:
        """Return a value within the bounds."""
        return min(max(value, self.lo), self.hi)

    def targets(self, model: Model) -> tuple[str, ...]:
        """Return the model's parameters that take (or add) the value; empty if the model has no such parameter."""
        return tuple(n for n in (*self.sets, *self.adds) if n in model.values)


@dataclass(frozen=True)
class SlowFinding:
    """The finding of slow records on an effect: values and half-widths of their 95 % intervals by parameter, the gain
    in log-likelihood, and the chance of so much."""

    values: Values
    half_widths: Values
    delta_lnL: float
    p: float


@dataclass(frozen=True)
class SlowRecord:
    """The sign of an effect in slow sines. named: their finding, or None; limit: the smallest values that they would
    show; contradicts: why they contradict values that a search has found, or "". Each is empty by default."""

    named: Callable[[Slow, Thresholds], SlowFinding | None] = lambda *_: None
    limit: Callable[[Slow, Thresholds], Values] = lambda *_: NO_SLOW_LIMIT
    contradicts: Callable[[Slow, Values], str] = lambda *_: ""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One effect.

    does: what it does to the model, as a formula if it has one; channels: where it must show; sign: its mark in words;
    sentence: what it means, with the parameters' names in braces; below: the same if its one value is below zero, with
    its absolute value; earlier: sentences that it had before, which certificates state; sources: keys of its
    descriptions ("[STB] 3.1.6"); experiment: the measurement that shows it separately. How it enters the model, one of:
    its parameters' `sets` and `adds`; `turns`, parameters whose sign changes (it is then found before any search, on
    its channel); `factor`, (values, s (F,)) -> (F,) by which its channels are multiplied. None of these: responses do
    not show it. slow: how it is seen in slow records. How it is simulated in time, if it is not a parameter of the
    model: bends, (values, amplitude [V]) -> what the drive (N,) [V] becomes; path, values -> the filter in the path of
    each of its channels, whose response is `factor`. resembles: other causes whose responses are the same, in words: a
    model file can hold such an effect, and no search names it.
    lags: it is a delay of its channels if its corner lies far above the band."""

    name: str
    title: str
    does: str = ""
    parameters: tuple[Parameter, ...] = ()
    channels: tuple[str, ...]
    sign: str
    sentence: str
    below: str = ""
    earlier: tuple[str, ...] = ()
    sources: tuple[str, ...]
    experiment: Experiment
    resembles: str = ""
    lags: bool = False
    turns: tuple[str, ...] = ()
    factor: Callable[[Values, Complex], Complex] | None = None
    slow: SlowRecord = field(default_factory=SlowRecord)
    bends: Callable[[Values, float], Callable[[Array], Array]] | None = None
    path: Callable[[Values], Fractions] | None = None
    stands_in = False  # for what has no name: never claimed

    @property
    def label(self) -> str:
        """Return the effect as a list of explanations shows it."""
        return self.name

    def stands_for(self, model: Model) -> tuple[str, ...]:
        """Return the model's parameters behind all parameters of the effect."""
        return tuple(t for p in self.parameters for t in p.targets(model))

    @property
    def adds(self) -> bool:
        """Return whether its values are added to the model's."""
        return any(p.adds for p in self.parameters)

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """Return the parameters that say how large it is, which an explanation has to earn."""
        return self.parameters

    @property
    def in_signal_path(self) -> bool:
        """Return whether it acts on what is measured or driven, and not in the mechanics."""
        targets = [t for p in self.parameters for t in (*p.sets, *p.adds)]
        return bool(self.parameters) and not any(map(is_mechanical, targets))

    @property
    def rivals_elements(self) -> bool:
        """Return whether every element of the mechanics is tried in its place: it may imitate one."""
        return self.in_signal_path

    def is_lost_without(self, channel: str) -> bool:
        """Return whether it can be named, but only where this channel was measured."""
        few = channel in self.channels and len(self.channels) <= AT_LEAST
        return few and bool(self.in_model or self.factor) and not self.resembles

    @property
    def in_model(self) -> bool:
        """Return whether it acts by the model's parameters, so that a model can hold it."""
        return bool(self.turns) or any(p.sets or p.adds for p in self.parameters)

    def attached_to(self, model: Model) -> Model:
        """Return the model with what it attaches to it, at values that do nothing; an effect attaches nothing."""
        return model

    def detached_from(self, model: Model) -> Model:
        """Return the model without what it attaches."""
        return model

    def fits(self, model: Model) -> bool:
        """Return whether a search of responses can look for it in this model."""
        if not self.parameters or self.resembles:
            return False
        return self.factor is not None or all(p.targets(model) for p in self.parameters)

    def off(self, model: Model) -> dict[str, float]:
        """Return the values at which it leaves this model unchanged."""
        return {p.name: _off(p, model) for p in self.parameters}

    def say(self, values: Values, half_widths: Values) -> str:
        """Return the sentence with its numbers. half_widths: of their 95 % intervals."""
        turned = bool(self.below) and all(v < 0.0 for v in values.values())
        shown = {k: _short(abs(v) if turned else v, half_widths[k]) for k, v in values.items()}
        return (self.below if turned else self.sentence).format(**shown)

    def sentences(self, values: Values, half_widths: Values) -> set[str]:
        """Return the sentence with its numbers, and those that earlier programs wrote."""
        shown = {k: _short(v, half_widths[k]) for k, v in values.items()}
        return {self.say(values, half_widths), *(s.format(**shown) for s in (self.sentence, *self.earlier))}

    def checked(self, values: Values) -> None:
        """Raise ModelError if values are not those of its parameters."""
        expected = {p.name for p in self.parameters}
        if values.keys() != expected:
            raise ModelError(f"effect '{self.name}' is given with {_listed(values)}; expected {_listed(expected)}")

    def changes(self, model: Model, values: Values) -> dict[str, float]:
        """Return the changes of the model's values that it makes. Raises ModelError if the model cannot hold it."""
        self.checked(values)
        if self.turns:
            return {n: -model.values[n] for n in self._held(model, self.turns)}
        out = {}
        for p in self.parameters:
            for n in self._held(model, (*p.sets, *p.adds)):
                out[n] = float(values[p.name]) + (model.values[n] if n in p.adds else 0.0)
        return out

    def _held(self, model: Model, names: tuple[str, ...]) -> list[str]:
        held = [n for n in names if n in model.values]
        if not held:
            raise ModelError(
                f"effect '{self.name}' needs {' or '.join(names)}, which model '{model.name}' does not have"
            )
        return held


def _listed(names: Mapping[str, float] | set[str]) -> str:
    return ", ".join(sorted(names)) or "nothing"


def _off(p: Parameter, model: Model) -> float:
    """Return the value at which a parameter has no effect: for a calibrated parameter, the model's own value."""
    targets = p.targets(model)
    return model.values[targets[0]] if math.isnan(p.off) and targets else p.off


def _short(value: float, U: float) -> str:
    """Return a number with three digits, but no digit beyond the second one of its uncertainty ([JCGM100] 7.2.6)."""
    if math.isfinite(U) and U > 0.0:
        value = float(rounded(value, U))
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def spread(lo: float, hi: float, n: int) -> tuple[float, ...]:
    """Return n values equally spaced in their logarithm."""
    return tuple(lo * (hi / lo) ** (i / (n - 1)) for i in range(n))
