"""The acceptance checks: one file each, one line here. Other packages add theirs under `accept.checks`."""

from dataclasses import dataclass, replace
from typing import Any

from checks.acceptance import (
    capacitance,
    flatness,
    hysteresis,
    misalignment,
    sensor_highpass,
    spurious_modes,
    stiffness,
    stroke,
)
from checks.acceptance.responses import check as frf
from checks.cause import Cause, NoResult
from checks.declare import Check, Values
from checks.quantity import Outcome, Quantity
from specs import plugins
from specs.spec import CheckSpec

RESERVED = ("serial", "kind", "parts", "channels", "measured", "notes", "experiments")  # of a unit.toml's own

CHECKS: dict[str, Check] = {
    check.name: check
    for check in (
        flatness.CHECK,
        capacitance.CHECK,
        stroke.CHECK,
        stiffness.CHECK,
        hysteresis.CHECK,
        sensor_highpass.CHECK,
        spurious_modes.CHECK,
        frf.CHECK,
        misalignment.CHECK,
    )
}


def check_problem(check: Any) -> str:
    """What is wrong with a check of another package, "" for nothing."""
    if not isinstance(check, Check):
        return f"is a {type(check).__name__}, expected a Check"
    if not check.name.isidentifier() or check.name in RESERVED:
        return f"a check cannot be called '{check.name}'"
    if check.section is not None and check.section not in CHECKS:
        return f"check '{check.name}' reads section '{check.section}', which there is not"
    if not (check.quantities and check.kinds and (check.forms or check.section)):
        return f"check '{check.name}' declares no quantities, kinds or forms"
    known = {q: own.name for own in CHECKS.values() for q in own.quantities}
    taken = [f"{q} (of {known[q]})" for q in check.quantities if q in known]
    return f"check '{check.name}' measures {', '.join(taken)}: one check per quantity" if taken else ""


@dataclass(frozen=True)
class Guarded:
    """The measurement of another package's check: what it hands back is looked at before it is judged."""

    check: Check

    def __call__(self, values: Values, spec: CheckSpec) -> Outcome:
        outcome, check = self.check.measure(values, spec), self.check
        sound = isinstance(outcome, Outcome) and all(isinstance(q, Quantity) for q in outcome.quantities)
        names = [q.name for q in outcome.quantities] if sound else []
        if sorted(names) != sorted(check.quantities):
            found = ", ".join(names) or repr(outcome)
            raise NoResult(Cause.PLUGIN_QUANTITIES, check=check.name, found=found, expected=", ".join(check.quantities))
        return outcome


_MORE: dict[str, Check] = plugins.plugins(plugins.CHECKS, check_problem, CHECKS)
CHECKS |= {name: replace(check, measure=Guarded(check)) for name, check in _MORE.items()}
