"""`accept frf` of files: a response file stays with the reader of responses, a record with that of records; every case
that was met elsewhere is right or refused with its own reason."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from accept.cli.main import app

F = np.arange(1.0, 301.0)
RE, IM = 2e-6 / (1 + (F / 200) ** 2), -1e-8 * F / 200


def frf(path: Path, *words: object, code: int = 0):
    found = CliRunner().invoke(app, ["frf", str(path), *map(str, words)], env={"COLUMNS": "200"})
    assert found.exit_code == code, found.output + found.stderr + str(found.exception)
    return found


def table(path: Path, header: str, *columns: np.ndarray) -> Path:
    np.savetxt(path, np.column_stack([F, *columns]), delimiter=",", header=header, comments="", fmt="%.12g")
    return path


RESPONSES = {
    "acceleration": ("f [Hz],da_re [m/s2/V],da_im [m/s2/V]", "unit m/s2, which does not fit"),
    "two units": ("f [Hz],de_re [um/V],de_im [m/V]", "two units"),
    "phase": ("Frequency (Hz),Magnitude,Phase", "write [deg] or [rad]"),
    "no pair": ("f [Hz],x,y", "no pair of columns"),
    "unit of frequency": ("f [s],de_re,de_im", "expected Hz"),
}


@pytest.mark.parametrize("case", RESPONSES)
def test_a_response_file_is_refused_with_its_own_reason(case: str, tmp_path: Path) -> None:
    header, words = RESPONSES[case]
    found = frf(table(tmp_path / "a.csv", header, RE, IM), code=6)
    assert words in found.stderr
    assert "channel 'Va'" not in found.stderr  # the reason of the reader of records


def test_a_record_is_refused_as_a_record(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.csv", np.column_stack([F / 1e3, RE]), delimiter=",", header="t,de", comments="")
    assert "no channel 'Va'" in frf(tmp_path / "a.csv", code=6).stderr
    np.savetxt(tmp_path / "b.csv", np.column_stack([RE, IM]), delimiter=",", header="x,f", comments="")
    assert "no channel 'Va'" in frf(tmp_path / "b.csv", "--ts", 1e-3, code=6).stderr  # --ts: a record


def test_a_file_of_both_gives_both_reasons(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": F / 1e3, "x": RE, "freq": F, "S1": RE + 1j * IM})
    words = frf(tmp_path / "a.mat", code=6).stderr
    assert "no channel 'Va'" in words
    assert "no response by name" in words


def test_a_response_per_newton_needs_no_input(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", "f [Hz],de_re [m/N],de_im [m/N]", RE, IM)
    found = frf(path, "--json", tmp_path / "a.json")
    one = json.loads((tmp_path / "a.json").read_text())["responses"][0]
    assert (one["input"], one["units"]) == ("force", {"force": "N", "de": "m"})
    assert "de / force" in found.stdout
