"""Responses that a script has already - arrays, a dataset, an estimate - go into a fit and a misalignment."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import accept
from accept.gap.unit_responses import Responses
from checks.errors import RecordError
from hw.records import mat_bytes

F = np.geomspace(15.0, 600.0, 120)
TRUE = {"constants.ga_N_per_V": -34.0, "bench.payload_kg": 5.76}  # within a standard deviation of the priors
CHANNELS = ("Vs", "de", "da")


def arrays(relative: float = 0.005) -> tuple[np.ndarray, np.ndarray]:
    """H (F, 3) of a two-mass strut with other values than the model's, noise of half a percent, and its variance."""
    rng = np.random.default_rng(8)
    H = accept.open_model("strut-2dof").with_values(TRUE).frf(F)
    sd = relative * np.abs(H)
    noise = sd * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)) / np.sqrt(2.0)
    return H + noise, sd**2


def test_a_fit_of_arrays_finds_their_values() -> None:
    H, var = arrays()
    fitted = accept.fit_model(accept.dataset(F, H, CHANNELS, var), "strut-2dof")
    for name, true in TRUE.items():
        assert abs(fitted.fit.at[name] - true) < 4.0 * fitted.fit.sds[name], name  # 4 sd: one in 16,000
    assert fitted.measured.serial == "arrays"
    assert max(g.G for g in fitted.after.values()) < max(g.G for g in fitted.before.values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, None),
        ({"de": 1e6}, "de is 1e6 times what the model has: is it in another unit?"),
        ({"Vs": 1e-3}, "Vs is 1e-3 times what the model has: is it in another unit?"),
        ({"da": -1.0}, "da has the opposite sign of what the model has: check its polarity"),
        ({"da": 1.5}, "agreement is 1 or less"),
    ],
)
def test_doubt_is_the_reason_that_explains_is_false(change: dict[str, float], words: str | None) -> None:
    """Responses in um/V, a plug reversed, a scale that no value of the model has; and none of these."""
    H, var = arrays()
    scale = np.array([change.get(c, 1.0) for c in CHANNELS])
    fitted = accept.fit_model(accept.dataset(F, H * scale, CHANNELS, var * scale**2), "strut-2dof", starts=1)
    assert fitted.explains == (words is None)
    assert (fitted.doubt is None) if words is None else (words in (fitted.doubt or ""))
    assert ("do not use the values" in repr(fitted)) == (words is not None)


def test_a_dataset_and_the_responses_of_it_give_the_same_fit() -> None:
    H, var = arrays()
    data = accept.dataset(F, H, CHANNELS, var)
    one = accept.fit_model(data, "strut-2dof", starts=1)
    two = accept.fit_model(Responses("arrays", "strut", data, None, 0.0), "strut-2dof", starts=1)
    assert one.fit.at == two.fit.at


