"""The lines of MATLAB that the pages show, and the script for the rig, as GNU Octave runs them."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from typer.testing import CliRunner

import accept
from accept.cli.main import app

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/how-to/exchange.md").read_text(encoding="utf-8")
FRD, SS = re.findall(r"^```matlab\n(.+?)\n```$", PAGE, re.MULTILINE | re.DOTALL)
F = np.arange(20.0, 601.0, 20.0)


def octave(code: str, cwd: Path) -> str:
    """Return what Octave prints for some code; fail if it ends in an error."""
    words = ["octave-cli", "--no-gui", "--quiet", "--norc", "--eval", code]
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


if shutil.which("octave-cli") is None:
    pytest.skip("needs Octave (Debian: octave, octave-control)", allow_module_level=True)


@pytest.fixture(scope="module")
def control() -> str:
    """Return the line that loads Octave's control package."""
    load = "pkg load control; "
    done = subprocess.run(["octave-cli", "--norc", "--eval", load], capture_output=True, check=False, timeout=120)
    if done.returncode:
        pytest.skip("needs Octave's control package (Debian: octave-control)")
    return load


def test_a_response_is_an_frd_object_by_the_line_of_the_page(control: str, tmp_path: Path) -> None:
    """`frd` of Octave names no channel and takes rad/s alone: the line is run without what MATLAB has more."""
    words = ["model", "frf", "--model", "strut-2dof", "--points", "30", "--mat", str(tmp_path / "F.mat")]
    assert CliRunner().invoke(app, words).exit_code == 0
    response = accept.read_response(tmp_path / "F.mat").frf
    units = "'FrequencyUnit', r.FrequencyUnit, "
    assert units in FRD
    line = FRD.replace("r.Frequency,", "2*pi*r.Frequency,").replace(units, "")
    octave(f"{control}{line} H = G.H; u = G.InputName; save('-v7', 'out.mat', 'H', 'u')", tmp_path)
    back = loadmat(tmp_path / "out.mat", squeeze_me=True)
    np.testing.assert_allclose(back["H"].T, response.H, rtol=1e-15)
    assert back["u"] == "Va"


def test_a_model_is_a_state_space_by_the_line_of_the_page(control: str, tmp_path: Path) -> None:
    """Octave's `ss` knows no delay of an output; the model here has none, so nothing is lost with it."""
    model = accept.open_model("strut-2dof")
    accept.save_ss(accept.to_ss(model), tmp_path / "F.mat")
    delays = ", 'OutputDelay', m.OutputDelay"
    assert delays in SS
    line = SS.replace(delays, "")
    grid = f"w = 2*pi*[{' '.join(map(repr, F.tolist()))}];"
    octave(
        f"{control}{line} {grid} H = freqresp(G, w); late = m.OutputDelay; save('-v7', 'out.mat', 'H', 'late')",
        tmp_path,
    )
    back = loadmat(tmp_path / "out.mat")
    lag = np.exp(-2j * np.pi * F[:, None] * back["late"].ravel())
    # scipy and SLICOT solve the same real system of some ten states
    np.testing.assert_allclose(back["H"][:, 0, :].T * lag, model.frf(F), rtol=1e-9)


RIG = """
addpath('{scripts}');
run = struct('Va', 0:19, 'sensors', struct('Vs', (19:-1:0)', 'de', 1e-6 * (1:20) / 3), 'note', 'x');
accept_export('run.mat', run, 1e-4);
"""


def test_a_run_of_the_rig_is_written_as_vectors_that_are_read(tmp_path: Path) -> None:
    """Signals in structures within structures; what is no signal is left out."""
    octave(RIG.format(scripts=ROOT / "hw/records/matlab"), tmp_path)
    record = accept.read_record(tmp_path / "run.mat")
    assert set(record.channels) == {"Va", "Vs", "de"}
    np.testing.assert_array_equal(record["Vs"], np.arange(19.0, -1.0, -1.0))
    np.testing.assert_allclose(record["de"], 1e-6 * np.arange(1.0, 21.0) / 3.0, rtol=1e-15)
    assert record.fs == pytest.approx(1e4, rel=1e-9)


def test_a_run_without_a_sampling_time_is_refused(tmp_path: Path) -> None:
    code = RIG.format(scripts=ROOT / "hw/records/matlab").replace(", 1e-4", "")
    words = ["octave-cli", "--norc", "--eval", code]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 1
    assert "Va has no time; give Ts" in done.stderr
    assert not (tmp_path / "run.mat").exists()
