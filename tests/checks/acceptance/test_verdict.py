"""Verdicts fail closed, whatever the rule; the probability against its closed form."""

import math
from fractions import Fraction
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.stats import norm

from checks.acceptance import CHECKS
from checks.cause import Cause, NoResult
from checks.quantity import Contribution, Quantity
from checks.verdict import LARGEST_U, RULES, UnitVerdict, Verdict, judge, probability_outside, unit_verdict
from specs.spec import CheckSpec, Limit
from specs.units import unit_of

NAME, UNIT = "sensor_uF", "uF"
# every quantity that any check can return, with its check
QUANTITIES = [(check.name, name) for check in CHECKS.values() for name in check.quantities]
finite = st.floats(-1e6, 1e6)
uncertainties = st.one_of(st.none(), st.floats(0, 1e3))


@st.composite
def limits(draw: st.DrawFn, unit: str = UNIT) -> Limit:
    rule = draw(st.sampled_from(["simple", "guarded", "shared"]))
    a, b = sorted(draw(st.tuples(finite, finite).filter(lambda t: t[0] != t[1])))
    sides = draw(st.sampled_from(["both", "lower", "upper"]))
    U_max = draw(st.floats(1e-3, 1e3)) if rule == "shared" else None
    lower, upper = (a if sides != "upper" else None), (b if sides != "lower" else None)
    return Limit(lower=lower, upper=upper, unit=unit, rule=rule, source="test", U_max=U_max)


@st.composite
def cases(draw: st.DrawFn) -> tuple[Limit, float, float]:
    """A limit, a value and its U, the value mostly a few U from an edge: elsewhere no rule differs from another."""
    limit, U = draw(limits()), draw(st.floats(0, 1e3))
    edge = draw(st.sampled_from([x for x in (limit.lower, limit.upper) if x is not None]))
    return limit, draw(st.one_of(finite, st.floats(-3, 3).map(lambda k: edge + k * U))), U


@given(st.data(), st.sampled_from(QUANTITIES), st.floats(allow_nan=True, allow_infinity=True), uncertainties)
def test_every_quantity_of_every_check_under_every_rule(data: st.DataObject, of, value: float, U: float | None) -> None:
    """What does not lie wholly inside, with a known U and the right unit, never passes."""
    check, name = of
    limit = data.draw(limits(unit_of(name)))
    finding = judge(check, Quantity(name, value, U), limit)
    lower, upper = limit.bounds
    if finding.verdict is Verdict.PASS:
        assert U is not None
        assert lower <= value <= upper
    other = limit.model_copy(update={"unit": "furlong"})
    assert judge(check, Quantity(name, value, U), other).verdict is Verdict.NO_RESULT
    assert judge(check, Quantity.missing(name, "not measured"), limit).verdict is Verdict.NO_RESULT


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS)
def test_a_check_without_data_measures_nothing(check) -> None:
    """Nothing given: no result for each limited quantity, and never a value."""
    spec = CheckSpec(required=False)
    try:
        found = check.measure({}, spec).quantities
    except NoResult:
        return
    assert all(not math.isfinite(q.value) and q.reason for q in found)


def verdict_of(value: float, U: float | None, limit: Limit) -> Verdict:
    return judge("capacitance", Quantity(NAME, value, U), limit).verdict


@given(limits(), st.floats(allow_nan=True, allow_infinity=True), uncertainties, st.floats(0, 1e3))
def test_raising_U_never_makes_a_pass(limit: Limit, value: float, U: float | None, more: float) -> None:
    before = verdict_of(value, U, limit)
    if before is not Verdict.PASS:
        assert verdict_of(value, None if U is None else U + more, limit) is not Verdict.PASS
        assert verdict_of(value, None, limit) is not Verdict.PASS


@given(limits(), st.sampled_from([math.nan, math.inf, -math.inf]), uncertainties)
def test_what_is_not_a_number_is_no_result(limit: Limit, value: float, U: float | None) -> None:
    finding = judge("capacitance", Quantity(NAME, value, U), limit)
    assert finding.verdict is Verdict.NO_RESULT
    assert finding.reason
    assert finding.value is None


@given(limits(), finite, st.sampled_from([math.nan, -1.0, -math.inf]))
def test_an_uncertainty_that_cannot_be_is_no_result(limit: Limit, value: float, U: float) -> None:
    assert verdict_of(value, U, limit) is Verdict.NO_RESULT


@given(limits(), finite)
def test_unknown_or_infinite_uncertainty_never_passes(limit: Limit, value: float) -> None:
    assert verdict_of(value, None, limit) in {Verdict.CONDITIONAL, Verdict.FAIL}
    assert verdict_of(value, math.inf, limit) in {Verdict.CONDITIONAL, Verdict.FAIL}


