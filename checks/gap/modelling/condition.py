"""One model under several conditions at once: what each changes of its parameters, and all of them fitted together.

Datasets of a condition carry its name behind their channels (`de@added_mass`), so that a fit of several datasets is the
joint fit: what a condition does not change has one value in all of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.shift import Shift

Values = Mapping[str, float]
AT = "@"
NOTHING: Mapping[str, float] = {}


@dataclass(frozen=True, eq=False)
class Together:
    """A response under a condition each. fixed: values of what is not fitted."""

    base: Augmented
    shifts: tuple[Shift, ...]
    fixed: Values = field(default_factory=dict)

    def free(self, start: Values = NOTHING) -> list[Free]:
        """Return all fitted parameters: the response's own, then those with a value of their own under a condition."""
        own = (p for s in self.shifts for p in s.free)
        return [*self.base.free(start), *(replace(p, start=start.get(p.name, p.start)) for p in own)]

    def frf(self, f: Array, changes: Values, channels: tuple[str, ...]) -> Complex:
        """Return the response (F, C)."""
        response, bare, values = self._under(changes, channels)
        return response.frf(f, values, bare)

    def jacobian(self, f: Array, names: Sequence[str], changes: Values, channels: tuple[str, ...]) -> Complex:
        """Return the derivatives (P, F, C) per unit of each name; zero for what has its own value under another
        condition."""
        response, bare, values = self._under(changes, channels)
        seen = [n for n in names if n in values]
        out = np.zeros((len(names), f.size, len(channels)), dtype=complex)
        out[[names.index(n) for n in seen]] = response.jacobian(f, seen, values, bare)
        return out

    @cached_property
    def _known(self) -> set[str]:
        return {p.name for p in self.base.free()}

    def _under(self, changes: Values, channels: tuple[str, ...]) -> tuple[Augmented, tuple[str, ...], Values]:
        """Return the response under the channels' condition, the channels' plain names, and the values that the
        response has."""
        condition = channels[0].partition(AT)[2]
        shift = next((s for s in self.shifts if s.name == condition), None)
        known = self._known | (set() if shift is None else shift.names)
        values = {n: v for n, v in {**self.fixed, **changes}.items() if n in known}
        bare = tuple(c.partition(AT)[0] for c in channels)
        return (self.base if shift is None else replace(self.base, shift=shift)), bare, values


def marked(data: Dataset, condition: str) -> Dataset:
    """Return a dataset with its condition appended to its channels' names."""
    return replace(data, channels=tuple(f"{c}{AT}{condition}" for c in data.channels))
