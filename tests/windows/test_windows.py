"""Benches run on Windows: nothing that only POSIX has is needed outside the simulated instruments."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.shared import source_trees
from tests.windows.windows_run import OURS, POSIX_ONLY, SIGNAL_TIMER

ROOT = Path(__file__).parents[2]
# What `os` and `signal` have on POSIX only, as far as programs use it (Python's documentation: "Availability: Unix").
FUNCTIONS = {
    "fork", "forkpty", "openpty", "getuid", "geteuid", "getgid", "getegid", "getpgid", "setsid", "killpg", "mkfifo",
    "sync", "fchown", "chown", "fdatasync", "posix_fallocate", "pread", "pwrite", "statvfs", "ttyname", "uname", "nice",
    "getloadavg", "sched_getaffinity", "O_DIRECTORY", "O_NOFOLLOW", "O_CLOEXEC", "O_NONBLOCK", "SIGKILL", "SIGHUP",
    "SIGUSR1", "SIGALRM", "alarm", "setitimer", "pause", "AF_UNIX", "WNOHANG",
}  # fmt: skip
SIMULATED = Path("hw/simulated/server.py")
# It asks for the timer before it sets it; `windows_run` takes the timer away, and with it all that this file may name.
ASKS = {Path("accept/base/watchdog.py"): set(SIGNAL_TIMER)}


def test_the_whole_way_without_posix_modules(tmp_path: Path):
    """All modules imported; workflow, batch, certificate and a driver run."""
    run = [sys.executable, "-m", "tests.windows.windows_run", str(tmp_path)]
    done = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stdout.splitlines() if line in ("workflow", "batch_and_certificate", "driver")] == [
        "workflow",
        "batch_and_certificate",
        "driver",
    ]


def test_a_posix_module_would_be_missed(tmp_path: Path):
    """The hiding bites: a module of ours that imports one ends the run."""
    code = (
        "from tests.windows import windows_run as w; w.hide(); import types; m = types.ModuleType('hw.x')\n"
        "exec('import {name}', m.__dict__)"
    )
    for name in ("termios", "fcntl"):
        done = subprocess.run(
            [sys.executable, "-c", code.format(name=name)], cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert "on Windows" in done.stderr


@cache
def nodes() -> list[tuple[Path, ast.AST]]:
    """Everything that imports or looks into a module, with its file."""
    paths = [path for package in OURS for path in sorted((ROOT / package).rglob("*.py"))]
    kinds = ast.Import | ast.ImportFrom | ast.Attribute
    return [
        (path.relative_to(ROOT), node) for path in paths for node in source_trees.nodes(path) if isinstance(node, kinds)
    ]


def test_no_function_that_windows_lacks():
    used = [
        f"{path}:{node.lineno} {node.value.id}.{node.attr}"
        for path, node in nodes()
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
        if node.value.id in ("os", "signal", "socket") and node.attr in FUNCTIONS - ASKS.get(path, set())
        if path != SIMULATED
    ]
    assert not used


def test_posix_modules_are_imported_only_where_their_absence_is_expected():
    expected = {SIMULATED} | {
        Path(path) for path in ("hw/serial_port.py", "accept/base/worker_process.py", "accept/base/names.py")
    }
    found = set()
    for path, node in nodes():
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        if any(name.partition(".")[0] in POSIX_ONLY for name in names):
            found.add(path)
    assert found == expected


@pytest.mark.parametrize("name", ["nt", "posix"])
def test_a_file_is_written_where_folders_cannot_be_opened(name, tmp_path, monkeypatch):
    from accept.base import atomic_files

    monkeypatch.setattr(atomic_files.os, "name", name)
    opened = []
    monkeypatch.setattr(atomic_files.os, "open", lambda path, flags: opened.append(path) or 3)
    monkeypatch.setattr(atomic_files.os, "fsync", lambda handle: None)
    monkeypatch.setattr(atomic_files.os, "close", lambda handle: None)
    atomic_files._sync_folder(tmp_path)
    assert opened == ([] if name == "nt" else [tmp_path])