@given(limits(), finite, st.floats(0, 1e3))
def test_a_quantity_of_another_unit_never_passes(limit: Limit, value: float, U: float) -> None:
    finding = judge("stroke", Quantity("stroke_um", value, U), limit)
    assert finding.verdict is Verdict.NO_RESULT
    assert "um" in str(finding.reason)


@given(limits(), finite, st.floats(0, 1e3))
def test_a_pass_lies_inside_and_a_fail_outside(limit: Limit, value: float, U: float) -> None:
    lower = -math.inf if limit.lower is None else limit.lower
    upper = math.inf if limit.upper is None else limit.upper
    verdict = verdict_of(value, U, limit)
    if verdict is Verdict.PASS:
        assert lower <= value <= upper
        if limit.rule == "guarded":
            assert lower <= value - U
            assert value + U <= upper
    if verdict is Verdict.FAIL:
        assert not lower <= value <= upper


@given(cases())
@example((Limit(lower=0.0, upper=0.5, unit="uF", rule="simple", source="test"), 0.0, 1.0))
def test_a_pass_keeps_the_margin_of_its_rule(case: tuple[Limit, float, float]) -> None:
    """And the other way round: exactly what keeps it passes. In fractions, so that no rounding is shared."""
    limit, value, U = case
    lower, upper = limit.bounds
    margin = Fraction(U) if limit.rule == "guarded" else Fraction(0)
    inside = (lower == -math.inf or Fraction(value) - margin >= Fraction(lower)) and (
        upper == math.inf or Fraction(value) + margin <= Fraction(upper)
    )
    allowed = inside and (limit.U_max is None or U <= limit.U_max)
    # without a margin, what is more likely outside two limits than between them does not pass either
    with np.errstate(over="ignore"):  # by a U that is hardly above zero
        risk = norm.cdf(lower, value, U / 2) + norm.sf(upper, value, U / 2) if margin == 0 and U > 0 else 0.0
    allowed = allowed and (limit.rule == "guarded" or risk <= 0.5)
    passes = verdict_of(value, U, limit) is Verdict.PASS
    # value ± U is rounded once before it is compared: the two may differ only where the edge is as near as that
    ends = value - U, value + U
    near = any(math.isclose(end, edge, rel_tol=1e-15, abs_tol=1e-300) for end in ends for edge in (lower, upper))
    assert passes == allowed or near or math.isclose(risk, 0.5, rel_tol=1e-9)  # risk is summed in another order


@given(cases())
def test_what_lies_outside_by_more_than_U_fails(case: tuple[Limit, float, float]) -> None:
    limit, value, U = case
    lower, upper = limit.bounds
    if value + U < lower or value - U > upper:
        assert verdict_of(value, U, limit) is Verdict.FAIL


@given(cases(), st.floats(0, 1e6))
def test_moving_further_out_never_helps(case: tuple[Limit, float, float], further: float) -> None:
    """Away from the middle of the limits a verdict only gets worse: pass, conditional, fail."""
    limit, value, U = case
    worse = {Verdict.PASS: 0, Verdict.CONDITIONAL: 1, Verdict.FAIL: 2}
    lower, upper = limit.bounds
    # with one limit only, out is towards it, from anywhere
    middle = -math.inf if math.isinf(lower) else math.inf if math.isinf(upper) else lower + (upper - lower) / 2
    out = 1.0 if value >= middle else -1.0
    before, after = verdict_of(value, U, limit), verdict_of(value + out * further, U, limit)
    assert worse[after] >= worse[before]


@given(cases(), st.floats(0, 1e3))
def test_enlarging_U_never_helps(case: tuple[Limit, float, float], more: float) -> None:
    """What fails under a guard band may become conditional, never a pass; a pass may be lost, never won."""
    limit, value, U = case
    before, after = verdict_of(value, U, limit), verdict_of(value, U + more, limit)
    assert before is Verdict.PASS or after is not Verdict.PASS
    if after is Verdict.FAIL:
        assert before is Verdict.FAIL


@given(cases(), st.floats(0, 1e3), st.floats(0, 1e3))
def test_narrower_limits_never_help(case: tuple[Limit, float, float], up: float, down: float) -> None:
    limit, value, U = case
    lower = None if limit.lower is None else limit.lower + up
    upper = None if limit.upper is None else limit.upper - down
    assume(lower is None or upper is None or lower < upper)
    if verdict_of(value, U, limit.model_copy(update={"lower": lower, "upper": upper})) is Verdict.PASS:
        assert verdict_of(value, U, limit) is Verdict.PASS


