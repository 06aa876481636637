"""Values of a check: what a record shows, typed ones, and the uncertainties that a spec states for them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

from checks.cause import Cause, NoResult, Reason, because
from checks.declare import Measured, Values
from checks.errors import RecordError
from checks.quantity import COVERAGE_FACTOR, Contribution, Quantity
from checks.record import Record
from specs.spec import CheckSpec, StatedU

T = TypeVar("T")


def of_record(values: Values, key: str, measure: Callable[[Record], T]) -> T | Reason:
    """Return what a record shows, or the reason why it shows nothing."""
    if key not in values:
        return because(Cause.NOT_MEASURED, record=key)
    try:
        return measure(values[key])
    except (NoResult, RecordError) as e:
        return e.reason.within(key)
    except ValueError as e:
        return because(Cause.CANNOT_ESTIMATE, record=key, detail=str(e))


def typed_quantity(values: Values, spec: CheckSpec, entry: str, quantity: str | None = None) -> Quantity:
    """Return the quantity of a typed entry.

    U is the larger of the one given with the value, typed or by the instrument that was read, and the spec's for this
    entry, unknown without both. The operator does not choose the guard band: a typed U is no evidence that the
    instrument is better than the spec states."""
    name = quantity or entry
    given: Measured | None = values.get(entry)
    if given is None:
        return Quantity.missing(name, Cause.NOT_MEASURED)
    limit = spec.uncertainty.get(entry)
    floor = None if limit is None else limit.at(given.value)
    if given.U is not None and (floor is None or given.U >= floor):
        return Quantity.of(name, given.value, Contribution("stated with the value", given.U / COVERAGE_FACTOR))
    if limit is None or floor is None:
        return Quantity(name, given.value)
    note = None
    if given.U is not None:
        note = f"its own U (of the instrument, or typed), {given.U:.2g}, is below the spec's {floor:.2g}, which counts"
    return Quantity.of(name, given.value, Contribution(limit.source, floor / COVERAGE_FACTOR), note=note)


def stated_contribution(spec: CheckSpec, value: float, *names: str) -> Contribution | None:
    """Return the contribution, at this value, of the first name with an uncertainty in the spec; None without one."""
    found = next((spec.uncertainty[name] for name in names if name in spec.uncertainty), None)
    return None if found is None else Contribution(found.source, found.at(value) / COVERAGE_FACTOR)


def with_stated_accuracy(
    name: str, value: float, scatter: Sequence[Contribution], systematic: Contribution | None, note: str | None = None
) -> Quantity:
    """Return the quantity of a record. Scatter alone is not an uncertainty: U is unknown without a stated accuracy."""
    if systematic is None:
        return Quantity(name, float(value), None, tuple(scatter), note=note or "accuracy of the instrument not stated")
    return Quantity.of(name, value, *scatter, systematic, note=note)


def with_temperature(quantity: Quantity, stated: StatedU, temperature: Measured | None) -> Quantity:
    """Return a quantity with the influence of the temperature in its budget, if the spec gives its coefficient.

    The value is not corrected. Its distance from the reference temperature is the half-width of a rectangle ([JCGM100]
    F.2.4.5), added to the uncertainty of the temperature [°C]. U is unknown if either is not stated."""
    if stated.percent_per_C is None or not math.isfinite(quantity.value):
        return quantity
    if temperature is None or temperature.U is None:
        lacks = "the temperature is not stated" if temperature is None else "the temperature is stated without its U"
        return replace(quantity, U=None, note=f"{lacks}, so its influence is not known ([environment] temperature_C)")
    off = temperature.value - stated.reference_C
    source = f"temperature, {off:+.1f} °C from {stated.reference_C:g} °C at {stated.percent_per_C:g} %/°C"
    u_C = math.hypot(off / math.sqrt(3.0), temperature.U / COVERAGE_FACTOR)
    u = abs(quantity.value) * stated.percent_per_C / 100.0 * u_C
    U = None if quantity.U is None else math.hypot(quantity.U, COVERAGE_FACTOR * u)
    return replace(quantity, U=U, budget=(*quantity.budget, Contribution(source, u)))
