"""Values that a person typed or an instrument sent: no record behind them, so U is stated, never computed."""

from checks.cause import Cause
from checks.declare import Measured, Values
from checks.quantity import COVERAGE_FACTOR, Contribution, Quantity
from specs.spec import CheckSpec


def typed_quantity(values: Values, spec: CheckSpec, entry: str, quantity: str | None = None) -> Quantity:
    """Quantity of a typed entry. U: the one typed beside it, else the spec's for this entry, else unknown."""
    name = quantity or entry
    given: Measured | None = values.get(entry)
    if given is None:
        return Quantity.missing(name, Cause.NOT_MEASURED)
    if given.U is not None:
        return Quantity.of(name, given.value, Contribution("stated with the value", given.U / COVERAGE_FACTOR))
    stated = spec.uncertainty.get(entry)
    if stated is None:
        return Quantity(name, given.value)
    return Quantity.of(name, given.value, Contribution(stated.source, stated.at(given.value) / COVERAGE_FACTOR))
