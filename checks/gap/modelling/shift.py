"""Changes of a model's parameters by a condition at the bench."""

from collections.abc import Mapping
from dataclasses import dataclass

from checks.fitting.coordinates import Free

Values = Mapping[str, float]


@dataclass(frozen=True)
class OwnValue:
    """A parameter of the model (target) that has a value of its own under a condition."""

    target: str
    free: Free


@dataclass(frozen=True)
class Shift:
    """A change of parameters by a condition. name: of the condition. adds, times: (parameter, number) on top of what it
    is without the condition."""

    name: str
    adds: tuple[tuple[str, float], ...] = ()
    times: tuple[tuple[str, float], ...] = ()
    own: tuple[OwnValue, ...] = ()

    @property
    def free(self) -> list[Free]:
        return [o.free for o in self.own]

    @property
    def names(self) -> set[str]:
        """Return the names of its own values."""
        return {o.free.name for o in self.own}

    def applied(self, changes: Values, values: Values, model: Values) -> dict[str, float]:
        """Return the changes of a model's values under the condition. changes: those without it; values: with those of
        its own parameters."""
        out = dict(changes)
        for target, more in self.adds:
            out[target] = out.get(target, model.get(target, 0.0)) + more
        for target, factor in self.times:
            out[target] = out.get(target, model[target]) * factor
        return out | {o.target: values[o.free.name] for o in self.own}

    def slope(self, name: str, target: str) -> float:
        """Return the derivative of the model's parameter `target` by the parameter `name` that stands for it."""
        if name in self.names:
            return 1.0
        if any(o.target == target for o in self.own):
            return 0.0
        return dict(self.times).get(target, 1.0)


AS_IT_IS = Shift("")
