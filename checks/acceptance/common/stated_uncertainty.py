"""What a spec states about the accuracy behind a record, as a line of the budget."""

from collections.abc import Sequence

from checks.quantity import COVERAGE_FACTOR, Contribution, Quantity
from specs.spec import CheckSpec


def stated(spec: CheckSpec, value: float, *names: str) -> Contribution | None:
    """Contribution of the first of these names whose uncertainty the spec states, at this value; else None."""
    found = next((spec.uncertainty[name] for name in names if name in spec.uncertainty), None)
    return None if found is None else Contribution(found.source, found.at(value) / COVERAGE_FACTOR)


def with_stated(
    name: str, value: float, scatter: Sequence[Contribution], systematic: Contribution | None, note: str | None = None
) -> Quantity:
    """Quantity of a record: scatter alone is no uncertainty, so without a stated accuracy U stays unknown."""
    if systematic is None:
        return Quantity(name, float(value), None, tuple(scatter), note=note or "accuracy of the instrument not stated")
    return Quantity.of(name, value, *scatter, systematic, note=note)
