"""MATLAB files of analysers: tracks with their resolution, and functions as pairs [axis, value]."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from tests.statements.case import Case, cell, compare
from tests.statements.plant import H_force, hits
from tests.statements.test_mat import save


def analyser(steps: dict[str, float], made: dict[str, np.ndarray] | None = None) -> dict[str, Any]:
    made = hits() if made is None else made
    return {"Track1": made["force"], "Track2": made["x"], **steps}


@cell("Analyser", "increment", "hits: `Track1_X_Resolution`")
def test_hits(case: Case) -> None:
    path = save(case, analyser({"Track1_X_Resolution": 1 / 2048.0}))
    case.frf(path, words=["Track1_X_Resolution"], H=H_force, options=["--hammer"], within=0.01)
    assert case.outcome == {"used"}


@cell("Analyser", "increment", "hits: `Track1_X_Resolution` and `Track2_X_Resolution` differ")
def test_hits_with_two_resolutions(case: Case) -> None:
    path = save(case, analyser({"Track1_X_Resolution": 1 / 2048.0, "Track2_X_Resolution": 1 / 1024.0}))
    case.frf(path, words=["Track2_X_Resolution"], H=None, options=["--hammer"])


@cell("Analyser", "start", "hits: `Track2_X_Offset` of 5 ms, none for Track1")
def test_hits_with_an_offset(case: Case) -> None:
    made = hits()
    shift = 10
    made = {"force": made["force"][:-shift], "x": made["x"][shift:]}
    said = {"Track1_X_Resolution": 1 / 2048.0, "Track2_X_Resolution": 1 / 2048.0}
    path = save(case, analyser({**said, "Track1_X_Offset": 0.0, "Track2_X_Offset": shift / 2048.0}, made))
    case.frf(path, words=["offset", "start"], H=H_force, options=["--hammer"], within=0.01)


FULL = 1.0  # block of the made analyser [s]
PRE = 0.01  # before the trigger [s]


def pairs(unit: str = "m/s^2") -> dict[str, Any]:
    """Return one hit with two responses as an analyser stores it: X recorded, S spectra, G mean spectra, H1, C1."""
    rate = 2048.0
    t = np.arange(int(rate * FULL)) / rate - PRE
    f = np.arange(int(rate * FULL / 2.56) + 1) / FULL
    long = np.arange(8 * t.size) / rate
    force = np.where((long >= PRE) & (long < PRE + 0.003), 90.0 * np.sin(np.pi * (long - PRE) / 0.003), 0.0)
    lines = np.fft.rfftfreq(long.size, 1 / rate)
    F = np.fft.rfft(force)
    x = {1: force[: t.size]}
    H = {2: H_force, 3: lambda g: 0.5 * H_force(g)}
    for k, truth in H.items():
        acceleration = -((2 * np.pi * lines) ** 2) * truth(lines)
        x[k] = np.fft.irfft(acceleration * F, long.size)[: t.size]
    made: dict[str, Any] = {
        "ChanNum": np.array([[1], [2], [3]], dtype=np.uint8),
        "Unit": np.array(["N", unit, unit]),
        "ChanName": np.array(["I1", "I2", "I3"]),
        "DP_Info": np.array(["Signal X1", "Real EU N", "0-Z:0-Z"]),
    }
    spectrum = {k: np.fft.rfft(v)[: f.size] / t.size for k, v in x.items()}
    for k in x:
        made[f"X{k}"] = np.column_stack([t, x[k]])
        made[f"W{k}"] = made[f"X{k}"]
        made[f"S{k}"] = np.column_stack([f.astype(complex), spectrum[k]])
        made[f"G{k}_{k}"] = np.column_stack([f, np.abs(spectrum[k]) ** 2])
    for k, truth in H.items():
        made[f"G1_{k}"] = np.column_stack([f.astype(complex), np.conj(spectrum[1]) * spectrum[k]])
        made[f"H1_{k}"] = np.column_stack([f.astype(complex), -((2 * np.pi * f) ** 2) * truth(f)])
        made[f"C1_{k}"] = np.column_stack([f, np.full(f.size, 0.97 if k == 2 else 0.96)])
    return made


def accelerance(part: float) -> Any:
    return lambda f: -part * (2 * np.pi * f) ** 2 * H_force(f)


def stored(case: Case, path: Path, factor: float = 1.0) -> None:
    """Read all responses with their coherence, in the file's unit or in SI, per newton and without --input."""
    code, said = case.run("frf", path, "--json", case.path("a.json"))
    if code == 6:
        case.refused(said, ["H1_2", "axis", "pair"])
        return

    (answer,) = json.loads(case.path("a.json").read_text())["responses"]
    assert len(answer["H"]) == 2, list(answer["H"])
    f = np.array(answer["f_Hz"])
    assert (f[0], f[-1], f.size) == (0.0, 800.0, 801)
    band = (f > 20.0) & (f < 700.0)
    for (channel, values), part, coherence in zip(answer["H"].items(), (1.0, 0.5), (0.97, 0.96), strict=True):
        H = np.array(values["re"])[band] + 1j * np.array(values["im"])[band]
        ratio = H / accelerance(part)(f[band])
        assert np.allclose(ratio, 1.0, rtol=1e-6) or np.allclose(ratio, factor, rtol=1e-4), (channel, ratio[:3])
        assert np.allclose(np.array(answer["coherence"][channel], dtype=float)[band], coherence)
    assert answer["units"][answer["input"]] == "N", answer["units"]
    case.used()


