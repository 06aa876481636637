"""`accept demo`, run once for all tests that look at what it leaves: what is printed, the files, the README."""

import json
import os
from contextlib import chdir
from dataclasses import asdict, dataclass
from pathlib import Path

import pytest
from filelock import FileLock
from typer.testing import CliRunner

from accept.cli.main import app


@dataclass(frozen=True)
class DemoRun:
    """What `accept demo --out out/demo` printed, and where. home: its ACCEPT_HOME."""

    place: str
    home: str
    exit_code: int
    stdout: str
    stderr: str
    output: str

    @property
    def out(self) -> Path:
        return Path(self.place, "out", "demo")


@pytest.fixture(scope="session")
def demo_run(tmp_path_factory: pytest.TempPathFactory) -> DemoRun:
    """Not to be written into. Test processes that run beside each other share it."""
    base = tmp_path_factory.getbasetemp()
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "demo"
    record = shared / "run.json"
    with FileLock(f"{shared}.lock"):
        if not record.exists():
            run = _run(shared)
            record.write_text(json.dumps(asdict(run)))
    return DemoRun(**json.loads(record.read_text()))


def _run(place: Path) -> DemoRun:
    home = place / "home"
    home.mkdir(parents=True)
    with chdir(place):
        done = CliRunner().invoke(app, ["demo", "--out", "out/demo"], env={"ACCEPT_HOME": str(home), "COLUMNS": "100"})
    return DemoRun(str(place), str(home), done.exit_code, done.stdout, done.stderr, done.output)
