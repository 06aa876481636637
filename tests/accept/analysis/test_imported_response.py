"""Responses of others come in, go into fit and misalignment, and go out to others with their names and units."""

import json
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import loadmat, savemat

import accept
from hw.records import mat_bytes
from hw.records.uff.write import frf_bytes
from tests.shared import command_line

run = partial(command_line.accept, code=0, columns=200)
F = np.arange(15.0, 601.0, 1.5)
CHANNELS = ("Vs", "de", "da")
SI = {"Va": "V", "Vs": "V", "de": "m", "da": "m"}
TRUE = {"constants.ga_N_per_V": -34.0, "bench.payload_kg": 5.76}


def response(relative: float = 0.005) -> np.ndarray:
    """H (F, 3) of a two-mass strut with noise of half a percent."""
    H = accept.open_model("strut-2dof").with_values(TRUE).frf(F)
    rng = np.random.default_rng(4)
    noise = relative * np.abs(H) * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)) / np.sqrt(2.0)
    return H + noise


H = response()
COHERENCE = 1.0 / (1.0 + 0.005**2 * 19) * np.ones(H.shape)  # of noise of 0.5 % after 20 averages


def universal(path: Path) -> Path:
    path.write_bytes(frf_bytes(F, H, CHANNELS, "Va", SI))
    return path


def universal_in_um(path: Path) -> Path:
    scale = np.array([1.0, 1e6, 1e6])
    path.write_bytes(frf_bytes(F, H * scale, CHANNELS, "Va", SI | {"de": "um", "da": "um"}))
    return path


def table(path: Path) -> Path:
    heads, columns = ["freq [Hz]"], [F]
    for i, (c, unit, scale) in enumerate((("Vs", "V/V", 1.0), ("de", "nm/V", 1e9), ("da", "um/V", 1e6))):
        heads += [f"{c} re [{unit}]", f"{c} im [{unit}]"]
        columns += [scale * H[:, i].real, scale * H[:, i].imag]
    np.savetxt(path, np.column_stack(columns), delimiter=";", header=";".join(heads), comments="", fmt="%.17g")
    path.write_text(path.read_text().replace(".", ","))  # as a German spreadsheet writes it
    return path


def analyser(path: Path) -> Path:
    more = {f"H1_{i + 2}": H[:, i] for i in range(3)} | {f"C1_{i + 2}": COHERENCE[:, i] for i in range(3)}
    savemat(path, {"freq": F, "X1": np.arange(7.0), **more})
    return path


def newer_matlab(path: Path) -> Path:
    compound = np.dtype([("real", "f8"), ("imag", "f8")])
    with h5py.File(path, "w", userblock_size=512) as f:
        f["freq"] = F[None, :]
        x = np.empty(H.T.shape, compound)
        x["real"], x["imag"] = H.T.real, H.T.imag
        f["H"] = x
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    return path


NAMED = {"Vs": "H1_2", "de": "H1_3", "da": "H1_4"}
CASES = {
    "uff": (universal, {}, 1e-9),
    "uff, um": (universal_in_um, {}, 1e-9),
    "table": (table, {}, 1e-9),
    "analyser": (analyser, {"channels": NAMED}, 1e-12),
    "7.3": (newer_matlab, {"channels": {"Vs": "H[1]", "de": "H[2]", "da": "H[3]"}}, 1e-12),
}


@pytest.mark.parametrize("case", CASES)
def test_responses_of_others_come_in_with_their_units(case: str, tmp_path: Path) -> None:
    write, words, tolerance = CASES[case]
    ending = {"uff": "uff", "table": "csv"}.get(case.split(",", maxsplit=1)[0], "mat")
    found = accept.read_response(write(tmp_path / f"a.{ending}"), "Va", **words)
    assert found.frf.channels == CHANNELS
    assert found.ratios == {"Vs": "V/V", "de": "m/V", "da": "m/V"}
    np.testing.assert_allclose(found.frf.f, F, rtol=1e-6)
    np.testing.assert_allclose(found.frf.H, H, rtol=tolerance * 10)
    assert np.isnan(found.frf.var).all()  # no file states it: not invented
    assert len(repr(found)) < 300
    assert accept.plot(found).panels["de magnitude"]
    with pytest.raises(accept.AcceptError, match="states no noise"):
        accept.fit_model(found, "strut-2dof")


