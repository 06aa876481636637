"""Steps and summary say the same of a unit, and Enter leads from the one to the other."""

from pathlib import Path

import numpy as np
import pytest

from accept.base.documents.results import Information
from accept.base.home import home
from accept.judging import load_spec
from accept.simulate import UnitRequest, simulate, write
from accept.simulate.unit_request import SHORT_S
from accept.store import Store, open_store
from accept.store.payloads import StepJudged
from accept.units import unit_folder
from accept.workflow.session import Session
from accept.workflow.session.import_folder import adopt
from accept.workflow.session.open_session import open_session
from accept.workflow.steps.status import Status
from accept.workflow.training import training_request
from accept.workflow.worker.judging import judge_step, judge_whole_unit
from checks.cause import Cause
from checks.declare import Measured
from checks.quantity import Quantity
from checks.verdict import Finding, Verdict, judge
from hw.records import own_record
from tests.accept.workflow.test_workflow import begun


@pytest.fixture
def store():
    with open_store() as opened:
        yield opened


@pytest.fixture
def session(store: Store):
    with begun(store, "apa") as opened:
        yield opened


def take(session: Session, step: str, name: str, value: float) -> None:
    session.entries.take(step, session.step(step).check.inputs[name], Measured(value))


def judge_responses(session: Session, k_resonance: float) -> None:
    """A judgement of the responses as a step makes it: the resonance passes."""
    take(session, "frf", "payload_kg", 5.0)
    passes = judge(
        "frf", Quantity("axial_resonance_Hz", 93.9, 0.1), session.step("frf").asked.limits["axial_resonance_Hz"]
    )
    assert passes.verdict is Verdict.PASS
    information = (Information.of("frf", Quantity("k_resonance_N_per_um", k_resonance, 0.02)),)
    session.append(StepJudged("frf", session.state("frf").upto, (passes,), information, ()))


def found(session: Session, step: str, quantity: str) -> Finding:
    judgement = session.judgements.of_step(step)
    assert judgement is not None
    return next(f for f in judgement.findings if f.quantity == quantity)


def causes(session: Session, step: str) -> set[Cause]:
    judgement = session.judgements.of_step(step)
    assert judgement is not None
    return {r.cause for f in judgement.findings if f.cause is not None for r in f.cause.all()}


def test_a_contradiction_marks_both_steps_before_the_summary(session: Session) -> None:
    take(session, "stiffness", "k_N_per_um", 1.75)
    judge_step(session, "stiffness")
    assert found(session, "stiffness", "k_closed_N_per_um").verdict is Verdict.PASS
    judge_responses(session, k_resonance=1.2)  # of a unit whose added mass gives 1.75
    for step, name in (("stiffness", "k_closed_N_per_um"), ("frf", "axial_resonance_Hz")):
        assert found(session, step, name).verdict is Verdict.NO_RESULT
        assert Cause.CONTRADICTION in causes(session, step)
    take(session, "stiffness", "k_N_per_um", 1.76)  # the other is measured again: nothing contradicts it meanwhile
    assert found(session, "frf", "axial_resonance_Hz").verdict is Verdict.PASS


def test_steps_that_agree_pass(session: Session) -> None:
    take(session, "stiffness", "k_N_per_um", 1.75)
    judge_step(session, "stiffness")
    judge_responses(session, k_resonance=1.73)
    assert Cause.CONTRADICTION not in causes(session, "stiffness") | causes(session, "frf")


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["capacitance", "wrong_payload"])
def test_every_step_says_of_its_quantities_what_the_summary_says(fault: str, tmp_path: Path) -> None:
    drawn = training_request("apa", "T-1", 1)
    request = UnitRequest("T-1", "apa", drawn.model, 1, fault=fault, repeats=False, low_s=SHORT_S, high_s=SHORT_S)
    folder = write(simulate(request), tmp_path / "T-1")
    with open_store() as store:
        session = open_session(store, home(), load_spec("apa"), "Ann", "T-1", simulated=True)
        session.begin({})
        assert not adopt(session, unit_folder.read(folder))
        for step in session.steps:
            judge_step(session, step.name)
        judged = [
            judgement for step in session.steps if (judgement := session.judgements.of_step(step.name)) is not None
        ]
        by_steps = {(f.check, f.quantity): (f.verdict, f.reason) for each in judged for f in each.findings}
        summary = {(f.check, f.quantity): (f.verdict, f.reason) for f in judge_whole_unit(session).findings}
        session.close()
    assert by_steps == summary
    assert {verdict for verdict, _ in summary.values()} > {Verdict.PASS}


def test_enter_leads_past_a_step_without_a_result_to_the_summary(store: Store, tmp_path: Path) -> None:
    """Of the hammer's four records one was taken, which holds no hit: the step is not complete, and Enter does not come
    back to it from the last one."""
    spec = load_spec("apa")
    checks = {name: spec.checks[name] for name in ("capacitance", "spurious_modes", "stroke")}
    session = open_session(store, home(), spec.model_copy(update={"checks": checks}), "Ann", "APA-03")
    session.begin({})
    hammer, stroke = session.step("spurious_modes"), session.step("stroke")
    noise = np.random.default_rng(4).normal(size=(2, 4096))
    columns = {"t": np.arange(4096) / 5120.0, "Track1": noise[0], "Track2": noise[1]}
    (tmp_path / "x.mat").write_bytes(own_record(columns))
    session.records.link("spurious_modes", hammer.check.inputs["x_bending"], tmp_path / "x.mat")
    judge_step(session, "spurious_modes")
    assert session.judgements.status(hammer) is Status.NO_RESULT
    assert session.judgements.next_step("spurious_modes") is stroke
    take(session, "stroke", "stroke_um", 365.5)
    assert session.judgements.next_step("stroke") is session.step("capacitance")  # it was left out
    for name in ("sensor_uF", "actuator_uF"):
        take(session, "capacitance", name, 4.95)
    assert hammer in session.judgements.waiting
    assert session.judgements.next_step("stroke") is None
    assert session.judgements.next_step() is hammer  # a restart stands there
    session.close()
