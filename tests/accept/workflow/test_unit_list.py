"""What the units of a bench wait for: a step, the rig, a signature; one after the other, without a screen."""

import pytest

from accept.base.home import home
from accept.certificate.trust import keys
from accept.judging import default_specs, load_spec
from accept.store import Store, open_store
from accept.workflow import certify
from accept.workflow.entry.shift import IDLE_S, SHIFT_S, SigningShift
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.steps.unit_list import ALL, HELD, RIG, SIGN, Queue, known_units, queues, rig_steps
from accept.workflow.worker.judging import judge_step, judge_whole_unit
from checks.declare import Measured
from specs.spec import Spec

SPEC = load_spec("apa-basic")
SPECS = {"apa": SPEC}
VALUES = {
    "capacitance": (("sensor_uF", 4.99), ("actuator_uF", 9.85)),
    "stroke": (("stroke_um", 365.5),),
    "stiffness": (("k_N_per_um", 1.75),),
}


@pytest.fixture
def store():
    with open_store() as opened:
        yield opened


def unit(store: Store, serial: str, *steps: str, who: str = "Ann", spec: Spec = SPEC) -> Session:
    """A unit with values of some steps; it is closed."""
    session = open_session(store, home(), spec, who, serial)
    if session.run.attempt is None:
        session.begin({})
    if "flatness" in steps:
        heights = session.step("flatness").check.inputs["z_um"]
        for index in range(8):
            session.entries.take("flatness", heights, Measured(0.5 * index), index=index)
    for step in set(steps) & set(VALUES):
        for name, value in VALUES[step]:
            session.entries.take(step, session.step(step).check.inputs[name], Measured(value))
    session.close()
    return session


def named(store: Store, specs=SPECS) -> dict[str, list[str]]:
    found = queues(known_units(store, specs), specs)
    return {queue.name: [unit.serial for unit in queue.units] for queue in found}


def test_each_step_has_the_units_that_wait_for_it_those_begun_first_on_top(store: Store):
    unit(store, "APA-03")
    unit(store, "APA-01", "capacitance")
    unit(store, "APA-02", *VALUES, "flatness")
    assert named(store) == {
        ALL: ["APA-02", "APA-01", "APA-03"],
        SIGN: ["APA-02"],
        RIG: ["APA-03", "APA-01"],
        "flatness": ["APA-03", "APA-01"],
        "capacitance": ["APA-03"],
        "stroke": ["APA-03", "APA-01"],
        "stiffness": ["APA-03", "APA-01"],
    }


def test_the_rig_is_needed_for_records_and_not_for_meters(store: Store):
    unit(store, "APA-01", spec=load_spec("apa"))
    (found,) = known_units(store, {"apa": load_spec("apa")})
    waiting = rig_steps(found, {"apa": load_spec("apa")})
    assert {"stroke", "frf"} <= set(waiting)
    assert not {"flatness", "capacitance"} & set(waiting)


def test_the_next_unit_is_the_one_behind_this_one_then_the_first(store: Store):
    begun = ["APA-01", "APA-02", "APA-03"]
    for serial in begun:
        unit(store, serial)

    def after(serial: str) -> str | None:
        queue = Queue("capacitance", "apa", "Capacitance", ()).renewed(known_units(store, SPECS), SPECS)
        return getattr(queue.after(serial, begun), "serial", None)

    assert [after(serial) for serial in ("APA-01", "APA-03")] == ["APA-02", "APA-01"]
    unit(store, "APA-02", "capacitance")  # measured first: the one behind it comes next, not the top again
    assert after("APA-02") == "APA-03"
    unit(store, "APA-01", "capacitance")
    assert after("APA-02") == "APA-03"
    assert after("APA-03") is None


def test_units_of_all_kinds_say_state_who_and_when(store: Store):
    specs = {spec.kind: spec for spec in default_specs()}
    unit(store, "APA-01", "capacitance", spec=specs["apa"])
    unit(store, "ST-01", spec=specs["strut"])
    session = open_session(store, home(), specs["apa"], "Bob", "APA-01")
    session.entries.note("flatness", "flexure cracked", nonconformance=True)
    session.close()
    strut, apa = known_units(store, specs)
    assert (strut.kind, apa.kind) == ("strut", "apa")
    assert (apa.begun_by, apa.last_by) == ("Ann", "Bob")
    assert apa.begun < strut.begun < apa.last_at
    assert apa.state == f"held, 1 of {apa.steps} steps"
    assert {queue.kind for queue in queues([strut, apa], specs) if queue.name == "stroke"} == {"apa"}


