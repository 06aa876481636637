"""The state space of a model is its response, delays beside it, and goes to others with its names."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from typer.testing import CliRunner

import accept
from accept.cli.main import app

F = np.geomspace(1.0, 2000.0, 200)


@pytest.mark.parametrize("name", ["strut", "strut-2dof", "apa-frame", "apa-2dof"])
def test_the_matrices_are_the_response(name: str) -> None:
    found = accept.to_ss(name)
    truth = accept.open_model(name).frf(F)
    assert np.abs(found.frf(F) / truth - 1.0).max() < 1e-8  # in double precision, at zeros too
    assert np.linalg.eigvals(found.A).real.max() < 0.0
    assert len(repr(found)) < 200


def test_electronics_and_delays_are_in_it() -> None:
    changes = {"delay.tau_us": 40.0, "bench.latency_de_us": 15.0, "sensor_highpass.f_Hz": 5.0}
    model = accept.open_model("strut")
    model = model.with_values({n: v for n, v in changes.items() if n in model.values})
    found = accept.to_ss(model)
    assert np.abs(found.frf(F) / model.frf(F) - 1.0).max() < 1e-8
    late = dict(zip(found.outputs, found.delay_s, strict=True))
    assert late["de"] == pytest.approx(55e-6)
    assert late["da"] == pytest.approx(40e-6)


def test_python_control_gives_the_same_response() -> None:
    pytest.importorskip("control")
    found = accept.to_ss("strut-2dof")
    system = accept.to_control(found)
    assert list(system.output_labels) == ["Vs", "de", "da"]
    np.testing.assert_allclose(system(2j * np.pi * F)[:, 0].T, found.frf(F), rtol=1e-8)
    model = accept.open_model("strut-2dof").with_values({"delay.tau_us": 40.0})
    late = accept.to_ss(model)
    with pytest.raises(accept.AcceptError, match="pade=2"):
        accept.to_control(late)
    low = F[F < 700.0]
    approximated = accept.to_control(late, pade=4)(2j * np.pi * low)[:, 0].T
    np.testing.assert_allclose(approximated, model.frf(low), rtol=1e-6)


def test_the_matlab_struct_has_what_ss_takes(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["model", "export", "--model", "apa-2dof", "--out", str(tmp_path / "m.mat")])
    assert done.exit_code == 0, done.output
    m = loadmat(tmp_path / "m.mat", simplify_cells=True)["model"]
    s = 2j * np.pi * 50.0
    H = m["C"] @ np.linalg.solve(s * np.eye(len(m["A"])) - m["A"], np.reshape(m["B"], (-1, 1)))
    truth = accept.open_model("apa-2dof").frf([50.0])[0]
    np.testing.assert_allclose(H[:, 0] + m["D"], truth, rtol=1e-9)
    assert list(m["OutputName"]) == ["Vs", "de", "da"]
    assert list(m["OutputUnit"]) == ["V", "m", "m"]
    with pytest.raises(accept.AcceptError, match=r"\.mat"):
        accept.save_ss(accept.to_ss("apa-2dof"), tmp_path / "m.txt")
    with pytest.raises(accept.AcceptError, match="not a str"):
        accept.to_control("apa-2dof")


def test_a_models_response_goes_out_and_comes_back(tmp_path: Path) -> None:
    for ending in ("mat", "uff", "csv"):
        path = tmp_path / f"h.{ending}"
        words = ["model", "frf", "--model", "strut-2dof", "--points", "50", f"--{ending}", str(path)]
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 0, done.output
        back = accept.read_response(path)
        assert back.frf.channels == ("Vs", "de", "da")
        truth = accept.open_model("strut-2dof").frf(back.frf.f)
        np.testing.assert_allclose(back.frf.H, truth, rtol=1e-3)  # 7 digits of f in a universal file, at sharp peaks
