"""Gap analysis, tables and judging again on a cluster: the same as on this machine."""

import gc
import hashlib
import json
import os
import pickle
import signal
import sys
import tomllib
import tracemalloc
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import dask
import numpy as np
import pytest

from accept.base.cluster import dask_workers
from accept.base.cluster.connect import connected
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.base.runner import ClusterError, GivenUp, Workers, WorkFailed
from accept.base.worker_process import memory_GB
from accept.batch.executors import Returned, run_jobs, run_remotely
from accept.batch.job import UnitJob
from accept.batch.judge_batch import BatchRequest, run
from accept.commands.fleet import selection
from accept.commands.fleet.options import Outputs
from accept.commands.physics import gap, lookup
from accept.commands.trust.bench_keys import demo_credential
from accept.fleet.judged_again import judged_again
from accept.gap import analyse_unit
from accept.gap.analyse_unit import GapAnswer, GapJob
from accept.judging import load_spec
from accept.models.lookup_cache import Plan, build
from accept.models.model_file import open_model
from accept.store import fold, open_store
from accept.units import unit_folder
from accept.units.unit_folder import UnitFolder, anywhere
from tests.accept.base.cluster.small_work import digest, fatal_31, grab, half, process_of
from tests.accept.units.units import GOOD, make_unit
from tests.checks.gap.shared.gap_units import make_strut
from validation import run_cases
from validation.cases import draw_cases, seal
from validation.run_cases import Job, run_all
from validation.scoring.scores import Outcome

pytestmark = pytest.mark.slow
T = TypeVar("T")
R = TypeVar("R")


@pytest.fixture(scope="module")
def cluster() -> Iterator[Workers]:
    with connected("local", print) as made:
        assert made is not None
        yield made


def test_what_the_work_raises_is_raised_here_and_the_cluster_goes_on(cluster: Workers) -> None:
    with pytest.raises(WorkFailed, match="ZeroDivisionError"):
        list(cluster.unordered(half, range(6)))
    assert sorted(cluster.unordered(half, [4, 5])) == [(4, 4.0), (5, 2.5)]


def test_work_goes_on_when_every_worker_died(cluster: Workers) -> None:
    died = {pid for _, pid in cluster.unordered(process_of, range(40))}
    back = cluster.unordered(process_of, range(200))
    found = [next(back)]
    for pid in died:
        os.kill(pid, signal.SIGKILL)
    found += back
    assert sorted(number for number, _ in found) == list(range(200))
    assert {pid for _, pid in found} - died  # those that were started again


@pytest.mark.soak
def test_only_what_kills_its_worker_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a real worker, which a nanny starts again; `test_tasks.py` has the same without one."""
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}), connected("local", print) as one:
        assert one is not None
        back = list(one.unordered(fatal_31, range(200)))
    assert sorted(item for item, _ in back) == list(range(200))
    assert [item for item, found in back if isinstance(found, GivenUp)] == [31]
    assert all(found == -item for item, found in back if item != 31)


def test_what_was_handed_in_is_not_held(cluster: Workers, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 120 items of 200 kB at most ten stay for each stream of messages (to the scheduler, and from it to two
    workers), where Dask would keep a thousand: with the item that is under way 7 MB, against 48."""
    monkeypatch.setattr(dask_workers, "TOGETHER", 1)
    gc.collect()
    tracemalloc.start()
    found = {size for _, size in cluster.unordered(len, (os.urandom(200_000) for _ in range(120)))}
    gc.collect()
    held = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert found == {200_000}
    assert held < 12e6


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only here the limit is enforced for sure")
def test_a_worker_has_the_limit_of_memory_of_a_local_one(cluster: Workers) -> None:
    """Beyond it a demand fails, however much the machine has; the worker lives on."""
    large = memory_GB() + 0.5
    back = dict(cluster.unordered(grab, [large, 0.1]))
    assert isinstance(back[large], GivenUp)
    assert f"more than the {memory_GB():g} GB of memory that a worker may take" in str(back[large])
    assert back[0.1] > 0


class Outgrown:
    """A cluster whose workers all have too little memory."""

    def unordered(self, _: object, items: Iterable[object]) -> Iterator[tuple[object, GivenUp]]:
        yield from ((item, GivenUp("it takes more than a worker may take")) for item in items)


