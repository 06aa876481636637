"""What can be fitted: a model, or any function of named values."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from checks.arrays import Array, Complex

Values = Mapping[str, float]
Channels = tuple[str, ...]


class Response(Protocol):
    """A `Model` is one. Values are changes by name, in the names' units; f (F,) [Hz]."""

    def frf(self, f: Array, changes: Values, channels: Channels) -> Complex:
        """(F, C)."""

    def jacobian(self, f: Array, names: Sequence[str], changes: Values, channels: Channels) -> Complex:
        """(P, F, C) derivatives per unit of each name."""


@dataclass(frozen=True)
class FunctionResponse:
    """A response from a plain function call(values, f, channels) -> (F, C); derivatives by central differences of the
    given steps, by name, in the name's unit."""

    call: Callable[[Values, Array, Channels], Complex]
    steps: Mapping[str, float]

    def frf(self, f: Array, changes: Values, channels: Channels) -> Complex:
        return self.call(changes, f, channels)

    def jacobian(self, f: Array, names: Sequence[str], changes: Values, channels: Channels) -> Complex:
        return np.array([self._derivative(f, name, changes, channels) for name in names])

    def _derivative(self, f: Array, name: str, changes: Values, channels: Channels) -> Complex:
        h = self.steps[name]
        above, below = (self.call({**changes, name: changes[name] + d}, f, channels) for d in (h, -h))
        return (above - below) / (2.0 * h)
