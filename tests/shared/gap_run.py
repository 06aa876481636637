"""`accept gap` on a strut with a high-pass, run once for all tests that read what it found, printed or wrote."""

from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from accept.gap import analyse_unit
from accept.gap.analyse_unit import GapAnalysis
from tests.checks.gap.shared.gap_units import HIGHPASS, make_strut
from tests.shared.once import once


@dataclass(frozen=True)
class GapRun:
    """unit: its folder; out: what was written; done: what was found."""

    unit: Path
    out: Path
    exit_code: int
    stdout: str
    stderr: str
    done: GapAnalysis


@pytest.fixture(scope="session")
def gap_run(tmp_path_factory: pytest.TempPathFactory) -> GapRun:
    """Not to be written into."""
    return once(tmp_path_factory, "gap", _run)


def _run(place: Path) -> GapRun:
    unit, out = make_strut(place / "X-1", "X-1", HIGHPASS), place / "out"
    found: list[GapAnalysis] = []
    analyse = analyse_unit.analyse
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACCEPT_HOME", str(place / "home"))
        patch.setattr(analyse_unit, "analyse", lambda *a, **k: found.append(analyse(*a, **k)) or found[-1])
        run = CliRunner().invoke(app, ["gap", str(unit), "--model", "strut", "--out", str(out), "--html"])
    return GapRun(unit, out, run.exit_code, run.stdout, run.stderr, found[0])