def test_an_imported_response_is_fitted_with_the_noise_that_is_known(tmp_path: Path) -> None:
    for found in (
        accept.read_response(analyser(tmp_path / "a.mat"), channels=NAMED, averages=20),
        accept.read_response(universal(tmp_path / "a.uff"), noise=0.005),
    ):
        sd = np.sqrt(found.frf.var) / np.abs(found.frf.H)
        np.testing.assert_allclose(sd, 0.005, rtol=1e-3)
        fitted = accept.fit_model(found, "strut-2dof")
        for name, true in TRUE.items():
            assert abs(fitted.fit.at[name] - true) < 4.0 * fitted.fit.sds[name], name  # one in 16,000
        assert fitted.held_out == {}  # no second realisation


def measured(tmp_path: Path) -> accept.analysis.record_responses.MeasuredResponse:
    rng = np.random.default_rng(1)
    u = rng.standard_normal(20_000)
    y = np.convolve(u, [3e-6, 2e-6])[: u.size] + 1e-8 * rng.standard_normal(u.size)
    path = tmp_path / "r.mat"
    path.write_bytes(mat_bytes({"t": np.arange(u.size) / 2e3, "Va": u, "de": y, "Vs": 2e5 * y}))
    return accept.frequency_response(path, f_lo=10.0, f_hi=800.0)


@pytest.mark.parametrize("ending", ["csv", "mat", "uff", "json"])
def test_what_is_written_comes_back(ending: str, tmp_path: Path) -> None:
    made = measured(tmp_path)
    back = accept.read_response(made.save(tmp_path / f"out.{ending}"), "Va")
    order = [back.frf.channels.index(c) for c in made.frf.channels]
    np.testing.assert_allclose(back.frf.f, made.frf.f, rtol=1e-6)
    np.testing.assert_allclose(back.frf.H[:, order], made.frf.H, rtol=1e-11)
    assert back.units == made.units
    assert back.frf.input == "Va"
    np.testing.assert_allclose(back.frf.coherence[:, order], made.frf.coherence, rtol=1e-11)  # 13 digits in a .uff
    np.testing.assert_allclose(back.frf.var[:, order], made.frf.var, rtol=1e-9)
    if ending != "csv":  # which has no place for the averages
        np.testing.assert_allclose(back.frf.nu, made.frf.nu, rtol=1e-9)


def test_a_universal_file_is_fitted_with_its_noise(tmp_path: Path) -> None:
    """Coherence, variance and averages come back, so that the fit of the file is that of the response."""
    given = accept.read_response(analyser(tmp_path / "a.mat"), channels=NAMED, averages=20)
    back = accept.read_response(given.save(tmp_path / "a.uff"))
    np.testing.assert_allclose(back.frf.coherence, given.frf.coherence, rtol=1e-11)
    np.testing.assert_allclose(back.frf.var, given.frf.var, rtol=1e-11)
    np.testing.assert_array_equal(back.frf.nu, given.frf.nu)
    first, second = (accept.fit_model(each, "strut-2dof").fit for each in (given, back))
    for name in TRUE:
        assert second.sds[name] == pytest.approx(first.sds[name], rel=1e-3), name
        assert abs(second.at[name] - first.at[name]) < 0.01 * first.sds[name], name  # frequencies of seven digits


