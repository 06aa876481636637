"""The memory limit of a worker on systems that have none, or refuse it."""

import resource
import subprocess
import sys

import pytest

from accept.base import worker_process


def refused(*_: object) -> None:
    raise ValueError("current limit exceeds maximum limit")  # what macOS says (CPython #84698)


@pytest.mark.parametrize("platform", ["darwin", "win32", "linux"])
def test_a_system_that_refuses_the_limit_judges_without_it(monkeypatch: pytest.MonkeyPatch, platform: str) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(resource, "setrlimit", refused)
    worker_process.limit_memory(4.0)


def test_it_is_not_asked_for_outside_linux(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[object] = []
    monkeypatch.setattr(resource, "setrlimit", lambda *limit: asked.append(limit))
    monkeypatch.setattr(sys, "platform", "darwin")
    worker_process.limit_memory(4.0)
    assert not asked


def test_workers_of_a_cluster_do_without_the_module_resource() -> None:
    """Red before in `limit_memory`. psutil comes first: on Windows it has a module of its own for that system."""
    pytest.importorskip("distributed")
    code = """
import psutil, sys
sys.modules["resource"] = None
from accept.base.cluster import dask_workers
from accept.base.worker_process import limit_memory
limit_memory(4.0)
dask_workers.Labelled()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