@given(finite, st.floats(1e-6, 1e3), finite, st.floats(1.0, 1e3))
def test_an_interval_wider_than_the_limits_never_passes_a_guard_band(
    lower: float, width: float, value: float, times: float
) -> None:
    limit = guarded(lower, lower + width)
    U = math.nextafter(times * (limit.upper - lower) / 2, math.inf) * (1 + 1e-9)  # 2 U is wider than what is allowed
    assert verdict_of(value, U, limit) is not Verdict.PASS


def guarded(lower: float | None = None, upper: float | None = None) -> Limit:
    return Limit(lower=lower, upper=upper, unit=UNIT, rule="guarded", source="test")


def test_values_are_compared_unrounded() -> None:
    just_above = math.nextafter(5.5, 6)  # prints as 5.5 with any sensible number of digits
    simple = Limit(upper=5.5, unit=UNIT, rule="simple", source="test")
    assert verdict_of(5.5, 0.1, simple) is Verdict.PASS
    finding = judge("capacitance", Quantity(NAME, just_above, 0.1), simple)
    assert finding.verdict is Verdict.FAIL
    assert repr(just_above) in str(finding.reason)


def test_guarded_zone_is_conditional_where_the_interval_crosses_the_limit() -> None:
    limit = guarded(4.4, 5.5)
    assert verdict_of(4.5, 0.05, limit) is Verdict.PASS
    assert verdict_of(4.44, 0.05, limit) is Verdict.CONDITIONAL
    assert verdict_of(4.36, 0.05, limit) is Verdict.CONDITIONAL
    assert verdict_of(4.30, 0.05, limit) is Verdict.FAIL


def test_simple_acceptance_ends_where_U_is_large_beside_the_zone() -> None:
    """A value in the middle of its zone, U as wide as the zone: P(outside) = 2 P(Z > 1) = 32 %; twice that, 62 %."""
    for rule, U_max in (("simple", None), ("shared", 5.0)):
        limit = Limit(lower=4.4, upper=5.6, unit=UNIT, rule=rule, source="test", U_max=U_max)
        assert verdict_of(5.0, 0.19, limit) is Verdict.PASS  # a third of half the zone is 0.2
        for U, risk in ((1.2, 2 * norm.sf(1.0)), (2.4, 2 * norm.sf(0.5))):
            finding = judge("capacitance", Quantity(NAME, 5.0, U), limit)
            assert finding.verdict is Verdict.CONDITIONAL
            assert finding.p_false_accept == pytest.approx(risk, rel=1e-9)
            assert finding.cause is not None
            assert finding.cause.cause is Cause.U_BESIDE_ZONE


@given(limits(), finite, st.floats(0, 1e3))
def test_nothing_passes_that_is_more_likely_outside(limit: Limit, value: float, U: float) -> None:
    if verdict_of(value, U, limit) is Verdict.PASS:
        assert probability_outside(value, U, limit) <= 0.5


@given(st.floats(-100, 100), st.floats(1e-3, 200), st.floats(-10, 200))
def test_of_a_value_below_its_U_a_pass_says_that_only_a_bound_is_known(value: float, U: float, upper: float) -> None:
    finding = judge("capacitance", Quantity(NAME, value, U), guarded(upper=upper))
    assert (finding.verdict is Verdict.PASS) == (value + U <= upper)
    assert (finding.note is not None) == (finding.verdict is Verdict.PASS and U >= abs(value))
    # limits about zero ask for values near zero
    assert judge("capacitance", Quantity(NAME, value, U), guarded(-1e3, 1e3)).note is None


def test_the_words_of_each_rule_stand_in_the_docs_as_on_page_and_screen() -> None:
    page = (Path(__file__).parents[3] / "docs/how-to/specs.md").read_text()
    assert set(RULES) == set(get_args(Limit.model_fields["rule"].annotation)) == set(LARGEST_U)
    for rule, words in RULES.items():
        assert f"| `{rule}` | {words} |" in page
    assert "at most the U_max" in RULES["shared"]  # what the rule compares: see the next test


def test_shared_risk_asks_for_a_small_uncertainty() -> None:
    limit = Limit(lower=4.4, upper=5.5, unit=UNIT, rule="shared", source="test", U_max=0.1)
    assert verdict_of(4.41, 0.1, limit) is Verdict.PASS
    assert verdict_of(4.41, 0.11, limit) is Verdict.CONDITIONAL


@given(st.floats(-10, 10), st.floats(1e-3, 10), st.floats(-10, 10), st.floats(0.01, 10))
def test_probability_against_the_normal_distribution(value: float, U: float, lower: float, width: float) -> None:
    limit = Limit(lower=lower, upper=lower + width, unit=UNIT, rule="simple", source="test")
    u = U / 2
    oracle = norm.cdf(lower, value, u) + norm.sf(lower + width, value, u)
    # both are erfc in double precision: 1e-12 leaves room for the argument's rounding
    assert probability_outside(value, U, limit) == pytest.approx(oracle, rel=1e-9, abs=1e-12)