def test_pyuff_reads_what_is_written(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    made = measured(tmp_path)
    path = made.save(tmp_path / "a.uff")
    sets = pyuff.UFF(str(path)).read_sets()
    assert [each["func_type"] for each in sets] == [4, 6, 0] * len(made.frf.channels)
    for i, c in enumerate(made.frf.channels):
        assert [each["rsp_ent_name"] for each in sets[3 * i : 3 * i + 3]] == [c] * 3
        np.testing.assert_allclose(sets[3 * i]["data"], made.frf.H[:, i], rtol=1e-11)
        np.testing.assert_allclose(sets[3 * i + 1]["data"], made.frf.coherence[:, i], rtol=1e-11)
        np.testing.assert_allclose(sets[3 * i + 2]["data"], made.frf.var[:, i], rtol=1e-11)


def test_the_matlab_struct_has_the_fields_of_frd(tmp_path: Path) -> None:
    """frd(r.ResponseData, r.Frequency, 'FrequencyUnit', r.FrequencyUnit, ...) takes C x 1 x F and F frequencies."""
    made = measured(tmp_path)
    path = made.save(tmp_path / "out.mat")
    whole = loadmat(path)["response"][0, 0]
    assert whole["ResponseData"].shape == (len(made.frf.channels), 1, made.frf.f.size)
    r = loadmat(path, simplify_cells=True)["response"]
    assert r["FrequencyUnit"] == "Hz"
    assert list(r["OutputName"]) == list(made.frf.channels)
    assert r["InputName"] == "Va"
    assert list(r["OutputUnit"]) == [made.units[c] for c in made.frf.channels]


def test_python_control_takes_the_response(tmp_path: Path) -> None:
    control = pytest.importorskip("control")
    made = measured(tmp_path)
    found = made.to_control()
    assert isinstance(found, control.FrequencyResponseData)
    assert found.output_labels == list(made.frf.channels)
    np.testing.assert_array_equal(found.frdata[:, 0, :].T, made.frf.H)
    np.testing.assert_allclose(found.omega, 2 * np.pi * made.frf.f)


@pytest.mark.parametrize(
    ("write", "words"),
    [
        (lambda p: p.write_text("f,de\n1,2\n2,3\n"), "no pair of columns"),
        (lambda p: p.write_text("x,de_re,de_im\n1,2,3\n2,3,4\n"), "no column of frequencies"),
        (lambda p: p.write_text("f,de_re [m/V],de_im [um/V]\n1,2,3\n2,3,4\n"), "two units"),
        (lambda p: p.write_text("f,de_re [V/V],de_im [V/V]\n1,2,3\n2,3,4\n"), "does not fit"),
        (lambda p: p.write_text("f,de_re,de_im\n2,2,3\n2,3,4\n"), "none of them twice"),
        (lambda p: p.write_text("f,de_re,de_im\n1,2,nan\n2,3,4\n"), "NaN"),
        (lambda p: p.write_text(""), "empty"),
    ],
)
def test_what_is_no_response_is_refused_in_words(write, words: str, tmp_path: Path) -> None:
    write(tmp_path / "x.csv")
    with pytest.raises(accept.AcceptError, match=words):
        accept.read_response(tmp_path / "x.csv", "Va")


def test_arguments_that_cannot_be_are_refused(tmp_path: Path) -> None:
    path = universal(tmp_path / "a.uff")
    for words, said in (
        ({"averages": 1}, "two or more"),
        ({"noise": -0.1}, "between 0 and 1"),
        ({"channels": {"de": "nowhere"}}, None),
    ):
        if said:
            with pytest.raises(accept.AcceptError, match=said):
                accept.read_response(path, **words)
    with pytest.raises(accept.AcceptError, match="no such file"):
        accept.read_response(tmp_path / "nowhere.uff")


def test_commands_take_files_of_responses(tmp_path: Path) -> None:
    """Its own export as CSV with a noise goes into the fit; the gap analysis says what is missing."""
    run(
        "frf",
        universal(tmp_path / "a.uff"),
        "--noise",
        0.005,
        "--csv",
        tmp_path / "b.csv",
        "--plot",
        tmp_path / "b.png",
    )
    done = run("model", "fit", tmp_path / "b.csv", "--model", "strut-2dof", "--json", tmp_path / "fit.json")
    document = json.loads((tmp_path / "fit.json").read_text())
    payload = document["parameters"]["bench.payload_kg"]
    assert abs(payload["value"] - 5.76) < 2.0 * payload["U"]
    assert document["gap_held_out"] == {}
    assert "explains b.csv" in done.stdout
    found = run("gap", tmp_path / "b.csv", "--out", tmp_path / "gap", code=6)
    assert "second realisation" in found.stderr
    assert "take a file of responses" in found.stderr
    found = run("model", "fit", universal(tmp_path / "c.uff"), "--model", "strut-2dof", code=6)
    assert "states no noise" in found.stderr


def test_a_response_is_compared_with_that_of_an_analyser(tmp_path: Path) -> None:
    made = measured(tmp_path)
    theirs = accept.read_response(made.save(tmp_path / "own.csv"))
    shifted = made.frf.H * np.array([1.0, 1.03])[[made.frf.channels.index(c) for c in made.frf.channels]]
    (tmp_path / "other.uff").write_bytes(frf_bytes(made.frf.f, shifted, made.frf.channels, "Va", SI))
    out = tmp_path / "c.json"
    run("frf", tmp_path / "own.csv", "--against", tmp_path / "other.uff", "--json", out, "--plot", tmp_path / "c.svg")
    apart = {d["channel"]: d for d in json.loads(out.read_text())["differences"]}
    first, second = made.frf.channels
    assert apart[first]["median"] < 1e-9
    assert apart[second]["median"] == pytest.approx(1.0 - 1.0 / 1.03, rel=1e-6)
    assert apart[first]["agreeing"] is None  # the universal file states no noise
    assert theirs.frf.f.size == apart[first]["bins"]
