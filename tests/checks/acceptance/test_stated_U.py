"""Who types a value does not choose its guard band, and no decision rule accepts by a U as wide as the limits."""

import math

import numpy as np
import pytest

from accept.judging import spec_warnings
from checks.acceptance.common.typed_value import typed_quantity, with_temperature
from checks.acceptance.responses.gains import gain_quantities
from checks.declare import Measured
from checks.quantity import Contribution, Quantity
from checks.signals import Frf
from checks.verdict import MOST_RISK, Verdict, judge, largest_U, probability_outside
from specs.spec import Limit, Spec, StatedU, load, parse


@pytest.fixture(scope="module")
def spec() -> Spec:
    return load("apa-basic")  # capacitance: 0.5 percent, 4.4 uF at least, guarded


@pytest.mark.parametrize(
    ("given", "U"),
    [(Measured(5.0), 0.025), (Measured(5.0, 1e-6), 0.025), (Measured(5.0, 0.025), 0.025), (Measured(5.0, 0.1), 0.1)],
)
def test_the_U_of_the_spec_is_a_floor(spec: Spec, given: Measured, U: float) -> None:
    found = typed_quantity({"sensor_uF": given}, spec.checks["capacitance"], "sensor_uF")
    assert found.U == pytest.approx(U, rel=1e-12)
    assert (found.note is not None) == (given.U is not None and given.U < U)


def test_a_smaller_U_takes_no_unit_over_the_limit(spec: Spec) -> None:
    section = spec.checks["capacitance"]
    found = typed_quantity({"sensor_uF": Measured(4.4001, 1e-6)}, section, "sensor_uF")
    assert judge("capacitance", found, section.limits["sensor_uF"]).verdict is Verdict.CONDITIONAL


def limit(rule: str, lower: float | None, upper: float | None, U_max: float | None = None) -> Limit:
    return Limit(lower=lower, upper=upper, unit="um", rule=rule, source="x", U_max=U_max)


@pytest.mark.parametrize(
    ("rule", "value", "U", "verdict"),
    [
        ("simple", 5.0, 2.9, Verdict.CONDITIONAL),  # P(false) 0.49: no laboratory would sign it
        ("simple", 5.0, 0.33, Verdict.PASS),
        ("simple", 5.0, 0.34, Verdict.CONDITIONAL),
        ("shared", 5.0, 0.33, Verdict.PASS),
        ("shared", 5.0, 0.9, Verdict.CONDITIONAL),
        ("guarded", 5.0, 0.74, Verdict.PASS),  # the rule takes U off the zone: the risk is small
        ("guarded", 5.0, 0.76, Verdict.CONDITIONAL),  # it passes only where chance puts it in the middle of the zone
        ("guarded", 5.0, 1.1, Verdict.CONDITIONAL),
        ("guarded", 7.0, 0.9, Verdict.FAIL),
        ("simple", 7.0, 2.9, Verdict.FAIL),  # outside stays outside
    ],
)
def test_U_is_small_beside_the_zone(rule: str, value: float, U: float, verdict: Verdict) -> None:
    asked = limit(rule, 4.0, 6.0, 1e300 if rule == "shared" else None)
    found = judge("stroke", Quantity.of("stroke_um", value, Contribution("stated", U / 2)), asked)
    assert found.verdict is verdict
    if verdict is Verdict.PASS:
        assert probability_outside(value, U, asked) <= MOST_RISK


def test_one_limit_bounds_no_zone() -> None:
    assert largest_U(limit("simple", 4.0, None)) == math.inf


SPEC = """name = "n"
kind = "apa"
title = "t"
[checks.capacitance]
[checks.capacitance.limits.sensor_uF]
lower = 4.4
upper = 5.5
unit = "uF"
rule = "{rule}"
source = "x"
[checks.capacitance.uncertainty.sensor_uF]
U = {U}
source = "x"
"""


@pytest.mark.parametrize(
    ("rule", "U", "warned"),
    [("simple", 0.4, True), ("simple", 0.18, False), ("guarded", 0.4, False), ("guarded", 0.42, True)],
)
def test_a_spec_whose_U_leaves_every_verdict_open_is_warned_of(rule: str, U: float, warned: bool) -> None:
    found = spec_warnings(parse(SPEC.format(rule=rule, U=U).encode(), "n.toml"))
    assert [("uncertainty.sensor_uF" in line) for line in found] == [True] * warned


BY_TEMPERATURE = StatedU(U_percent=0.5, percent_per_C=0.4, reference_C=23.0, source="meter")


@pytest.mark.parametrize(("C", "U_C"), [(23.0, 0.5), (20.0, 0.5), (26.0, 2.0)])
def test_the_influence_of_the_temperature_is_in_the_budget(C: float, U_C: float) -> None:
    """The closed form: 0.4 % a degree of 5 uF, its distance a rectangle (/ sqrt 3), its own U at k = 2."""
    meter = Contribution("meter", 0.0125)
    found = with_temperature(Quantity.of("sensor_uF", 5.0, meter), BY_TEMPERATURE, Measured(C, U_C))
    u = 5.0 * 0.004 * math.hypot((C - 23.0) / math.sqrt(3.0), U_C / 2.0)
    assert found.value == 5.0  # not corrected
    assert [c.u for c in found.budget] == pytest.approx([0.0125, u], rel=1e-12)
    assert found.U == pytest.approx(2.0 * math.hypot(0.0125, u), rel=1e-12)


@pytest.mark.parametrize("temperature", [None, Measured(23.0)])
def test_an_unknown_temperature_is_an_unknown_U(temperature: Measured | None) -> None:
    found = with_temperature(Quantity.of("sensor_uF", 5.0, Contribution("meter", 0.0125)), BY_TEMPERATURE, temperature)
    assert found.U is None
    assert judge("capacitance", found, limit_uF()).verdict is not Verdict.PASS


def test_without_a_coefficient_nothing_changes() -> None:
    quantity = Quantity.of("sensor_uF", 5.0, Contribution("meter", 0.0125))
    assert with_temperature(quantity, StatedU(U_percent=0.5, source="meter"), None) is quantity


def limit_uF() -> Limit:
    return Limit(lower=4.4, upper=5.5, unit="uF", rule="guarded", source="x")


@pytest.mark.parametrize("share", [0.0, 0.13, 0.5])
@pytest.mark.parametrize("at", [1.08, 1.15])
def test_static_gain_beside_a_second_resonance_holds_whatever_its_share(share: float, at: float) -> None:
    """Two modes in closed form, without noise. Red before: of 200 units with a share of 0.13 178 were held."""
    f, first, second = np.arange(5.0, 60.0, 0.5), 95.0, 95.0 * at
    of_both = (1.0 - share) / (1.0 - (f / first) ** 2) + share / (1.0 - (f / second) ** 2)
    H = np.repeat(25e-6 * of_both[:, None], 3, axis=1).astype(complex)
    noise = np.broadcast_to(1e-24 * np.eye(3, dtype=complex), (f.size, 3, 3))
    frf = Frf(f, H, ("Vs", "de", "da"), "Va", np.ones(H.shape), noise, np.full(f.size, 20.0), (), "h1")
    given = load("apa").checks["frf"]
    for q in gain_quantities(frf, (first, second), given)[:2]:
        (from_share,) = [c.u for c in q.budget if "second resonance" in c.source]
        assert abs(q.value - 25.0) <= math.sqrt(3.0) * from_share * 1.05  # half the width of a rectangle; f^2 + f^4
        alone = {x.name: x for x in gain_quantities(frf, (first,), given)}[q.name]
        assert q.U > alone.U