def test_what_is_signed_waits_for_nothing(store: Store):
    certify.trust.init(home(), "correct horse", "Ann")
    unit(store, "APA-01", *VALUES, "flatness")
    session = open_session(store, home(), SPEC, "Ann", "APA-01")
    judge_whole_unit(session)
    assert known_units(store, SPECS)[0].state == "accepted, to sign"
    assert certify.Signing(session).sign("correct horse").valid
    assert known_units(store, SPECS)[0].state == "accepted, signed"
    assert named(store) == {ALL: ["APA-01"]}
    session.close()
    assert keys.exist(home())


def test_a_passphrase_is_kept_for_its_person_and_for_a_shift_and_not_while_the_bench_is_left():
    now = 0.0
    shift = SigningShift(lambda: now)
    assert shift.passphrase("Ann") is None
    shift.keep("Ann", "correct horse")
    assert shift.passphrase("Ann") == "correct horse"
    assert shift.passphrase("Bob") is None
    while now < SHIFT_S - IDLE_S:
        now += IDLE_S - 1
        shift.touch()
    assert shift.passphrase("Ann") == "correct horse"
    shift.keep("Ann", "correct horse")  # signing again makes no shift longer
    now = SHIFT_S + 1
    assert shift.passphrase("Ann") is None
    shift.keep("Ann", "correct horse")
    now += IDLE_S + 1
    shift.touch()  # a key that comes too late opens nothing
    assert shift.passphrase("Ann") is None
    shift.keep("Ann", "correct horse")
    assert shift.lock()
    assert shift.passphrase("Ann") is None


def test_a_unit_has_a_mark_per_step_what_was_found_and_who_entered_what_last(store: Store):
    session = unit(store, "APA-01", "flatness", "capacitance")
    (found,) = known_units(store, SPECS)
    assert [mark for mark, *_ in found.marks] == ["○", "○", "◉", "·"]
    assert (found.state, found.findings) == ("in Stroke", ())
    session = open_session(store, home(), SPEC, "Bob", "APA-01")
    judge_step(session, "capacitance")
    session.entries.note("flatness", "flexure cracked", nonconformance=True)
    session.close()
    (found,) = known_units(store, SPECS)
    assert [mark for mark, *_ in found.marks] == ["!", "✓", "◉", "·"]
    assert [finding.quantity for finding in found.findings] == ["sensor_uF", "actuator_uF"]
    assert (found.held_by, found.note, found.last_by, found.entered_by) == ("flexure cracked",) * 2 + ("Bob", "Ann")
    assert found.waits_for_qa
    unit(store, "APA-02")
    assert [mark for mark, *_ in known_units(store, SPECS)[0].marks] == ["·"] * 4
    assert known_units(store, SPECS)[0].state == "new"


def test_what_a_nonconformance_holds_waits_for_quality_assurance(store: Store):
    unit(store, "APA-01")
    session = open_session(store, home(), SPEC, "Ann", "APA-01")
    session.entries.note("stroke", "a wire is loose", nonconformance=True)
    session.close()
    unit(store, "APA-02")
    assert named(store)[HELD] == ["APA-01"]


@pytest.mark.parametrize(("stroke", "waits"), [(365.5, []), (250.0, ["APA-01"])])
def test_a_signed_unit_that_is_not_accepted_waits_for_quality_assurance(store: Store, stroke: float, waits: list[str]):
    """Red before: what was set aside for quality assurance was in none of the lists."""
    certify.trust.init(home(), "correct horse", "Ann")
    unit(store, "APA-01", *(set(VALUES) - {"stroke"}), "flatness")
    session = open_session(store, home(), SPEC, "Ann", "APA-01")
    session.entries.take("stroke", session.step("stroke").check.inputs["stroke_um"], Measured(stroke))
    judge_whole_unit(session)
    assert HELD not in named(store)  # it waits for the technician's signature first
    assert certify.Signing(session).sign("correct horse", reason="measured twice").valid
    assert named(store).get(HELD, []) == waits
    session.close()