def test_what_takes_too_much_memory_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a worker or here, for a table, a gap analysis and judging again; the exit code is that of bad input."""

    @contextmanager
    def outgrown(*_: object) -> Iterator[Outgrown]:
        yield Outgrown()

    def full(*_: object) -> None:
        raise MemoryError

    unit = make_strut(tmp_path / "S-1", "S-1", repeats=False)
    for command in (lookup, gap):
        monkeypatch.setattr(command, "connected", outgrown)
    found = [lookup.run_build("strut-2dof", 5, 3, cluster="far", force=True), gap.run([unit], tmp_path, cluster="far")]
    monkeypatch.undo()
    monkeypatch.setattr(analyse_unit, "analyse", full)
    monkeypatch.setattr(selection.judged_again, "judged_again", full)
    found += [gap.run([unit], tmp_path), selection.rejudge(["apa"], records=True, outputs=Outputs())]
    lines = capsys.readouterr().err.splitlines()
    assert found == [Exit.BAD_INPUT] * 4
    assert sum("takes more than" in line for line in lines) == 4, lines


def test_nobody_at_an_address_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("accept.base.cluster.dask_workers.CONNECT_S", 0.5)
    with pytest.raises(ClusterError, match="no Dask scheduler answers"), connected("tcp://127.0.0.1:1", print):
        pass


def test_a_table(cluster: Workers) -> None:
    """Bit for bit: the workers are this machine's."""
    plan = Plan.of(open_model("strut-2dof"), 5, 3)
    far, near = build(plan, lambda _: None, cluster=cluster), build(plan, lambda _: None, workers=1)
    np.testing.assert_array_equal(far.R, near.R)


def test_the_store_judged_again_from_records(cluster: Workers, tmp_path: Path) -> None:
    for serial in ("B", "A", "C"):
        make_unit(tmp_path / serial, serial, GOOD.replace("5.10", "1.72") if serial == "B" else GOOD)
    order = BatchRequest([tmp_path], tmp_path / "out", {"apa": load_spec("apa-basic")}, "Ada", workers=1)
    with open_store() as store:
        run(order, store, lambda _: None)
        for records in (False, True):
            specs = {"apa": load_spec("apa")}
            far = sorted(judged_again(store, specs, records, cluster), key=lambda one: one.serial)
            assert far == list(judged_again(store, specs, records))
            assert len(far) == 3


class Overheard:
    """A cluster, and all that went to its workers."""

    def __init__(self, cluster: Workers) -> None:
        self.cluster, self.sent = cluster, list[bytes]()

    def unordered(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | GivenUp]]:
        def noted() -> Iterator[T]:
            for item in items:
                self.sent.append(pickle.dumps(item))
                yield item

        return self.cluster.unordered(work, noted())


