"""The interface of a fit: a model, or any object with responses and their derivatives at named values."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from checks.arrays import Array, Complex

Values = Mapping[str, float]
Channels = tuple[str, ...]


class Response(Protocol):
    """A `Model` is one. Values are changes by name, in the names' units; f (F,) [Hz]."""

    def frf(self, f: Array, changes: Values, channels: Channels) -> Complex:
        """Return the response (F, C)."""

    def jacobian(self, f: Array, names: Sequence[str], changes: Values, channels: Channels) -> Complex:
        """Return the derivatives (P, F, C) of the response by each name, per unit of that name."""
