"""The quarter again, by a generator that does not know the rules: every planted fault is found or below what can be
found, and quiet quarters are quiet."""

from functools import cache

import numpy as np
import pytest

from accept.fleet.process_control.control_chart import FALSE_ALARM, Alarm
from accept.fleet.process_control.self_starting import part_chart
from accept.fleet.rings import GOLDEN, shared_chance
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


def test_what_is_planted_rings_and_is_not_only_to_be_watched():
    """At the chance that all charts of the page share: constant, lot, two suppliers, each exchange of digits."""
    rang = {(a.rule, a.place) for name in DECIMALS for a in chart(name).alarms if a.rings}
    assert {("equal", ("operator", "Ben")), ("shift", ("lot", "L02-S")), ("two populations", None)} <= rang
    typed = {planted.split()[0] for planted in quarter(SEED, *FAULTS).planted["transposed"]}
    single = {
        str(chart(name).rows["serial"].iloc[a.first])
        for name in DECIMALS
        for a in chart(name).alarms
        if a.rings and a.first == a.last
    }
    assert typed <= single


def test_the_values_of_two_suppliers_are_those_that_were_drawn():
    """4.851 and 5.101 uF; 260 values with a standard deviation of 0.036 uF know each mean to 0.003 uF: 4 sd."""
    made = trends(frame_of(quarter(SEED, "two_stacks")), "sensor_uF", "all")[0]
    (words,) = [a.evidence for a in made.alarms if a.rule == "two populations"]
    low, high = (float(word) for word in words.split("populations, ")[1].split(" um")[0].split(" and "))
    assert (low, high) == (pytest.approx(4.851, abs=0.012), pytest.approx(5.101, abs=0.012))


def offset_of(faults: tuple[str, ...], seed: int) -> Alarm | None:
    """The offset of LCR-2 that rings in either of the stacks that it reads."""
    frame = frame_of(quarter(seed, *faults))
    found = [a for name in ("sensor_uF", "actuator_uF") for a in trends(frame, name, "all")[0].alarms]
    return next((a for a in found if a.rule == "offset" and a.rings), None)


def test_the_offset_of_the_second_meter_is_found_with_its_size():
    """0.3 % of 4.95 uF, 0.43 standard deviations of the stacks; also where two suppliers widen them to 0.13 uF. Of 100
    quarters it is found in 97 and 99 %, and rings in 90 and 88 %: of 8, 5 is 2.4 sd below."""
    for faults in (("offset",), ("offset", "coarse", "two_stacks")):
        found = [alarm for seed in range(8) if (alarm := offset_of(faults, seed))]
        assert len(found) >= 5
        for alarm in found:
            assert ("bench", "LCR-2") in (alarm.place, *alarm.same)
            assert alarm.size == pytest.approx(0.003 * (4.95 if alarm.size < 0.022 else 9.9), abs=1.5 * alarm.U)


def test_what_is_below_what_can_be_found():
    """A drift of 1.5 % within 75 of 520 strokes of 1.1 %: 33 % of such charts find it. The golden unit on Mondays,
    three times before it, finds it in 33 of 100 quarters and rings in 11 (99 and 98 if measured each shift)."""
    found = [
        [part_chart(np.array([values["stroke_um"] for _, values in quarter(seed, "drift").golden]), chance).alarms
         for chance in (FALSE_ALARM / 5, shared_chance(GOLDEN, 5))]
        for seed in range(100)
    ]  # fmt: skip
    own, ring = (sum(bool(alarms[level]) for alarms in found) for level in (0, 1))
    assert 19 <= own <= 47  # 3 sd of a count of 33
    assert 2 <= ring <= 20


def test_quiet_quarters_are_quiet():
    """At most 2 % of quarters ring, all charts and alarms together; of 400 that no limit was tuned to one did, and of
    the golden charts one. What is to be watched is in at most 23 %: of five charts 2 % by values and shifts, 2 % by
    equal values and 0.5 % by offsets, and 3 sd of 200."""
    count = 200 if SOAK else 8
    rang, watched = 0, 0
    for seed in range(count):
        drawn = quarter(1000 + seed)
        frame = frame_of(drawn)
        rings = [a.rings for name in DECIMALS for a in trends(frame, name, "all")[0].alarms]
        goldens = (np.array([values[name] for _, values in drawn.golden]) for name in DECIMALS)
        rings += [True for x in goldens if part_chart(x, shared_chance(GOLDEN, len(DECIMALS))).alarms]
        rang += any(rings)
        watched += bool(rings)
    assert rang <= 0.02 * count
    assert watched <= 0.23 * count + 3 * (0.18 * count) ** 0.5
