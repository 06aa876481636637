"""Tables of responses as pandas, numpy, MATLAB and spreadsheets write them: dB and degrees, magnitude and phase,
complex numbers, units of frequencies, coherence and variance; each is used, or refused with the reason."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import accept
from accept.analysis.imported_response import ImportedResponse

F = np.arange(1.0, 301.0)
S = 2j * np.pi * F
H = 2e-6 * (2 * np.pi * 120) ** 2 / (S**2 + 2 * 0.01 * 2 * np.pi * 120 * S + (2 * np.pi * 120) ** 2)  # m/V
QUALITY = np.linspace(0.6, 0.99, F.size)
SIZE, DEG = np.abs(H), np.rad2deg(np.angle(H))


def table(path: Path, **columns: object) -> Path:
    """Write columns as pandas does; `|` of a name stands for what Python's names cannot hold."""
    pd.DataFrame(columns).to_csv(path, index=False)
    return path


def read(path: Path, **words: object) -> ImportedResponse:
    return accept.read_response(path, **words)


TAKEN = {
    "dB and degrees": {"f": F, "de_dB": 20 * np.log10(SIZE), "de_deg": DEG},
    "dB and radians": {"f": F, "de_dB": 20 * np.log10(SIZE), "de_rad": np.angle(H)},
    "dB re um": {"f [Hz]": F, "de_mag [dB re 1 um/V]": 20 * np.log10(1e6 * SIZE), "de_phase [deg]": DEG},
    "dB of nm": {"f [Hz]": F, "de_dB [nm/V]": 20 * np.log10(1e9 * SIZE), "de_phase [deg]": DEG},
    "magnitude and phase": {"f [Hz]": F, "de_mag [m/V]": SIZE, "de_phase [deg]": DEG},
    "unwrapped": {"f [Hz]": F, "de_abs [um/V]": 1e6 * SIZE, "de_phase [rad]": np.unwrap(np.angle(H)) - 4 * np.pi},
    "abs() and angle()": {"f [Hz]": F, "abs(de)": SIZE, "angle(de) [°]": DEG},
    "real() and imag()": {"f [Hz]": F, "real(de)": H.real, "imag(de)": H.imag},
    "complex of Python": {"f": F, "de": H},
    "complex of MATLAB": {"f": F, "de [um/V]": [f"{1e6 * h.real:.15g}{1e6 * h.imag:+.15g}i" for h in H]},
    "complex of numpy": {"f": F, "de": [f"({h.real:.17g}+{h.imag:.17g}j)" for h in H]},  # +- in a negative one
    "complex with spaces": {
        "f": F,
        "de": [f"{h.real:.17g} {'+' if h.imag >= 0 else '-'} {abs(h.imag):.17g}i" for h in H],
    },
    "words": {"f [Hertz]": F, "de_re [microns/Volt]": 1e6 * H.real, "de_im [microns/Volt]": 1e6 * H.imag},
    "rad/s": {"w [rad/s]": 2 * np.pi * F, "de_re [m/V]": H.real, "de_im [m/V]": H.imag},
    "rad/s in the name": {"omega_rad_s": 2 * np.pi * F, "de_re [m/V]": H.real, "de_im [m/V]": H.imag},
    "kHz": {"Frequency (kHz)": F / 1e3, "de_re [um/V]": 1e6 * H.real, "de_im [um/V]": 1e6 * H.imag},
    "rpm": {"speed [rpm]": 60 * F, "de_re [um/V]": 1e6 * H.real, "de_im [um/V]": 1e6 * H.imag},
    "f and w that agree": {"f [Hz]": F, "w [rad/s]": 2 * np.pi * F, "de_re": H.real, "de_im": H.imag},
    "falling": {"f": F[::-1], "de_re": H.real[::-1], "de_im": H.imag[::-1]},
}


