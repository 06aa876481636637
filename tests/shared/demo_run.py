"""`accept demo`, run once for all tests that look at what it leaves: what is printed, the files, the README."""

from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from tests.shared.once import once


@dataclass(frozen=True)
class DemoRun:
    """What `accept demo --out out/demo` printed, and where. home: its ACCEPT_HOME."""

    place: Path
    home: str
    exit_code: int
    stdout: str
    stderr: str
    output: str

    @property
    def out(self) -> Path:
        return self.place / "out" / "demo"


@pytest.fixture(scope="session")
def demo_run(tmp_path_factory: pytest.TempPathFactory) -> DemoRun:
    """Not to be written into."""
    return once(tmp_path_factory, "demo", _run)


def _run(place: Path) -> DemoRun:
    home = place / "home"
    home.mkdir()
    with chdir(place):
        done = CliRunner().invoke(app, ["demo", "--out", "out/demo"], env={"ACCEPT_HOME": str(home), "COLUMNS": "100"})
    return DemoRun(place, str(home), done.exit_code, done.stdout, done.stderr, done.output)
