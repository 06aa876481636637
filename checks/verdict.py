"""Verdicts that fail closed: a quantity against a limit under a decision rule.

Sources: [ISO14253-1] (guard bands), [JCGM106] (decision rules, 8; specific risk, 9.3).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated, Any

from pydantic import Field

from checks.cause import Cause, Reason, because, together
from checks.quantity import COVERAGE_FACTOR, Contribution, Quantity
from checks.rounding import rounded
from specs.spec import Limit
from specs.units import with_unit

# Simple acceptance relies on a U that is small beside the limits: a value inside then lies outside with at most this
# probability ([ILACG8] 4.2.1). A U as wide as the zone between two limits breaks that.
MOST_RISK = 0.5
# U is bounded beside the zone between two limits, as a share of half the zone, for every decision rule. A value that is
# compared as it is needs a small U: a third, as ISO/IEC 17025 laboratories ask of a test uncertainty ratio. Guarded
# acceptance takes U off the zone, so its risk is small anyway; at three quarters, a quarter of the zone is left to
# accept in, and with less it is chance that decides whether a value lies there.
LARGEST_U = {"guarded": 0.75, "simple": 1.0 / 3.0, "shared": 1.0 / 3.0}
# When a finding passes by each decision rule: the words of the certificate, the screens and docs/how-to/specs.md.
RULES = {
    "simple": "the value lies within the limits; near a limit the risk of a wrong decision is 50 % (JCGM 106, 8.2)",
    "guarded": "the whole interval value ± U lies within the limits (ISO 14253-1)",
    "shared": "the value lies within the limits and U is at most the U_max of the limit; near a limit the risk of a "
    "wrong decision is 50 %, shared by supplier and customer (JCGM 106, 8.2)",
}


class Verdict(StrEnum):
    """Verdict of a finding."""

    PASS = "pass"
    CONDITIONAL = "conditional"
    FAIL = "fail"
    NO_RESULT = "no_result"


class UnitVerdict(StrEnum):
    """Verdict of a whole unit."""

    ACCEPTED = "accepted"
    CONDITIONAL = "conditional"
    REJECTED = "rejected"
    INCOMPLETE = "incomplete"


@dataclass(frozen=True)
class UsedInput:
    """An input that decided a finding, beside the samples: a number, a setting, the source of a channel, a record.

    source: the file that states it; against: what spec or bench file state otherwise, None if nothing; told: what the
    spec states instead of the bench file that supports it."""

    name: str
    value: Any
    unit: str
    source: str
    U: float | None = None
    against: str | None = None
    told: Annotated[str | None, Field(exclude_if=lambda told: told is None)] = None


@dataclass(frozen=True)
class Finding:
    """One judged quantity. value, U: None if unknown; p_false_accept: see `probability_of_false_acceptance`.

    cause: why it did not pass; reason: its sentence, as it was when judged."""

    check: str
    quantity: str
    value: float | None
    unit: str
    U: float | None
    lower: float | None
    upper: float | None
    rule: str
    verdict: Verdict
    p_false_accept: float | None
    reason: str | None
    required: bool = True
    source: str = ""
    assumed: bool = False
    budget: tuple[Contribution, ...] = ()
    note: str | None = None
    cause: Reason | None = None
    inputs: Annotated[tuple[UsedInput, ...], Field(exclude_if=lambda inputs: not inputs)] = ()

    def weakened(self, why: Reason) -> "Finding":
        """Return the finding with this reason, conditional instead of a pass; one without a result is unchanged."""
        if self.verdict is Verdict.NO_RESULT:
            return self
        cause = together([*([] if self.cause is None else [self.cause]), why])
        verdict = Verdict.CONDITIONAL if self.verdict is Verdict.PASS else self.verdict
        return replace(self, verdict=verdict, reason=str(cause), cause=cause)

    def withheld(self, cause: Reason) -> "Finding":
        """Return the finding without a value and without a result, for this cause."""
        bare = replace(self, value=None, U=None, p_false_accept=None, budget=(), note=None)
        return replace(bare, verdict=Verdict.NO_RESULT, cause=cause, reason=str(cause))


def judge(check: str, quantity: Quantity, limit: Limit, required: bool = True) -> Finding:
    """Judge a quantity by its limit. A value that is not finite or not in the limit's unit gives no result; an unknown
    or infinite U never passes, whatever the rule."""
    verdict, cause = _decide(quantity, limit)
    usable = verdict is not Verdict.NO_RESULT
    U = quantity.U if quantity.U is not None and math.isfinite(quantity.U) else None
    risk = probability_of_false_acceptance(quantity.value, quantity.U, limit, verdict) if usable else None
    return Finding(
        check=check,
        quantity=quantity.name,
        value=quantity.value if math.isfinite(quantity.value) else None,
        unit=quantity.unit,
        U=U,
        lower=limit.lower,
        upper=limit.upper,
        rule=limit.rule,
        verdict=verdict,
        p_false_accept=risk,
        reason=None if cause is None else str(cause),
        required=required,
        source=limit.source,
        assumed=limit.assumed,
        budget=quantity.budget,
        note=quantity.note or _only_a_bound(quantity, limit, verdict),
        cause=cause,
    )


def _only_a_bound(quantity: Quantity, limit: Limit, verdict: Verdict) -> str | None:
    """Return a note if the value is at most its own U and has an upper limit only: it is then a bound."""
    value, U = quantity.value, quantity.U
    if verdict is not Verdict.PASS or limit.lower is not None or not U or U < abs(value):
        return None
    most = with_unit(f"{value + U:.2g}", quantity.name)
    return f"below what can be measured: at most {most}"


def _decide(quantity: Quantity, limit: Limit) -> tuple[Verdict, Reason | None]:
    value, U = quantity.value, quantity.U
    if quantity.reason is not None:
        return Verdict.NO_RESULT, quantity.reason
    if not math.isfinite(value):
        return Verdict.NO_RESULT, because(Cause.NOT_FINITE, value=str(value))
    if quantity.unit != limit.unit:
        return Verdict.NO_RESULT, because(Cause.WRONG_UNIT, unit=quantity.unit, expected=limit.unit)
    if U is not None and (math.isnan(U) or U < 0):
        return Verdict.NO_RESULT, because(Cause.U_INVALID, U=str(U))
    applied, reason = _apply_rule(value, math.inf if U is None else U, limit)
    if applied is Verdict.CONDITIONAL and U is None and quantity.doubt is not None:
        return applied, together([quantity.doubt, because(Cause.U_UNKNOWN)])
    return applied, reason


def _apply_rule(value: float, U: float, limit: Limit) -> tuple[Verdict, Reason | None]:
    lower, upper = limit.bounds
    inside = lower <= value <= upper
    outside = Verdict.FAIL, outside_reason(value, U, limit)
    if math.isinf(U):
        unknown = Verdict.CONDITIONAL, because(Cause.U_UNKNOWN)
        return unknown if inside else outside
    too_wide = Verdict.CONDITIONAL, because(Cause.U_BESIDE_ZONE, U=U, unit=limit.unit, most=largest_U(limit))
    if limit.rule == "guarded":
        if lower <= value - U and value + U <= upper:
            return too_wide if U > largest_U(limit) else (Verdict.PASS, None)
        if value + U < lower or value - U > upper:
            return outside
        return Verdict.CONDITIONAL, because(Cause.U_INCLUDES_LIMIT, value=value, U=U, unit=limit.unit)
    if not inside:
        return outside
    if U > largest_U(limit):
        return too_wide
    if limit.rule == "shared" and U > (limit.U_max or 0.0):
        return Verdict.CONDITIONAL, because(Cause.U_TOO_LARGE, U=U, unit=limit.unit, most=limit.U_max or 0.0)
    if probability_outside(value, U, limit) > MOST_RISK:
        return Verdict.CONDITIONAL, because(Cause.RISK_ABOVE_HALF, value=value, U=U, unit=limit.unit)
    return Verdict.PASS, None


def largest_U(limit: Limit) -> float:
    """Return the largest expanded uncertainty that a limit's decision rule allows: a share of half the zone between its
    limits, infinite for a limit that has one bound only."""
    lower, upper = limit.bounds
    return LARGEST_U[limit.rule] * (upper - lower) / 2.0


def outside_reason(value: float, U: float, limit: Limit) -> Reason:
    """Return the reason that names the limit which the value misses: the value as it stands beside its U, with further
    digits if it would look like the limit."""
    lower, upper = limit.bounds
    side, at = ("below the lower", lower) if value < lower else ("above the upper", upper)
    whole = f"{value:.6g}" if f"{value:.6g}" != f"{at:.6g}" else repr(float(value))
    short = rounded(value, U)
    shown = short if (float(short) - float(f"{at:g}")) * (value - at) > 0 else whole
    return because(Cause.OUTSIDE_LIMITS, value=whole, shown=shown, unit=limit.unit, side=side, limit=at)


def probability_outside(value: float, U: float, limit: Limit) -> float:
    """Return P(true value outside the limits): normal, mean `value`, standard deviation U / 2 ([JCGM106] 7.4)."""
    lower, upper = limit.bounds
    u = U / COVERAGE_FACTOR
    if u == 0.0:
        return float(not lower <= value <= upper)
    return min(1.0, _upper_tail((upper - value) / u) + _upper_tail((value - lower) / u))


def probability_of_false_acceptance(value: float, U: float | None, limit: Limit, verdict: Verdict) -> float | None:
    """Return the specific consumer's risk ([JCGM106] 9.3.2): P(true value of an accepted finding outside its limits).

    0 for a failed finding, which is not accepted; None if U is unknown."""
    if verdict is Verdict.FAIL:
        return 0.0
    if U is None or not math.isfinite(U):
        return None
    return probability_outside(value, U, limit)


def _upper_tail(z: float) -> float:
    """Return P(Z > z) of the standard normal; by erfc, so that a risk of 1e-12 is not rounded away."""
    return 0.5 * math.erfc(z / math.sqrt(2.0))


def unit_verdict(findings: Sequence[Finding], held: bool = False) -> UnitVerdict:
    """Return rejected if any finding failed, incomplete if any result is missing, and accepted only if all that is
    required passed. held: something that is no finding holds the unit, which is conditional at best."""
    verdicts = [f.verdict for f in findings]
    required = [f.verdict for f in findings if f.required]
    if Verdict.FAIL in verdicts:
        return UnitVerdict.REJECTED
    if Verdict.NO_RESULT in verdicts or not required:
        return UnitVerdict.INCOMPLETE
    if all(v is Verdict.PASS for v in required) and not held:
        return UnitVerdict.ACCEPTED
    return UnitVerdict.CONDITIONAL
