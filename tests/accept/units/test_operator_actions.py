"""Who sets up the bench: a person who is asked, the rig's clock, the stage of a simulated bench."""

import itertools
import re

import pytest

from accept.capture.operator_actions import Person, Player
from accept.capture.recipes import voltages, voltages_by_hand
from accept.judging import judge_unit, load_spec
from accept.store import open_store
from accept.units import unit_folder
from accept.workflow.capture import measure_folder
from accept.workflow.instruments.hardware import BenchInstrument
from hw.errors import Implausible
from hw.instruments import open_instrument
from hw.simulated import Stage
from tests.hw.instruments.simbench import new_unit, nobody, simulated_bench


def test_a_person_is_asked_in_words():
    asked = []
    person = Person(lambda words: asked.append(words) or "")
    person.probe(3, -16.0, -9.0)
    person.leads("actuator")
    person.drive("two_stacks")
    person.voltage(-18.5)
    assert asked == [
        "Put the probe on point 3 (x -16 mm, y -9 mm), then Enter: ",
        "Discharge the stacks and connect the meter to the two actuator stacks in parallel, then Enter: ",
        "Connect the amplifier to the two other stacks, zero the gauge, set -20 V, then Enter: ",
        "Set -18.5 V, then Enter: ",
    ]


def test_the_rig_plays_the_steps_and_only_the_start_is_asked(monkeypatch):
    now, asked = [100.0], []
    monkeypatch.setattr(
        "accept.capture.operator_actions.time.sleep", lambda seconds: now.__setitem__(0, now[0] + seconds)
    )
    player = Player(lambda words: asked.append(words) or "", dwell_s=2.0, settle_s=1.5, clock=lambda: now[0])
    player.drive("one_stack")
    moments = []
    for V in (-20.0, 0.0, 20.0):
        player.voltage(V)
        moments.append(now[0])
        now[0] += 0.3  # a reading
    assert moments == pytest.approx([101.5, 103.5, 105.5])
    now[0] = 107.6  # the reading of the step before took into this one, which counts as reached from 107.5
    with pytest.raises(Implausible, match="at which voltage"):
        player.voltage(40.0)
    assert len(asked) == 1


def test_a_stroke_set_by_hand_is_judged(tmp_path):
    """31 settings for each run; the words that a person reads drive the simulated stage."""
    with simulated_bench(tmp_path / "bench") as (simulated, bench):

        def obey(words: str) -> str:
            stage = simulated.stage.read()
            if found := re.match(r"Set (\S+) V", words):
                simulated.stage.write(Stage(stacks=stage.stacks, V=float(found[1])))
            else:
                simulated.stage.write(Stage(stacks="one_stack" if "one stack" in words else "two_stacks"))
            asked.append(words)
            return ""

        asked, folder, entry = [], new_unit(tmp_path / "U"), bench.instruments["gauge"]
        with open_store() as store:
            gauge = open_instrument("gauge", entry, nobody)
            measure_folder(folder, "stroke", BenchInstrument("gauge", gauge, entry), Person(obey), store, "T")
    assert len(asked) == 2 * (1 + 31)
    spec = load_spec("apa-basic")
    result = judge_unit(unit_folder.read(folder), spec)
    (stroke,) = (f for f in result.findings if f.quantity == "stroke_um")
    assert stroke.verdict == "pass"
    assert abs(stroke.value - 373.2) <= stroke.U
    widths = [i.value for i in result.information if i.quantity == "stroke_hysteresis_percent"]
    # three levels about mid-voltage over one cycle: half a percent of the stroke off the 10.5 % of a settled loop
    assert widths == pytest.approx([10.5], abs=0.5)


@pytest.mark.parametrize("steps", [voltages(), voltages_by_hand()])
def test_the_steps_run_through_the_range(steps):
    assert steps[0] == steps[-1] == min(steps) == -20.0
    assert max(steps) == 150.0
    assert max(abs(b - a) for a, b in itertools.pairwise(steps)) <= 30.0
