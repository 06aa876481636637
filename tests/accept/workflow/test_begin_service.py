"""What the bench proposes at a start, and a tray in its store."""

from collections.abc import Iterator

import pytest

from accept.base.home import home
from accept.base.names import is_system_account
from accept.store import open_store
from accept.store.payloads import CertificateSigned, RunOpened
from accept.workflow.bench import Workbench
from accept.workflow.dialogue.begin import Begun, LookUp
from accept.workflow.effects.serve_begin import BeginService
from accept.workflow.open_bench import open_bench
from accept.workflow.session import Session
from accept.workflow.training import open_training
from accept.workflow.worker.judging import judge_whole_unit
from checks.declare import Measured


@pytest.fixture
def bench() -> Iterator[Workbench]:
    bench = open_bench("apa-basic")
    yield bench
    bench.close()


@pytest.fixture
def service(bench: Workbench) -> BeginService:
    return BeginService(bench)


def measure(session: Session) -> None:
    session.entries.take("capacitance", session.step("capacitance").check.inputs["sensor_uF"], Measured(4.99))


@pytest.mark.parametrize(("last", "proposed"), [("Bob", "Bob"), ("root", ""), ("", "")])
def test_the_last_operator_here_is_proposed_and_no_account_of_a_machine(service, last: str, proposed: str):
    if last:
        with open_store() as store:
            store.write(RunOpened(1), "APA-01", who=last)  # a unit of another bench of this store
    assert (service.proposed("").operator, service.proposed("").serial) == (proposed, "")


def test_the_next_start_goes_on_with_the_unit_that_was_measured_until_it_is_signed(service: BeginService):
    session, _ = service.bench.open_unit(Begun("APA-02", "apa", "Ann"))
    assert service.proposed("Ann").serial == ""  # nothing was measured
    measure(session)
    assert [service.proposed(operator).serial for operator in ("Ann", "", "Bob")] == ["APA-02", "APA-02", ""]
    judge_whole_unit(session)
    session.append(CertificateSigned("certificates/APA-02.pdf", "0" * 64, "technician"))
    session.close()
    assert service.proposed("Ann").serial == ""


def test_a_training_goes_on_with_its_unit_unless_another_was_asked_for():
    begun = Begun("TRAIN-000003", "apa", "Ann")
    bench = open_training("apa-basic", 3)
    session, _ = bench.at_unit(begun).open_unit(begun)
    measure(session)
    session.close()
    bench.close()
    for seed, proposed in ((None, "TRAIN-000003"), (3, "")):
        bench = open_training("apa-basic", seed)
        assert bench.unfinished("Ann") == proposed
        bench.close()


def test_accounts_of_machines_are_known():
    assert is_system_account("root")
    assert is_system_account("daemon")
    assert not is_system_account("Ann")


def test_a_serial_that_was_entered_by_mistake_leaves_no_trace_in_the_lists(service: BeginService):
    """And the right serial, which differs in capitals only, is taken then."""
    for serial in ("APA-01", "apa-02"):
        assert service.add(Begun(serial, "apa", "Ann")) is True
    assert service.add(Begun("APA-01", "apa", "Ann")) is False
    service.bench.take_off("apa-02", "apa", "Ann")
    service.add(Begun("APA-02", "apa", "Ann"))
    seen = service.overview()
    assert [unit.serial for unit in seen.units] == ["APA-02", "APA-01"] == [u.serial for u in seen.queues[0].units]
    assert [e.subject for e in service.bench.store.events(what="attempt_started")] == ["APA-01", "apa-02", "APA-02"]


def test_a_serial_that_looks_like_a_known_one_is_asked_about_before_its_unit_is_begun(service: BeginService):
    service.add(Begun("APA-01", "apa", "Ann"))
    assert "APA-01" in str(service.add(Begun("APA-O1", "apa", "Ann")))
    assert service.add(Begun("APA-O1", "apa", "Ann", confirmed=True)) is True
    known, key_problem = service.look_up(LookUp("APA-O1", "Ann"))
    assert (known.serial, key_problem) == ("APA-O1", "")
    assert not list(home().glob("certificates/*"))
