"""Results that a wrong payload on the bench would make fail: they are withheld until the unit was measured again.

A resonance below or above its limits is attributed to the payload only on clear evidence: the stiffness by the added
mass is within its own limits and contradicts that by resonance and payload in the same direction, while nothing else
contradicts the responses; or the gap analysis names the payload, and with its estimate of the payload the resonance
would be within its limits. A unit that is soft by both measurements, or fails by another quantity, stays rejected.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from accept.base.documents.results import Information, UnitRecord
from accept.judging.advice import concluded
from accept.judging.samples import section_read_by
from checks.cause import Cause, Reason, because
from checks.consistency import PAYLOAD, check_consistency
from checks.quantity import Quantity
from checks.verdict import Finding, Verdict

RESONANCE, BY_RESONANCE = "axial_resonance_Hz", "k_resonance_N_per_um"
ADDED_MASS = "bench.payload_kg"  # what an effect adds to if it is a mass on the bench
NARROW = 0.2  # of an interval over its upper end: one number suffices


def consistent(
    findings: Sequence[Finding], information: Iterable[Information], gap: Mapping[str, Any] | None
) -> Sequence[Finding]:
    """Return a unit's findings, without a result where they contradict each other or show an error of the bench."""
    known = {i.quantity: i.measured() for i in information}
    known |= {f.quantity: Quantity(f.quantity, f.value, f.U) for f in findings if f.value is not None}
    stiffness = known[BY_RESONANCE].value if BY_RESONANCE in known else math.nan
    return withhold_resonance(check_consistency(findings, known), stiffness, gap)


def without_bench_errors(result: UnitRecord) -> UnitRecord:
    """Return the result with a resonance that a wrong payload moved out of its limits set to no result; the same object
    if there is no clear evidence of a bench error."""
    stiffness = next((i.value for i in result.information if i.quantity == BY_RESONANCE), None)
    stiffness = math.nan if stiffness is None else stiffness
    findings = withhold_resonance(result.findings, stiffness, result.gap)
    if findings is result.findings:
        return result
    return concluded(replace(result, findings=tuple(findings)))


def withhold_resonance(
    findings: Sequence[Finding], stiffness: float, gap: Mapping[str, Any] | None
) -> Sequence[Finding]:
    """Return the findings with a resonance that a wrong payload moved out of its limits set to no result; the same
    object if there is no clear evidence of a bench error. stiffness: by resonance and payload [N/um]."""
    finding = next((f for f in findings if f.quantity == RESONANCE), None)
    if finding is None or finding.verdict is not Verdict.FAIL or finding.value is None:
        return findings
    stated = stiffness * 1e6 / (2 * math.pi * finding.value) ** 2  # the payload that the unit or the spec states [kg]
    more = _by_contradiction(finding, findings, stated) or _by_gap(finding, gap, stated)
    if more is None or not all(map(math.isfinite, more)):
        return findings
    reason = because(Cause.PAYLOAD_WRONG, value=finding.value, mass=_mass(*more), how="more" if more[0] > 0 else "less")
    return tuple(f.withheld(reason) if f is finding else f for f in findings)


def _by_contradiction(resonance: Finding, findings: Sequence[Finding], stated: float) -> tuple[float, float] | None:
    """Return the interval of mass beyond the stated [kg] that the stiffness by the added mass implies, or None."""
    contradictions = [r for r in _causes(resonance) if r.cause is Cause.CONTRADICTION]
    if [r.parameters["title"] for r in contradictions] != [PAYLOAD.title]:
        return None
    (found,) = contradictions
    by_mass = [f for f in findings if section_read_by(f.check) == "stiffness"]
    if any({r.cause for r in _causes(f)} != {Cause.CONTRADICTION} or f.verdict is Verdict.FAIL for f in by_mass):
        return None
    ratio, lo, hi = (float(found.parameters[name]) for name in ("ratio", "lo", "hi"))
    if ratio <= 0 or (ratio < lo) != _is_low(resonance):
        return None
    # The ratio is stated payload over true one, times what it is on a sound unit: lo to hi.
    return stated * (lo / ratio - 1), stated * (hi / ratio - 1)


def _by_gap(resonance: Finding, gap: Mapping[str, Any] | None, stated: float) -> tuple[float, float] | None:
    """Return the interval of the mass beyond the stated one [kg] that the gap analysis names."""
    if gap is None or resonance.value is None:
        return None
    from checks.gap import EFFECTS  # loads the library: only for a unit whose responses were searched

    of_payload = {name for name, effect in EFFECTS.items() if any(ADDED_MASS in p.adds for p in effect.parameters)}
    named = next((n for n in gap.get("named", []) if n["effect"] in of_payload), None)
    if named is None:
        return None
    lo, hi = _interval(named["parameters"])
    if not (lo > 0 if _is_low(resonance) else hi < 0) or not stated + lo > 0:
        return None
    with_it = [resonance.value * math.sqrt((stated + more) / stated) for more in (lo, hi)]
    lower = -math.inf if resonance.lower is None else resonance.lower
    upper = math.inf if resonance.upper is None else resonance.upper
    if max(with_it) < lower or min(with_it) > upper:  # it does not explain that the resonance is outside
        return None
    return lo, hi


def _mass(lo: float, hi: float) -> str:
    """Return a mass in words: one number if its interval is narrow [kg]."""
    least, most = sorted((abs(lo), abs(hi)))
    return f"{(least + most) / 2:.2g}" if most - least < NARROW * most else f"{least:.2g} to {most:.2g}"


def _interval(parameters: Mapping[str, Any]) -> tuple[float, float]:
    """Return the ends of the interval of the only parameter [kg], None if it is not an interval."""
    (value,) = parameters.values()
    lo, hi = (float(end) for end in value["ci95"])
    return (lo, hi) if math.isfinite(lo) and math.isfinite(hi) else (0.0, 0.0)


def _is_low(finding: Finding) -> bool:
    return finding.lower is not None and finding.value is not None and finding.value < finding.lower


def _causes(finding: Finding) -> list[Reason]:
    return [] if finding.cause is None else list(finding.cause.all())