def test_an_estimate_of_a_record_goes_into_a_fit(tmp_path: Path) -> None:
    """White noise through the model's response: the estimate has the model's payload."""
    rng = np.random.default_rng(3)
    n, fs = 60_000, 3000.0
    u = 0.3 * rng.standard_normal(n)  # Vs stays within the converter
    f = np.fft.rfftfreq(n, 1 / fs)
    model = accept.open_model("strut-2dof").with_values(TRUE)
    H = np.zeros((f.size, 3), complex)
    inside = (f >= 2.0) & (f <= 1400.0)
    H[inside] = model.frf(f[inside])
    y = np.fft.irfft(H.T * np.fft.rfft(u), n)
    columns = {"t": np.arange(n) / fs, "Va": u} | {c: y[i] + 1e-4 * y[i].std() * rng.standard_normal(n) for i, c in
               enumerate(CHANNELS)}  # fmt: skip
    path = tmp_path / "r.mat"
    path.write_bytes(mat_bytes(columns))
    fitted = accept.fit_model(accept.frequency_response(path, estimator="lpm", f_lo=15, f_hi=600), "strut-2dof")
    # The estimate's own bias at the sharp resonance is within the tolerance of the model, 1 % of |H|.
    assert fitted.fit.at["bench.payload_kg"] == pytest.approx(5.76, rel=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"H": np.zeros((120, 2))}, r"H \(120, 2\); expected \(F,\) and \(F, 3\)"),
        ({"channels": ("Vs", "de", "dz")}, "channels has 'dz'; expected some of Vs, de, da"),
        ({"channels": ("Vs", "de", "de")}, "twice"),
        ({"var": np.ones(120)}, r"var has the shape \(120,\)"),
        ({"var": np.zeros((120, 3))}, "above zero"),
        ({"f": F[::-1]}, "rising"),
        ({"H": np.full((120, 3), np.nan)}, "finite"),
        ({"f": "none"}, "arrays of numbers"),
        ({"averages": float("nan")}, "two or more"),
    ],
)
def test_what_cannot_be_used_is_said(change: dict[str, object], words: str) -> None:
    H, var = arrays()
    given = {"f": F, "H": H, "channels": CHANNELS, "var": var} | change
    with pytest.raises(RecordError, match=words):
        accept.dataset(**given)


def test_every_unusable_argument_is_an_error_of_accept_in_words() -> None:
    H, var = arrays()
    data = accept.dataset(F, H, CHANNELS, var)
    vs = accept.dataset(F, H[:, :1], ("Vs",), var[:, :1])
    for call, words in (
        (lambda: accept.judge(5), "read_unit"),
        (lambda: accept.read_unit(None), "folder = None: expected a text"),
        (lambda: accept.read_record(3.0), "file = 3.0: expected a text"),
        (lambda: accept.frequency_response(), "name one record"),
        (
            lambda: accept.frequency_response("a.mat", "b.mat"),
            "2 records and no merge_Hz, so all but one would be left",
        ),
        (lambda: accept.analyse_gap(data), "needs the records of a unit"),
        (lambda: accept.estimate_misalignment(vs), "lacks de and da"),
        (lambda: accept.fit_model(data, "strut-2dof", starts=0), "starts = 0"),
        (lambda: accept.fit_model(data, "strut-2dof", f_lo=700, f_hi=800), "no two frequencies"),
        (lambda: accept.fit_model(data, "apa-2dof", f_lo=-1.0), "rising range"),
    ):
        with pytest.raises(accept.AcceptError, match=words):
            call()


def test_a_response_is_a_frame_and_without_xarray_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    u = rng.standard_normal(8000)
    path = tmp_path / "r.mat"
    path.write_bytes(mat_bytes({"t": np.arange(u.size) / 1e3, "Va": u, "de": 1e-6 * u}))
    response = accept.frequency_response(path)
    table = response.to_pandas()
    assert list(table.columns) == [("de", "H"), ("de", "coherence"), ("de", "var")]
    assert table.index.name == "f_Hz"
    np.testing.assert_array_equal(table["de", "H"].to_numpy(), response.frf.H[:, 0])
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(RecordError, match="pip install xarray"):
        response.to_xarray()


class FakeXarray(ModuleType):
    """As much of xarray as is called: what it is given, kept."""

    @staticmethod
    def Dataset(data: object, coords: object, attrs: object) -> tuple[object, object, object]:
        return data, coords, attrs


def test_the_dataset_of_xarray_has_units_and_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", FakeXarray("xarray"))
    rng = np.random.default_rng(1)
    u = rng.standard_normal(8000)
    path = tmp_path / "r.mat"
    path.write_bytes(mat_bytes({"t": np.arange(u.size) / 1e3, "Va": u, "de": 1e-6 * u}))
    data, coords, attrs = accept.frequency_response(path).to_xarray()
    assert data["H"][0] == ("f_Hz", "channel")
    assert data["H"][1].shape == (coords["f_Hz"].size, 1)
    assert coords["unit"] == ("channel", ["m/V"])
    assert attrs["input"] == "Va"