@pytest.mark.parametrize("case", TAKEN)
def test_a_table_is_read_by_its_header(case: str, tmp_path: Path) -> None:
    found = read(table(tmp_path / "a.csv", **TAKEN[case]))
    assert found.frf.channels == ("de",)
    assert (found.frf.input, found.units) == ("Va", {"Va": "V", "de": "m"})
    np.testing.assert_allclose(found.frf.f, F, rtol=1e-12)
    np.testing.assert_allclose(found.frf.H[:, 0], H, rtol=1e-9)


def test_complex_numbers_without_a_header(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both = np.column_stack([F, H, 2 * H])
    lines = [f"{f:g}\t{h:.17g}\t{2 * h:.17g}".replace(".", ",") for f, h in zip(F, H, strict=True)]
    (tmp_path / "german.txt").write_text("\n".join(lines) + "\n")
    np.savetxt(tmp_path / "numpy.txt", both[:, 1:])
    np.savetxt(tmp_path / "whole.txt", both)
    found = read(tmp_path / "german.txt", channels={"de": "H1", "da": "H2"})
    np.testing.assert_allclose(found.frf.H, both[:, 1:], rtol=1e-12)
    np.testing.assert_allclose(found.frf.f, F)
    assert "column 1 taken as frequencies, column 2, 3 as responses" in capsys.readouterr().err
    np.testing.assert_allclose(read(tmp_path / "whole.txt").frf.H, both[:, 1:], rtol=1e-12)
    with pytest.raises(accept.AcceptError, match="first column is complex"):
        read(tmp_path / "numpy.txt")


REFUSED = {
    "phase without unit": ({"f": F, "Magnitude": SIZE, "Phase": DEG}, r"write \[deg\] or \[rad\]"),
    "phase in Hz": ({"f": F, "de_mag": SIZE, "de_phase [Hz]": DEG}, "expected deg or rad"),
    "deg in rad": ({"f": F, "de_mag": SIZE, "de_deg [rad]": DEG}, "expected deg or rad"),
    "dB without its unit": ({"f": F, "de_mag": 20 * np.log10(SIZE), "de_deg": DEG}, r"write \[dB\]"),
    "magnitude alone": ({"f": F, "de_mag": SIZE}, "lacks a phase"),
    "phase alone": ({"f": F, "de_deg": DEG}, "lacks a magnitude"),
    "two-sided": ({"f": F - 150, "de_re": H.real, "de_im": H.imag}, "two-sided; save the half from 0 Hz on"),
    "twice": ({"f": np.round(F / 2), "de_re": H.real, "de_im": H.imag}, "comes twice"),
    "two units": ({"f": F, "de_re [um/V]": H.real, "de_im [m/V]": H.imag}, "two units"),
    "acceleration": ({"f": F, "de_re [m/s2/V]": H.real, "de_im [m/s2/V]": H.imag}, "unit m/s2, which does not fit"),
    "acceleration in brackets": ({"f": F, "de [(m/s^2)/V]": H}, "unit m/s2, which does not fit"),
    "per newton, Va": ({"f": F, "Va_re [m/N]": H.real, "Va_im [m/N]": H.imag}, "does not fit"),
    "two inputs": (
        {"f": F, "de_re [m/V]": H.real, "de_im [m/V]": H.imag, "da_re [m/N]": H.real, "da_im [m/N]": H.imag},
        "per N and per V",
    ),
    "omega without unit": ({"w": F, "de_re": H.real, "de_im": H.imag}, r"write 'w \[rad/s\]'"),
    "f and w contradict": ({"f [Hz]": F, "w [rad/s]": F, "de_re": H.real, "de_im": H.imag}, "contradict each other"),
    "kHz in name, Hz behind": ({"f_kHz [Hz]": F, "de_re": H.real, "de_im": H.imag}, "states two units, Hz and kHz"),
    "time as unit": ({"f [s]": F, "de_re": H.real, "de_im": H.imag}, "expected Hz"),
    "polar against cartesian": (
        {"f": F, "de_re": H.real, "de_im": H.imag, "de_mag": SIZE, "de_deg": -DEG}, "contradict its magnitude",
    ),
    "cross spectrum": ({"f": F, "Gxy_re": H.real, "Gxy_im": H.imag}, r"spectra \(Gxy\) and no response"),
    "conjugate": ({"f": F, "de": H.conj()}, "complex conjugate"),
    "loose coherence": (
        {"f": F, "de_re": H.real, "de_im": H.imag, "da_re": H.real, "da_im": H.imag, "coherence": QUALITY},
        "of which response",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_a_table_that_contradicts_itself_is_refused(case: str, tmp_path: Path) -> None:
    columns, words = REFUSED[case]
    with pytest.raises(accept.AcceptError, match=words):
        read(table(tmp_path / "a.csv", **columns))


def quality(**more: object) -> dict[str, object]:
    return {"f": F, "de_re [um/V]": 1e6 * H.real, "de_im [um/V]": 1e6 * H.imag} | more


def test_coherence_in_percent_is_converted(tmp_path: Path) -> None:
    for name, scale in (("de_coherence [%]", 100.0), ("coherence", 1.0), ("de_coh", 1.0)):
        found = read(table(tmp_path / "a.csv", **quality(**{name: scale * QUALITY})), averages=20)
        np.testing.assert_allclose(found.frf.coherence[:, 0], QUALITY, rtol=1e-12)
        true = SIZE**2 * (1 - QUALITY) / QUALITY / 19  # [PS12] 2.5
        np.testing.assert_allclose(found.frf.var[:, 0], true, rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "scale"),
    [("de_var", 1e12), ("de_var [um^2/V^2]", 1e12), ("de_var [(um/V)^2]", 1e12), ("de_var [(m/V)^2]", 1.0),
     ("de_variance [nm²/V²]", 1e18)],
)  # fmt: skip
def test_variance_is_converted(name: str, scale: float, tmp_path: Path) -> None:
    found = read(table(tmp_path / "a.csv", **quality(**{name: scale * (0.01 * SIZE) ** 2})))
    np.testing.assert_allclose(found.frf.var[:, 0], (0.01 * SIZE) ** 2, rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("de_coherence", 100 * QUALITY, r"is it in percent\? write \[%\]"),
        ("de_coherence [%]", 10_000 * QUALITY, "expected 0 to 100 %"),
        ("de_coherence [dB]", 10 * np.log10(QUALITY), "10 or 20 lg"),
        ("de_coherence", 10 * np.log10(QUALITY), r"is it in dB\?"),
        ("de_coherence [m]", QUALITY, "expected a number from 0 to 1"),
        ("de_var", -QUALITY, "not negative"),
        ("de_var", np.where(F == 7.0, np.inf, QUALITY), "infinite at 1 frequencies"),
        ("de_var [um/V]", QUALITY, "expected the square of um/V"),
        ("de_var [s^2]", QUALITY, "expected the square of um/V"),
    ],
)
def test_a_quality_that_cannot_be_is_refused(name: str, values: object, words: str, tmp_path: Path) -> None:
    with pytest.raises(accept.AcceptError, match=words):
        read(table(tmp_path / "a.csv", **quality(**{name: values})), averages=20)


def test_an_input_is_named_by_its_unit(tmp_path: Path) -> None:
    found = read(table(tmp_path / "a.csv", f=F, **{"de_re [um/N]": 1e6 * H.real, "de_im [um/N]": 1e6 * H.imag}))
    assert (found.frf.input, found.ratios) == ("force", {"de": "m/N"})
    np.testing.assert_allclose(found.frf.H[:, 0], H, rtol=1e-12)
    with pytest.raises(accept.AcceptError, match="'Va' has the unit N"):
        read(tmp_path / "a.csv", input="Va")


def test_a_coherence_rounded_to_one_gives_no_noise(tmp_path: Path) -> None:
    F2 = np.arange(15.0, 601.0, 1.5)
    strut = accept.open_model("strut-2dof").frf(F2)[:, 1]
    found = read(table(tmp_path / "a.csv", f=F2, de=strut, de_coherence=np.ones(F2.size)), averages=20)
    with pytest.raises(accept.AcceptError, match="variance is 0 at 391 of 391"):
        accept.fit_model(found, "strut-2dof")