def test_probability_at_the_guard_band() -> None:
    # a guarded pass at exactly one U from a single limit: P(Z > 2) = 0.02275 ([JCGM106] 9.3.2)
    finding = judge("capacitance", Quantity(NAME, 4.5, 0.1), guarded(lower=4.4))
    assert finding.verdict is Verdict.PASS
    assert finding.p_false_accept == pytest.approx(0.0227501319, rel=1e-8)


def test_a_small_risk_is_not_rounded_away() -> None:
    finding = judge("capacitance", Quantity(NAME, 5.0, 0.1), guarded(lower=4.4))
    assert finding.p_false_accept == pytest.approx(norm.sf(12.0), rel=1e-9)


def test_a_failed_or_missing_finding_is_not_accepted_at_all() -> None:
    assert judge("capacitance", Quantity(NAME, 1.72, 0.01), guarded(4.4, 5.5)).p_false_accept == 0.0
    assert judge("capacitance", Quantity.missing(NAME, "not measured"), guarded(4.4)).p_false_accept is None
    assert judge("capacitance", Quantity(NAME, 5.0), guarded(4.4)).p_false_accept is None


def test_budget_adds_in_squares() -> None:
    quantity = Quantity.of(NAME, 5.0, Contribution("meter", 0.03), Contribution("scatter", 0.04, "A"))
    assert quantity.U == pytest.approx(0.1, rel=1e-12)
    assert Quantity.of(NAME, 5.0).U is None


def findings_of(*verdicts: Verdict, required: bool = True) -> list:
    values = {Verdict.PASS: 5.0, Verdict.CONDITIONAL: 4.42, Verdict.FAIL: 1.0, Verdict.NO_RESULT: math.nan}
    found = [judge("capacitance", Quantity(NAME, values[v], 0.05), guarded(4.4, 5.5), required) for v in verdicts]
    assert [f.verdict for f in found] == list(verdicts)
    return found


def test_unit_verdicts() -> None:
    P, C, F, N = Verdict.PASS, Verdict.CONDITIONAL, Verdict.FAIL, Verdict.NO_RESULT
    assert unit_verdict(findings_of(P, P)) is UnitVerdict.ACCEPTED
    assert unit_verdict(findings_of(P, C)) is UnitVerdict.CONDITIONAL
    assert unit_verdict(findings_of(P, C, N)) is UnitVerdict.INCOMPLETE
    assert unit_verdict(findings_of(N, F, P)) is UnitVerdict.REJECTED
    assert unit_verdict([]) is UnitVerdict.INCOMPLETE
    # passes of what nobody requires accept nothing
    assert unit_verdict(findings_of(P, P, required=False)) is UnitVerdict.INCOMPLETE
    assert unit_verdict(findings_of(P) + findings_of(C, required=False)) is UnitVerdict.ACCEPTED
    assert unit_verdict(findings_of(P) + findings_of(F, required=False)) is UnitVerdict.REJECTED


@given(st.lists(st.sampled_from(list(Verdict))), st.lists(st.sampled_from(list(Verdict))))
def test_a_unit_is_accepted_only_when_every_required_finding_passes(a: list[Verdict], b: list[Verdict]) -> None:
    findings = findings_of(*a) + findings_of(*b, required=False)
    if unit_verdict(findings) is UnitVerdict.ACCEPTED:
        assert a
        assert set(a) == {Verdict.PASS}
        assert Verdict.FAIL not in b


@pytest.mark.parametrize(
    ("value", "U", "shown"),
    [
        (13.9338, 0.31, "13.93"),  # as it stands beside U
        (5.5004, 0.0, "5.5004"),
        (5.5000001, 0.0, "5.5000001"),
        (math.nextafter(5.5, 6.0), 0.0, repr(math.nextafter(5.5, 6.0))),
        (5.5004, math.inf, "5.5004"),
    ],
)
def test_a_value_is_named_with_the_digits_of_its_U_unless_it_would_look_like_the_limit(
    value: float, U: float, shown: str
):
    finding = judge("capacitance", Quantity(NAME, value, U), guarded(4.4, 5.5))
    assert finding.verdict is Verdict.FAIL
    assert finding.cause.parameters["shown"] == shown
    assert finding.value == value


def test_a_value_is_named_so_where_its_interval_includes_the_limit_too():
    finding = judge("capacitance", Quantity(NAME, 5.48766, 0.0314), guarded(4.4, 5.5))
    assert finding.verdict is Verdict.CONDITIONAL
    assert "5.488 ± 0.031 uF" in finding.reason
    assert finding.cause.parameters["value"] == 5.48766
