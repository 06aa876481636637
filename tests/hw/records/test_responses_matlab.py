"""MATLAB files of responses: frd structs with every unit of frequency, delays and inputs; files of analysers that hold
spectra and records beside their responses."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import accept

F = np.arange(1.0, 301.0)
S = 2j * np.pi * F
H = 2e-6 * (2 * np.pi * 120) ** 2 / (S**2 + 2 * 0.01 * 2 * np.pi * 120 * S + (2 * np.pi * 120) ** 2)  # m/V
QUALITY = np.linspace(0.6, 0.99, F.size)
NOISE = np.random.default_rng(5).standard_normal(4096)


def cells(*words: str) -> np.ndarray:
    found = np.empty((len(words), 1), dtype=object)
    found[:, 0] = words
    return found


def frd(path: Path, **more: object) -> Path:
    fields = {"ResponseData": H[None, None, :], "Frequency": F[:, None], "FrequencyUnit": "Hz",
              "InputName": cells("Va"),
              "OutputName": cells("de"), "InputUnit": cells("V"), "OutputUnit": cells("m")}  # fmt: skip
    savemat(path, {"G": {k: v for k, v in (fields | more).items() if v is not None}})
    return path


UNITS = {
    "Hz": ({"FrequencyUnit": "Hz"}, 1.0),
    "kHz": ({"FrequencyUnit": "kHz"}, 1e-3),
    "MHz": ({"FrequencyUnit": "MHz"}, 1e-6),
    "GHz": ({"FrequencyUnit": "GHz"}, 1e-9),
    "rad/s": ({"FrequencyUnit": "rad/s"}, 2 * np.pi),
    "rpm": ({"FrequencyUnit": "rpm"}, 60.0),
    "default": ({"FrequencyUnit": None}, 2 * np.pi),
    "rad/TimeUnit": ({"FrequencyUnit": "rad/TimeUnit"}, 2 * np.pi),
    "rad/TimeUnit of ms": ({"FrequencyUnit": "rad/TimeUnit", "TimeUnit": "milliseconds"}, 2e-3 * np.pi),
    "cycles/TimeUnit of minutes": ({"FrequencyUnit": "cycles/TimeUnit", "TimeUnit": "minutes"}, 60.0),
    "rad/minute": ({"FrequencyUnit": "rad/minute"}, 120 * np.pi),
}


@pytest.mark.parametrize("case", UNITS)
def test_every_unit_of_frequency_of_frd_is_used(case: str, tmp_path: Path) -> None:
    more, scale = UNITS[case]
    found = accept.read_response(frd(tmp_path / "a.mat", Frequency=scale * F[:, None], **more))
    np.testing.assert_allclose(found.frf.f, F, rtol=1e-12)
    np.testing.assert_allclose(found.frf.H[:, 0], H, rtol=1e-12)
    assert (found.frf.channels, found.frf.input) == (("de",), "Va")


@pytest.mark.parametrize(
    ("more", "tau"),
    [
        ({"IODelay": 2e-4}, 2e-4),
        ({"InputDelay": 1e-4, "OutputDelay": 3e-4}, 4e-4),
        ({"OutputDelay": 0.3, "TimeUnit": "milliseconds"}, 3e-4),
        ({"IODelay": 3.0, "Ts": 1e-4}, 3e-4),  # of a sampled one in samples
        ({"Ts": -1.0}, 0.0),
    ],
)
def test_delays_beside_the_data_are_applied(more: dict, tau: float, tmp_path: Path) -> None:
    found = accept.read_response(frd(tmp_path / "a.mat", **more))
    np.testing.assert_allclose(found.frf.H[:, 0], H * np.exp(-S * tau), rtol=1e-12)


CUBE = np.stack([np.stack([H, 3 * H]), np.stack([2 * H, 4 * H])])  # (outputs, inputs, F)


def test_of_two_inputs_the_named_one_is_taken(tmp_path: Path) -> None:
    two = {"ResponseData": CUBE, "InputName": cells("Va", "force"), "OutputName": cells("de", "da"),
           "InputUnit": cells("V", "N"), "OutputUnit": cells("m", "um")}  # fmt: skip
    path = frd(tmp_path / "a.mat", **two)
    with pytest.raises(accept.AcceptError, match=r"2 inputs \(Va, force\); name one of them with --input"):
        accept.read_response(path)
    found = accept.read_response(path, input="force")
    np.testing.assert_allclose(found.frf.H, np.column_stack([3 * H, 4e-6 * H]), rtol=1e-12)
    assert found.ratios == {"de": "m/N", "da": "m/N"}
    with pytest.raises(accept.AcceptError, match="2 inputs without names"):
        accept.read_response(frd(tmp_path / "b.mat", **two | {"InputName": cells("", "")}))


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "unit of frequency": ({"FrequencyUnit": "furlong"}, "expected Hz"),
    "unit of time": ({"FrequencyUnit": "rad/TimeUnit", "TimeUnit": "moons"}, "unit of time is 'moons'"),
    "above half of the sampling's": ({"Ts": 1 / 400}, "above half of the sampling's"),
    "real": ({"ResponseData": np.abs(H)[None, None, :]}, "no phase"),
    "length": ({"Frequency": F[:-1, None]}, "1 x 1 x 300 for 299 frequencies"),
    "names": ({"OutputName": cells("de", "da")}, "2 names of outputs for 1"),
    "output in N": ({"OutputUnit": cells("N")}, "does not fit"),
    "input in N": ({"InputUnit": cells("N")}, "'Va' has the unit N"),
    "coherence": ({"Coherence": 100 * QUALITY}, "is it in percent"),
    "length of coherence": ({"Coherence": QUALITY[:-1]}, "299 values"),
    "variance": ({"Variance": -QUALITY}, "not negative"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_frd_that_contradicts_itself_is_refused(case: str, tmp_path: Path) -> None:
    more, words = REFUSED[case]
    with pytest.raises(accept.AcceptError, match=words):
        accept.read_response(frd(tmp_path / "a.mat", **more))


def test_frd_of_matlab_73(tmp_path: Path) -> None:
    """As MATLAB 7.3 stores a struct: groups, names as characters in UTF-16, the last dimension first."""
    compound = np.dtype([("real", "f8"), ("imag", "f8")])
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as f:
        x = np.empty((F.size, 1, 1), compound)
        x["real"], x["imag"] = H.real[:, None, None], H.imag[:, None, None]
        f["G/ResponseData"], f["G/Frequency"] = x, 1e-3 * F[None, :]
        for name, word in (("FrequencyUnit", "kHz"), ("OutputName", "de"), ("InputName", "Va"), ("OutputUnit", "m")):
            f[f"G/{name}"] = np.frombuffer(word.encode("utf-16-le"), "<u2")[:, None]
            f[f"G/{name}"].attrs["MATLAB_class"] = np.bytes_("char")
    found = accept.read_response(tmp_path / "a.mat")
    np.testing.assert_allclose(found.frf.f, F, rtol=1e-12)
    np.testing.assert_allclose(found.frf.H[:, 0], H, rtol=1e-12)
    assert (found.frf.channels, found.units["de"]) == (("de",), "m")


def bobcat(path: Path) -> Path:
    """The variables of an analyser that writes spectra beside its responses."""
    rng = np.random.default_rng(7)
    spectrum = rng.standard_normal((2, F.size)) + 1j * rng.standard_normal((2, F.size))
    savemat(path, {
        "Freq_domain": F, "Time_domain": np.arange(4096) / 2000, "Time_chan_1": NOISE, "Time_chan_2": NOISE,
        "PSD_chan_1": np.abs(spectrum[0]) ** 2, "PSD_chan_2": np.abs(spectrum[1]) ** 2,
        "Hf_Cross_Spec_chan_2": spectrum[0], "Hf_Cross_Spec_chan_3": spectrum[1],
        "Hf_chan_2": H, "Hf_chan_3": 2 * H, "Hf_coh_chan_2": QUALITY, "Hf_coh_chan_3": QUALITY[::-1],
    })  # fmt: skip
    return path


def test_spectra_beside_a_response_are_left(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = accept.read_response(bobcat(tmp_path / "a.mat"), averages=10)
    assert found.frf.channels == ("Hf_chan_2", "Hf_chan_3")
    np.testing.assert_allclose(found.frf.H, np.column_stack([H, 2 * H]), rtol=1e-12)
    np.testing.assert_allclose(found.frf.coherence, np.column_stack([QUALITY, QUALITY[::-1]]), rtol=1e-12)
    assert "left out, no responses: " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("names", "coherence"),
    [
        (("H1_2", "H1_3"), "C1_{}"), (("H2_1", "H2_5"), "C2_{}"), (("FRF_2", "FRF_3"), "Coh_{}"),
        (("H_2", "H_3"), "coherence_{}"), (("Hv_2", "Hv_3"), "C1_{}"), (("de", "da"), "{}_coh"),
    ],
)  # fmt: skip
def test_names_of_responses_and_their_coherence(names: tuple[str, str], coherence: str, tmp_path: Path) -> None:
    keys = [n if n in ("de", "da") else n.rpartition("_")[2] for n in names]
    quality = {coherence.format(k): q for k, q in zip(keys, (QUALITY, QUALITY[::-1]), strict=True)}
    savemat(tmp_path / "a.mat", {"freq": F, names[1]: 2 * H, names[0]: H, "Gxy": 5 * H, "S1": 7 * H, **quality})
    found = accept.read_response(tmp_path / "a.mat").frf
    order = [found.channels.index(n) for n in names]
    assert len(found.channels) == 2
    np.testing.assert_allclose(found.H[:, order], np.column_stack([H, 2 * H]), rtol=1e-12)
    np.testing.assert_allclose(found.coherence[:, order], np.column_stack([QUALITY, QUALITY[::-1]]), rtol=1e-12)


@pytest.mark.parametrize(
    ("variables", "words"),
    [
        ({"freq": F, "U": H, "Y": H}, "U, Y: no response by name"),
        ({"freq": F, "Hf_Cross_Spec_chan_2": H}, "no response by name"),
        ({"freq": F, "H": np.abs(H)}, "no phase"),
        ({"w": F, "H": H}, "rad/s or per sample"),
        ({"f": F, "w": F, "H": H}, "contradict each other"),
        ({"w": F, "mag": np.abs(H), "phase": np.angle(H)}, "a magnitude has no phase"),
        ({"freq": F, "freq_kHz": F, "H": H}, "contradict each other"),
        ({"freq": F, "H1_2": H, "H2_3": H}, "channels 1, 2"),
        ({"freq": F, "H1_2": H, "C1_2": 100 * QUALITY}, "is it in percent"),
        ({"H1_2": np.column_stack([F, H]), "C1_2": np.column_stack([F + 0.5, QUALITY])}, "other frequencies"),
        ({"H1_2": np.column_stack([F, H]), "H1_3": np.column_stack([F + 0.5, H])}, "other frequencies"),
        ({"freq": F, "x": NOISE}, "no complex values"),
    ],
)
def test_what_is_no_response_is_refused(variables: dict, words: str, tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", variables)
    with pytest.raises(accept.AcceptError, match=words):
        accept.read_response(tmp_path / "a.mat")


def analyser(path: Path, reference: int, outputs: tuple[int, ...], **more: object) -> Path:
    """Every variable a pair of axis and values: records, spectra, responses per newton, coherences, with the list of
    signals."""
    lines, t = np.arange(1601) * 0.125, (np.arange(4096) - 5) / 512.0
    found: dict[str, object] = {}
    info = []
    for k in (reference, *outputs):
        found[f"X{k}"] = np.column_stack([t, NOISE * k])
        found[f"S{k}"] = np.column_stack([lines, np.exp(1j * lines) * k])
        found[f"G{k}_{k}"] = np.column_stack([lines, np.full(lines.size, float(k))])
        info += [f"Signal X{k}", "Real EU g", "0-Z:0-Z"]
    s = 2j * np.pi * lines
    for k in outputs:
        h = k * s**2 / (s**2 + 2 * 0.02 * 2 * np.pi * 50 * s + (2 * np.pi * 50) ** 2)
        found[f"S{reference}_{k}"] = np.column_stack([lines, h * 3])
        found[f"H{reference}_{k}"] = np.column_stack([lines, h])
        found[f"C{reference}_{k}"] = np.column_stack([lines, np.linspace(0.1 * k, 1.0, lines.size)])
        found[f"Z{reference}_{k}"] = np.column_stack([t, NOISE])
        info += [
            f"Signal H{reference}_{k}",
            "Real/Imag g / N",
            "0-Z:0-Z",
            f"Signal C{reference}_{k}",
            "Mag EU",
            "0-Z:0-Z",
        ]
    savemat(path, {**found, "DP_Info": np.array(info), **more})
    return path


@pytest.mark.parametrize(("reference", "outputs"), [(1, (2, 3, 4)), (3, (1, 2)), (2, (7,))])
def test_pairs_of_an_analyser(reference: int, outputs: tuple[int, ...], tmp_path: Path) -> None:
    found = accept.read_response(analyser(tmp_path / "a.mat", reference, outputs), averages=5)
    assert found.frf.channels == tuple(f"H{reference}_{k}" for k in outputs)
    assert (found.frf.input, set(found.ratios.values())) == ("force", {"g/N"})
    assert found.frf.f.size == 1601
    for i, k in enumerate(outputs):
        np.testing.assert_allclose(found.frf.coherence[:, i], np.linspace(0.1 * k, 1.0, 1601), rtol=1e-12)
        assert abs(found.frf.H[-1, i]) == pytest.approx(
            k * 200**2 / abs(50**2 - 200**2 + 2j * 0.02 * 50 * 200), rel=1e-9
        )
    with pytest.raises(accept.AcceptError, match="unit g, which does not fit"):
        accept.read_response(tmp_path / "a.mat", channels={"de": f"H{reference}_{outputs[0]}"})


def test_pairs_alone_keep_their_coherence(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"H1_2": np.column_stack([F, H]), "C1_2": np.column_stack([F, QUALITY])})
    found = accept.read_response(tmp_path / "a.mat", averages=20)
    np.testing.assert_allclose(found.frf.coherence[:, 0], QUALITY)
    assert np.isfinite(found.frf.var).all()


def test_of_two_references_the_named_one_is_taken(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"freq": F, "H1_2": H, "H2_1": 2 * H, "H2_3": 3 * H})
    found = accept.read_response(tmp_path / "a.mat", input="2").frf
    assert (found.channels, found.input) == (("H2_1", "H2_3"), "Va")
    np.testing.assert_allclose(found.H, np.column_stack([2 * H, 3 * H]), rtol=1e-12)


def test_the_covariance_of_idfrd_is_used(tmp_path: Path) -> None:
    """CovarianceData (C, M, F, 2, 2) of real and imaginary part; Units as frd had it before 2012."""
    covariance = np.zeros((1, 1, F.size, 2, 2))
    covariance[0, 0, :, 0, 0], covariance[0, 0, :, 1, 1] = 1e-16, 3e-16
    more = {"CovarianceData": covariance, "FrequencyUnit": None, "Units": "Hz"}
    found = accept.read_response(frd(tmp_path / "a.mat", **more))
    np.testing.assert_allclose(found.frf.var, 4e-16)
    np.testing.assert_allclose(found.frf.f, F)


@pytest.mark.parametrize("name", ["f", "F", "freq_vec", "frequency", "Freq_Hz", "frq", "Freq_domain", "freqs"])
def test_names_of_frequencies(name: str, tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {name: F, "H": H})
    np.testing.assert_allclose(accept.read_response(tmp_path / "a.mat").frf.f, F)


def test_a_signal_without_phase_is_refused(tmp_path: Path) -> None:
    info = np.array(["Signal H1_2", "Mag g / N", "0-Z:0-Z"])
    savemat(tmp_path / "a.mat", {"H1_2": np.column_stack([F, H]), "DP_Info": info})
    with pytest.raises(accept.AcceptError, match="stated as 'Mag g / N'"):
        accept.read_response(tmp_path / "a.mat")


def test_units_by_channel(tmp_path: Path) -> None:
    """Without a list of signals the units of the channels, by their numbers, are used."""
    more = {"ChanNum": np.array([2, 5]), "Unit": np.array(["N", "mm"])}
    savemat(tmp_path / "a.mat", {"H2_5": np.column_stack([F, 1e3 * H]), **more})
    found = accept.read_response(tmp_path / "a.mat", channels={"de": "H2_5"})
    np.testing.assert_allclose(found.frf.H[:, 0], H, rtol=1e-12)
    assert found.ratios == {"de": "m/N"}