def test_the_coordinator_signs_and_no_key_leaves_it(cluster: Workers, tmp_path: Path) -> None:
    """Certificates of a batch on a cluster are those that the store has; neither key nor passphrase was sent."""
    for serial in ("A", "B"):
        make_unit(tmp_path / "units" / serial, serial)
    credential, heard = demo_credential(home()), Overheard(cluster)
    assert credential.key is not None
    secret = credential.key.private_numbers().private_value.to_bytes(credential.key.key_size // 8, "big")
    specs = {"apa": load_spec("apa-basic")}
    order = BatchRequest([tmp_path / "units"], tmp_path / "out", specs, "Ada", credential=credential, cluster=heard)
    with open_store() as store:
        assert run(order, store, lambda _: None).verdicts == {"accepted": 2}
        units = {serial: fold(store.events(serial)) for serial in ("A", "B")}
    for serial in ("A", "B"):
        pdf, unit = tmp_path / "out" / "certificates" / f"{serial}.pdf", units[serial]
        assert unit is not None
        assert (known := unit.certificate) is not None
        assert hashlib.sha256(pdf.read_bytes()).hexdigest() == known.sha256
        assert [s.role for s in known.signatures] == [credential.role]
    assert len(heard.sent) == 2
    for words in (secret, secret.hex().encode(), b"PRIVATE KEY", os.environ["ACCEPT_PASSPHRASE"].encode()):
        assert all(words not in sent for sent in heard.sent)


@dataclass(frozen=True)
class Small:
    """A unit of the blind test that takes no time to record."""

    serial: str
    effects: Mapping[str, float] = field(default_factory=dict)
    outside: tuple[str, ...] = ()

    def write(self, parent: Path) -> Path:
        return make_unit(parent / self.serial, self.serial)

    def detectability(self) -> float:
        return 7.0


def test_the_blind_test(cluster: Workers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers are handed the same units, byte for byte, and a crash is an outcome there as here; a worker whose
    validation is another one is found before it counts."""
    truth = {"effects": {}, "outside": {}, "kind": "none"}
    named = f"{digest.__module__}:{digest.__name__}"
    model = tmp_path / "model.toml"
    model.write_text("# as the coordinator has it")
    jobs: list[Any] = [Job(Small(serial), truth, named, model=model) for serial in ("B-1", "B-2")]  # type: ignore[arg-type]
    jobs.append(replace(jobs[0], without=("none",)))
    assert as_text(run_all(jobs, 0, cluster=cluster)) == as_text(run_all(jobs, 0))
    assert [o.error for o in run_all(jobs, 0)] == [None, None, "ValueError: cannot do without none"]
    monkeypatch.setattr(run_cases, "_code", lambda: "of another version")
    with pytest.raises(WorkFailed, match="code differ from the coordinator's"):
        run_all(jobs, 0, cluster=cluster)


@pytest.mark.soak
@pytest.mark.needs_data
def test_the_blind_test_by_the_real_workflow(cluster: Workers) -> None:
    cases = draw_cases(2, 7)
    truth = json.loads(seal(cases)[0])
    jobs = [Job(case, truth[case.serial], misalign=True) for case in cases]
    assert as_text(run_all(jobs, 0, cluster=cluster)) == as_text(run_all(jobs, 0))


def as_text(outcomes: Iterable[Outcome]) -> list[str]:
    """Without the times; what is not a number is the same everywhere."""
    return [json.dumps(asdict(replace(o, seconds=0.0, wall=0.0)), sort_keys=True) for o in outcomes]


def test_a_unit_of_the_blind_test_that_no_worker_could_do_is_a_crash() -> None:
    job: Any = Job(Small("B-1"), {"effects": {}, "outside": {}, "kind": "none"})  # type: ignore[arg-type]
    (outcome,) = run_all([job], 0, cluster=Outgrown())
    assert outcome.error == "GivenUp: it takes more than a worker may take"
    assert outcome.verdict == "error"


@pytest.mark.soak
def test_a_gap_analysis(cluster: Workers, tmp_path: Path) -> None:
    unit = anywhere(unit_folder.read(make_strut(tmp_path / "S-1", "S-1", repeats=False)))
    far_place, near_place = tmp_path / "far", tmp_path / "near"
    ((_, far),) = run_jobs([GapJob(unit, far_place, "strut-2dof")], cluster=cluster)
    ((_, near),) = run_jobs([GapJob(unit, near_place, "strut-2dof")], 1)
    assert isinstance(far, GapAnswer)
    assert isinstance(near, GapAnswer)
    assert (far.document, far.words) == (near.document, near.words)
    assert (far_place / "model.toml").read_bytes() == (near_place / "model.toml").read_bytes()
    assert {p.name for p in far_place.iterdir()} == {p.name for p in near_place.iterdir()}


def test_a_folder_that_is_not_shared_is_refused(cluster: Workers, tmp_path: Path) -> None:
    """Without its files a unit would only seem incomplete."""
    unit = anywhere(unit_folder.read(make_unit(tmp_path / "A", "A", GOOD)))
    lost = replace(unit, sizes={**unit.sizes, "stroke.mat": 1000})
    for job in (UnitJob(lost, load_spec("apa-basic"), "Ada"), GapJob(lost, tmp_path / "out", "apa-2dof")):
        ((_, back),) = cluster.unordered(run_remotely, [job])
        assert isinstance(back, Returned)
        assert "share the folder" in str(back.outcome)


def test_a_model_that_came_back_finds_its_files(tmp_path: Path) -> None:
    """It was written in a folder of the worker, below another path, and names what lies beside the unit."""
    (tmp_path / "apa.mat").write_bytes(b"matrices")
    unit = unit_folder.read(make_unit(tmp_path / "A", "A", GOOD))
    ((_, outcome),) = run_jobs([Writing(unit, tmp_path / "deep" / "out", tmp_path / "apa.mat")], cluster=InProcess())
    assert outcome == "written"
    text = tomllib.loads((tmp_path / "deep" / "out" / "models" / "A.toml").read_text())
    assert text["apa"]["file"] == "../../../apa.mat"


class InProcess:
    """A cluster that is this process."""

    def unordered(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | GivenUp]]:
        yield from ((item, work(item)) for item in items)


@dataclass(frozen=True)
class Writing:
    """A job that writes a model which names a file."""

    unit: UnitFolder
    out: Path
    file: Path

    def run(self) -> str:
        path = self.out / "models" / "A.toml"
        path.parent.mkdir(parents=True)
        path.write_text(f'[apa]\nfile = "{os.path.relpath(self.file, path.parent)}"\n')
        return "written"
