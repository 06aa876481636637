"""A folder of a supplier runs no program: neither at the start of a worker, nor by a plug-in that lies in it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from accept.base.child_processes import environment, process_pool, protected
from accept.commands.bench.web import command
from accept.workflow.worker.process import COMMAND, Work, WorkerProcess
from specs.plugins import CHECKS, plugins

TRAP = "open({path!r}, 'w')\nraise SystemExit(1)\n"


@pytest.fixture
def supplier(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with modules in it that say when they run."""
    here = tmp_path / "from-supplier"
    (here / "accept").mkdir(parents=True)
    for name in ("pickle.py", "selectors.py", "accept/__init__.py"):
        (here / name).write_text(TRAP.format(path=str(tmp_path / f"RAN-{name.replace('/', '-')}")))
    monkeypatch.chdir(here)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    return here


def ran(place: Path) -> list[str]:
    return sorted(p.name for p in place.glob("RAN-*"))


def test_the_trap_works(supplier: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-c", "import pickle"], capture_output=True, check=False)
    assert ran(tmp_path) == ["RAN-pickle.py"]


def test_no_worker_imports_from_the_working_folder(supplier: Path, tmp_path: Path) -> None:
    with process_pool(1) as pool:
        assert pool.submit(abs, -3).result() == 3
        assert pool.submit(os.getenv, "ACCEPT_PASSPHRASE").result() is None
        assert pool.submit(os.getenv, "PYTHONSAFEPATH").result() == "1"
    worker = WorkerProcess()
    try:
        assert worker.run(Work(said_nothing)) == 5
    finally:
        worker.close()
    assert ran(tmp_path) == []


def said_nothing(_: object) -> int:
    return 5


def test_every_command_line_of_ours_has_a_safe_path() -> None:
    assert "-P" in COMMAND
    assert "-P" in command([])


def test_children_know_no_passphrase(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    assert not [name for name in environment() if "PASSPHRASE" in name]
    before = dict(os.environ)
    with protected():
        assert "ACCEPT_PASSPHRASE" not in os.environ
    assert dict(os.environ) == before


def test_a_plug_in_of_the_working_folder_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = tmp_path / "evil-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{CHECKS}]\nevil = evilmod:thing\n")
    (tmp_path / "evilmod.py").write_text(TRAP.format(path=str(tmp_path / "RAN-plugin")))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert plugins(CHECKS, lambda _: "", ()) == {}
    assert ran(tmp_path) == []
