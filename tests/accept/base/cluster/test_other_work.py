"""Gap analysis, tables and judging again on a cluster: the same as on this machine."""

import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from accept.base.cluster.connect import connected
from accept.base.cluster.work import Cluster, ClusterError, WorkFailed
from accept.base.worker_process import memory_GB
from accept.batch.judge_batch import BatchRequest, run
from accept.batch.worker import Errand, Returned, judge, run_errand
from accept.commands.physics.gap import Answer, GapQuestion, answer
from accept.fleet.judged_again import judged_again
from accept.judging.judge_unit import load_spec
from accept.models.lookup_cache import Plan, build
from accept.models.model_file import open_model
from accept.store import open_store
from accept.units import unit_folder
from accept.units.shared_folder import anywhere, looks_of
from tests.accept.units.units import GOOD, make_unit
from tests.checks.gap.gap_units import make_strut

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    with connected("local", print) as made:
        assert made is not None
        yield made


def half(number: int) -> float:
    return number / (number - 3)


def test_what_the_work_raises_is_raised_here_and_the_cluster_goes_on(cluster: Cluster) -> None:
    with pytest.raises(WorkFailed, match="ZeroDivisionError"):
        list(cluster.unordered(half, range(6)))
    assert sorted(cluster.unordered(half, [4, 5])) == [(4, 4.0), (5, 2.5)]


def grab(gigabytes: float) -> int:
    return int(np.empty(int(gigabytes * 1e9 / 8)).size)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only here the limit is enforced for sure")
def test_a_worker_has_the_limit_of_memory_of_a_local_one(cluster: Cluster) -> None:
    """Beyond it a demand fails, however much the machine has; the worker lives on."""
    with pytest.raises(WorkFailed, match="MemoryError"):
        list(cluster.unordered(grab, [memory_GB() + 0.5]))
    assert [size > 0 for _, size in cluster.unordered(grab, [0.1])] == [True]


def test_nobody_at_an_address_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("accept.base.cluster.dask_workers.CONNECT_S", 0.5)
    with pytest.raises(ClusterError, match="no Dask scheduler answers"), connected("tcp://127.0.0.1:1", print):
        pass


def test_a_table(cluster: Cluster) -> None:
    """Bit for bit: the workers are this machine's."""
    plan = Plan.of(open_model("strut-2dof"), 5, 3)
    far, near = build(plan, lambda _: None, cluster=cluster), build(plan, lambda _: None, workers=1)
    np.testing.assert_array_equal(far.R, near.R)


def test_the_store_judged_again_from_records(cluster: Cluster, tmp_path: Path) -> None:
    for serial in ("B", "A", "C"):
        make_unit(tmp_path / serial, serial, GOOD.replace("5.10", "1.72") if serial == "B" else GOOD)
    order = BatchRequest([tmp_path], tmp_path / "out", {"apa": load_spec("apa-basic")}, "Ada", workers=1)
    with open_store() as store:
        run(order, store, lambda _: None)
        for records in (False, True):
            specs = {"apa": load_spec("apa")}
            assert judged_again(store, specs, records, cluster) == judged_again(store, specs, records)


@pytest.mark.soak
def test_a_gap_analysis(cluster: Cluster, tmp_path: Path) -> None:
    unit = anywhere(unit_folder.read(make_strut(tmp_path / "S-1", "S-1", repeats=False)))
    asked = GapQuestion(unit, looks_of(unit), "strut-2dof", ())
    ((_, far),) = cluster.unordered(answer, [asked])
    near = answer(asked)
    assert (far.document, far.words) == (near.document, near.words)
    assert far.files.keys() == near.files.keys()


def test_a_folder_that_is_not_shared_is_refused(cluster: Cluster, tmp_path: Path) -> None:
    """Without its files a unit would only seem incomplete."""
    unit = anywhere(unit_folder.read(make_unit(tmp_path / "A", "A", GOOD)))
    order = BatchRequest([unit.path], tmp_path / "out", {"apa": load_spec("apa-basic")}, "Ada")
    job = partial(judge, unit, order.specs["apa"], "Ada", draw=False)
    lost = Errand(job, looks_of(unit) | {"stroke.mat": 1000})
    ((_, back),) = cluster.unordered(run_errand, [lost])
    assert isinstance(back, Returned)
    assert "share the folder" in str(back.outcome)
    question = GapQuestion(unit, lost.looks, "apa-2dof", ())
    ((_, given),) = cluster.unordered(answer, [question])
    assert isinstance(given, Answer)
    assert given.document is None
    assert "share the folder" in given.words[0]
