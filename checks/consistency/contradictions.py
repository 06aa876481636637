"""Findings of two measurements of one thing, by different instruments, that contradict each other: neither can pass.

Which of the two is wrong cannot be seen from them, so both are without a result. A finding that fails by its own limits
fails as before: a contradiction does not improve a unit.

A relation is the range of the ratio of both on a sound unit, correctly measured. The bands are wide because a piezo
stack answers differently to a small and a large voltage, at 1 kHz and at 0.4 Hz, at once and after a second. Beyond
them, and beyond the expanded uncertainties, a record is of another unit, a scale, an amplifier or a payload differs
from its statement, or a stack is damaged. An open circuit that is softer than a closed one is found by the check of the
stiffness itself."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because, together
from checks.quantity import Quantity
from checks.verdict import Finding, Verdict
from specs.bench import AMPLIFIER_GAIN, STACK_V, STATIC_HZ
from specs.units import with_unit

Known = Mapping[str, Quantity]
"""Measured quantities of a unit by name, those with a value only."""


@dataclass(frozen=True)
class Relation:
    """Plausible range of a ratio: one over other, times `scale`, within lo to hi. one, other: quantities; sections: of
    `unit.toml`, whose data they come from; spared: quantities of these read by themselves; needs: of `scale`."""

    title: str
    one: str
    other: str
    sections: tuple[str, str]
    lo: float
    hi: float
    why: str
    scale: Callable[[Known], float] = lambda _: 1.0
    needs: tuple[str, ...] = ()
    spared: tuple[str, ...] = ()

    def ratio(self, known: Known) -> tuple[float, float] | None:
        """Return the ratio and its expanded uncertainty; None if a quantity was not measured. An unstated uncertainty
        counts as 0: the band is wide."""
        if any(name not in known for name in (self.one, self.other, *self.needs)):
            return None
        one, other = known[self.one], known[self.other]
        if other.value == 0.0:
            return None
        value = one.value / other.value * self.scale(known)
        return value, abs(value) * math.hypot(*(_relative_U(q) for q in (one, other)))

    def is_contradicted(self, known: Known) -> bool:
        """Return whether the two cannot both be right."""
        found = self.ratio(known)
        return found is not None and not self.lo - found[1] <= found[0] <= self.hi + found[1]


def _relative_U(quantity: Quantity) -> float:
    U = quantity.U if quantity.U is not None and math.isfinite(quantity.U) else 0.0
    return U / abs(quantity.value) if quantity.value else 0.0


def _static(known: Known) -> float:
    """Return the factor from a gain over 10 to 20 Hz to the static gain: that band is on the flank of the resonance."""
    f = known["axial_resonance_Hz"].value
    lo, hi = STATIC_HZ
    return 1.0 - (hi**3 - lo**3) / (hi - lo) / 3 / f**2


PAYLOAD = Relation(
    title="Stiffness by resonance and payload, over that by the added mass",
    one="k_resonance_N_per_um",
    other="k_closed_N_per_um",
    sections=("frf", "stiffness"),
    lo=0.9,
    hi=1.15,
    why="what moves of the unit itself adds 1 percent to the payload, creep takes 1 to 2 percent a decade of time off "
    "the stiffness, a large load a few more ([STB] 3.1.7, 3.2.1)",
)

RELATIONS = (
    Relation(
        title="Capacitance by the high-pass corner, over the LCR meter's",
        one="sensor_capacitance_implied_uF",
        other="sensor_uF",
        sections=("sensor_highpass", "capacitance"),
        lo=0.85,
        hi=1.35,
        why="[STB] 2.2, 3.1.9: 4.9 to 5.1 uF at 1 kHz, about 5 at the corner of 0.4 Hz; the permittivity of soft PZT "
        "grows by a few percent a decade towards low frequencies, and with the voltage ([DAMJANOVIC98])",
        spared=("actuator_uF",),
    ),
    Relation(
        title="Static gain of the frequency response, over the slope of the largest loop",
        one="gain_de_um_per_V",
        other="hysteresis_gain_um_per_V",
        sections=("frf", "hysteresis"),
        lo=0.55,
        hi=1.2,
        why="small signals move less than large ones, by up to a third ([STB] 4.2; Rayleigh's law, [BERTOTTI98])",
        scale=_static,
        needs=("axial_resonance_Hz",),
    ),
    Relation(
        title="Static gain of the frequency response, over that of the whole stroke",
        one="gain_de_um_per_V",
        other="stroke_um",
        sections=("frf", "stroke"),
        lo=0.55,
        hi=1.15,
        why="two of three stacks behind an amplifier of 20: 28.6 um per V by the stroke, 17.5 to 26.7 by small signals "
        "([STB] 2.3, 4.2)",
        # gain of two stacks [um per V at the DAC] over the stroke of three stacks [um] over their whole range
        scale=lambda known: _static(known) / AMPLIFIER_GAIN / (2 / 3) * (STACK_V[1] - STACK_V[0]),
        needs=("axial_resonance_Hz",),
    ),
    PAYLOAD,
)


def check_consistency(findings: Sequence[Finding], known: Known) -> list[Finding]:
    """Return the findings; those of measurements that contradict each other have no result."""
    checked = list(findings)
    for relation in RELATIONS:
        if relation.is_contradicted(known):
            reason = _reason(relation, known)
            read = [CHECKS[f.check].reads in relation.sections and f.quantity not in relation.spared for f in checked]
            checked = [_without_result(f, reason) if used else f for f, used in zip(checked, read, strict=True)]
    return checked


def _without_result(finding: Finding, reason: Reason) -> Finding:
    """Return the finding without a value, or, if it fails by its own limits, with the contradiction as a cause."""
    cause = reason if finding.cause is None else together([finding.cause, reason])
    if finding.verdict is Verdict.FAIL:
        return replace(finding, cause=cause, reason=str(cause))
    return finding.withheld(cause)


def _reason(relation: Relation, known: Known) -> Reason:
    one, other = known[relation.one], known[relation.other]
    ratio, U = relation.ratio(known) or (0.0, 0.0)
    return because(
        Cause.CONTRADICTION,
        title=relation.title,
        ratio=ratio,
        U=U,
        lo=relation.lo,
        hi=relation.hi,
        one=f"{one.name} = {one.value:.4g} {one.unit}",
        other=f"{other.name} = {other.value:.4g} {other.unit}",
        one_called=with_unit(f"{CHECKS.label_of(one.name)} = {one.value:.4g}", one.name),
        other_called=with_unit(f"{CHECKS.label_of(other.name)} = {other.value:.4g}", other.name),
    )
