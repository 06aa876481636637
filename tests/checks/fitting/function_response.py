"""Something to fit that is no model: a plain function of named values."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.response import Channels, Values


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
