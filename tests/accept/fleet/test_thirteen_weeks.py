"""The quarter again, by a generator that does not know the rules: every planted fault is found or below what can be
found, and quiet quarters are quiet."""

from collections import Counter
from functools import cache

import pytest

from accept.fleet.trend import Trend, trends
from tests.accept.fleet.stored_quarter import frame_of
from tests.accept.fleet.thirteen_weeks import DECIMALS, FAULTS, quarter
from tests.soak import SOAK

SEED = 1


@cache
def chart(quantity: str) -> Trend:
    return trends(frame_of(quarter(SEED, *FAULTS)), quantity, "all")[0]


def alarms(quantity: str, rule: str) -> dict[str, str]:
    """First serial -> evidence or place of the alarms of a rule."""
    made = chart(quantity)
    return {str(made.rows["serial"].iloc[a.first]): a.evidence or str(a.place) for a in made.alarms if a.rule == rule}


def test_the_constant_the_lot_and_the_two_suppliers_are_found():
    (equal,) = [a for a in chart("sensor_uF").alarms if a.rule == "equal"]
    assert (equal.units, equal.place) == (160, ("operator", "Ben"))
    assert ("bench", "LCR-2") in equal.same
    (lot,) = [a for a in chart("stroke_um").alarms if a.rule == "shift"]
    assert (lot.place, lot.units) == (("lot", "L02-S"), 30)
    assert lot.size == pytest.approx(-0.05 * 362.6, abs=1.5 * lot.U)
    for stack in ("sensor_uF", "actuator_uF"):
        assert alarms(stack, "two populations")


def test_the_coarse_meter_is_said_with_what_it_adds():
    for stack in ("sensor_uF", "actuator_uF"):
        assert any("G-78 shows steps of 0.01" in words and "0.0029" in words for words in chart(stack).why)


def test_each_exchange_of_digits_is_found_with_the_value_that_was_meant():
    drawn, typed = quarter(SEED, *FAULTS), quarter(SEED, *(f for f in FAULTS if f != "transposed"))
    right = {unit.serial: unit.values for unit in typed.units}
    for planted in drawn.planted["transposed"]:
        serial, quantity = planted.split()
        made = chart(quantity)
        evidence = [
            a.evidence for a in made.alarms if a.first == a.last and made.rows["serial"].iloc[a.first] == serial
        ]
        assert evidence, planted
        assert "with two digits exchanged" in evidence[0], (planted, right[serial][quantity], evidence)


def test_what_is_below_what_can_be_found():
    """An offset of LCR-2 of 0.3 %, 0.015 uF, is 0.1 sd of two mixed populations of stacks (0.13 uF): 260 values a meter
    know their difference to 0.011 uF (1 sd), and both stacks are read by one meter, so their ratio does not change. A
    drift of 1.5 % within 75 of 520 strokes of 1.1 %: 33 % of such charts find it, and three Mondays of the golden unit
    before it know its repeatability to 50 % (`test_self_starting`: none found; 99 % if measured each shift)."""
    assert not any(a.place and a.place[0] in ("bench", "instrument") for a in chart("actuator_uF").alarms)


def test_quiet_quarters_are_quiet():
    """Of five charts each rings in 2 % by values and shifts and in 2 % by equal values, as the docs state, so a quarter
    of five in at most 20 %, of 200 simulated in 15 %; two populations and contradicted values beside them in less than
    2 % of quarters."""
    count = 200 if SOAK else 8
    rang, beside = 0, Counter[str]()
    for seed in range(count):
        frame = frame_of(quarter(1000 + seed))
        found = [a.rule for name in DECIMALS for a in trends(frame, name, "all")[0].alarms]
        rang += bool(found)
        beside += Counter({rule for rule in found if rule in ("two populations", "unlike")})
    assert rang <= 0.2 * count + 3 * (0.16 * count) ** 0.5
    assert beside.total() <= 0.02 * count, beside
