"""Results of a check: quantities, each with its expanded uncertainty and its budget."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from checks.cause import Cause, Reason, because
from specs.units import unit_of

if TYPE_CHECKING:  # pictures load numpy, and the event store, which holds quantities, opens without it
    from checks.picture import Panel

TWO_SIDED_95 = 1.96  # standard deviations to either side that hold 95 % of a normal distribution
COVERAGE_FACTOR = 2.0  # U = k u with k = 2 everywhere ([JCGM100] 6.3)


@dataclass(frozen=True)
class Contribution:
    """One standard uncertainty of a budget, in the quantity's unit. kind: "A" scatter, "B" stated ([JCGM100] 4)."""

    source: str
    u: float
    kind: str = "B"


@dataclass(frozen=True)
class Quantity:
    """Measured value in the unit that its name gives. U: expanded uncertainty (k = 2); None is unknown, which is not
    zero.

    A quantity without a value (`value` NaN) carries the reason; one with a value that must not pass, whatever its
    limits, the doubt: its U is then unknown."""

    name: str
    value: float
    U: float | None = None
    budget: tuple[Contribution, ...] = ()
    reason: Reason | None = None
    note: str | None = None
    doubt: Reason | None = None

    @property
    def unit(self) -> str:
        return unit_of(self.name)

    @classmethod
    def of(cls, name: str, value: float, *stated: Contribution | None, note: str | None = None) -> "Quantity":
        """Return the quantity whose U is twice the root sum of squares of its budget; unknown without a budget."""
        budget = tuple(c for c in stated if c is not None)
        U = COVERAGE_FACTOR * math.hypot(*(c.u for c in budget)) if budget else None
        return cls(name, float(value), U, budget, note=note)

    @classmethod
    def missing(cls, name: str, reason: Reason | Cause) -> "Quantity":
        return cls(name, math.nan, reason=because(reason) if isinstance(reason, Cause) else reason)

    def doubted(self, cause: Cause, **parameters: Any) -> "Quantity":
        """Return the value with an unknown uncertainty, so that it cannot pass; outside its limits it fails."""
        doubt = because(cause, **parameters)
        return replace(self, U=None, note=str(doubt), doubt=doubt)


@dataclass(frozen=True)
class Outcome:
    """Result of a check: quantities, remarks in words, and pictures as data."""

    quantities: tuple[Quantity, ...]
    notes: tuple[str, ...] = ()
    panels: "Mapping[str, Panel]" = field(default_factory=dict)
