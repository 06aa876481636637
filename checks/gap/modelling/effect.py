"""What an effect of the library is: its parameters, where it shows, and how it enters the model."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from checks.arrays import Complex
from checks.model.effects import ADDS, SETS
from checks.model.model import Model

Values = Mapping[str, float]


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect, in the unit that its name says ([DESIGN] 6).

    lo, hi: physical bounds. off: the value at which the effect does nothing. start: where a fit begins; scale: what
    counts as a step. grid: values to begin from when the response is not even roughly linear in it (empty: it is).
    sd: of a prior about zero, where there is one.
    """

    name: str
    lo: float
    hi: float
    off: float
    start: float
    scale: float
    grid: tuple[float, ...] = ()
    sd: float = math.inf

    @property
    def linear(self) -> bool:
        return not self.grid


@dataclass(frozen=True)
class Effect:
    """One effect. channels: where it must show; sign: its mark in words; sentence: what it means, with the parameters'
    names in braces; record: "frf" where it shows in the responses, "slow" where only slow records tell, "sign" for what
    the checks before any search find. factor: (values, s (F,)) -> (F,) by which its channels are multiplied, for an
    effect that is no parameter of the model.

    alias: calibrated parameters of a model that say the same thing; then only their prior can tell."""

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    channels: tuple[str, ...]
    sign: str
    sentence: str
    record: str = "frf"
    alias: tuple[str, ...] = ()
    factor: Callable[[Values, Complex], Complex] | None = None

    def parameter(self, name: str) -> Parameter:
        return next(p for p in self.parameters if p.name == name)

    def targets(self, model: Model, parameter: str) -> tuple[str, ...]:
        """The model's parameters that take (or add) the value; empty where the model has no place for the effect."""
        table = SETS.get(self.name) or ADDS.get(self.name) or {}
        return tuple(n for n in table.get(parameter, ()) if n in model.values)

    @property
    def adds(self) -> bool:
        """Whether its values count from the model's."""
        return self.name in ADDS

    def fits(self, model: Model) -> bool:
        """Whether the model has a place for it."""
        if self.record != "frf":
            return False
        return self.factor is not None or all(self.targets(model, p.name) for p in self.parameters)

    def off(self, model: Model) -> dict[str, float]:
        """Values at which it does nothing to this model."""
        return {p.name: _off(self, p, model) for p in self.parameters}

    def say(self, values: Values, half_widths: Values) -> str:
        """The sentence with its numbers. half_widths: of their 95 % intervals."""
        return self.sentence.format(**{k: _short(v, half_widths[k]) for k, v in values.items()})


def _off(effect: Effect, p: Parameter, model: Model) -> float:
    """A parameter that is calibrated anyway does nothing at the model's own value."""
    targets = effect.targets(model, p.name)
    return model.values[targets[0]] if math.isnan(p.off) and targets else p.off


def _short(value: float, U: float) -> str:
    """Three digits, and none beyond the second one of its uncertainty (JCGM 100, 7.2.6)."""
    if math.isfinite(U) and U > 0.0:
        value = round(value, 1 - math.floor(math.log10(U))) + 0.0  # no "-0"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def spread(lo: float, hi: float, n: int) -> tuple[float, ...]:
    """n values equally spaced in their logarithm."""
    return tuple(lo * (hi / lo) ** (i / (n - 1)) for i in range(n))