@cell("Analyser", "kind", "pairs [axis, value]: X, W, S, G, H1, C1 in one file")
def test_pairs(case: Case) -> None:
    stored(case, save(case, pairs()))


@cell("Analyser", "kind", "pairs [axis, value]: H1 and C1 alone")
def test_pairs_of_responses(case: Case) -> None:
    keep = ("H1", "C1", "Unit", "Chan")
    stored(case, save(case, {k: v for k, v in pairs().items() if k.startswith(keep)}))


@cell("Analyser", "unit", "pairs [axis, value]: Unit = g")
def test_pairs_in_g(case: Case) -> None:
    stored(case, save(case, pairs("g")), 9.80665)


@cell("Analyser", "start", "pairs [axis, value]: hits with 10 ms before the trigger")
def test_pairs_of_hits(case: Case) -> None:
    made = {k: v for k, v in pairs().items() if k[0] in "XUC" or k.startswith("Chan")}
    paths = [case.path(f"hit_{n}.mat") for n in range(3)]
    rng = np.random.default_rng(3)
    for path in paths:  # three hits of another strength each, with the noise of the inputs
        strength = 1.0 + 0.1 * rng.standard_normal()
        mine = {k: v.copy() for k, v in made.items()}
        for k in ("X1", "X2", "X3"):
            mine[k][:, 1] = strength * made[k][:, 1] + 1e-5 * np.abs(made[k]).max() * rng.standard_normal(len(made[k]))
        savemat(path, mine)
    out = case.path("hits.json")
    code, said = case.run("frf", "--hammer", *paths, "--input", "X1", "--json", out)
    if code == 6:
        case.refused(said, ["X1", "axis", "pair"])
        return
    (answer,) = json.loads(out.read_text())["responses"]
    assert [impact["good"] for impact in answer["impacts"]] == [True] * 3, said
    assert len(answer["H"]) == 2, list(answer["H"])
    f = np.array(answer["f_Hz"])
    for (channel, values), part in zip(answer["H"].items(), (1.0, 0.5), strict=True):
        # The decay of 19 1/s is cut after a second, where 1e-8 is left; noise of 1e-5 beside the weakest line is 1e-2.
        H = np.array(values["re"], dtype=float) + 1j * np.array(values["im"], dtype=float)
        compare(f, H, accelerance(part), 0.02, (40.0, 300.0), channel)
    case.used()
