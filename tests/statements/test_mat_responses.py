"""Responses in MATLAB files: the fields of an frd object, and vectors beside one of frequencies."""

from typing import Any

import numpy as np
import pytest

from tests.statements.case import Case, cell, coherent
from tests.statements.plant import H_da, H_de, response
from tests.statements.test_mat import names, save


def frd(H: np.ndarray | None = None, f: np.ndarray | None = None, **fields: Any) -> dict[str, Any]:
    """Return the fields of an frd object as `struct(G)` gives them."""
    lines, right = response()
    said = {
        "ResponseData": (right if H is None else H)[None, None, :],
        "Frequency": (lines if f is None else f)[:, None],
        "FrequencyUnit": "Hz",
        "TimeUnit": "seconds",
        "InputName": names("Va"),
        "OutputName": names("de"),
        "InputUnit": names("V"),
        "OutputUnit": names("m"),
        "Ts": 0.0,
        **fields,
    }
    return {"G": {k: v for k, v in said.items() if v is not None}}


UNITS_OF_FREQUENCY = {
    "Hz": 1.0, "rad/TimeUnit": 2 * np.pi, "cycles/TimeUnit": 1.0, "rad/s": 2 * np.pi, "kHz": 1e-3, "MHz": 1e-6,
    "GHz": 1e-9, "rpm": 60.0,
}  # fmt: skip


@cell("frd", "unit", "FrequencyUnit = {id}, TimeUnit = seconds")
@pytest.mark.parametrize("unit", UNITS_OF_FREQUENCY)
def test_frequency_unit(case: Case, unit: str) -> None:
    f = UNITS_OF_FREQUENCY[unit] * response()[0]
    case.response(save(case, frd(f=f, FrequencyUnit=unit)), [unit, "FrequencyUnit"])


UNITS_OF_TIME = {
    "nanoseconds": 1e-9, "microseconds": 1e-6, "milliseconds": 1e-3, "minutes": 60.0, "hours": 3600.0, "days": 86400.0,
}  # fmt: skip


@cell("frd", "unit", "FrequencyUnit = rad/TimeUnit, TimeUnit = {id}")
@pytest.mark.parametrize("unit", UNITS_OF_TIME)
def test_time_unit(case: Case, unit: str) -> None:
    f = 2 * np.pi * UNITS_OF_TIME[unit] * response()[0]
    case.response(
        save(case, frd(f=f, FrequencyUnit="rad/TimeUnit", TimeUnit=unit)), [unit, "TimeUnit", "FrequencyUnit"]
    )


@cell("frd", "unit", "no FrequencyUnit: MATLAB's default is rad/TimeUnit")
def test_no_frequency_unit(case: Case) -> None:
    f = 2 * np.pi * response()[0]
    case.response(save(case, frd(f=f, FrequencyUnit=None, TimeUnit=None)), ["FrequencyUnit", "unit", "rad"])


@cell("frd", "unit", "OutputUnit = {id}")
@pytest.mark.parametrize("unit", ["mm", "um", "nm"])
def test_output_unit(case: Case, unit: str) -> None:
    H = {"mm": 1e3, "um": 1e6, "nm": 1e9}[unit] * response()[1]
    case.response(save(case, frd(H, OutputUnit=names(unit))), [unit, "OutputUnit"])


@cell("frd", "unit", "InputUnit = mV")
def test_input_unit(case: Case) -> None:
    case.response(save(case, frd(1e-3 * response()[1], InputUnit=names("mV"))), ["mV", "InputUnit"])


@cell("frd", "start", "{id} of 5 ms beside ResponseData")
@pytest.mark.parametrize("delay", ["InputDelay", "OutputDelay", "IODelay"])
def test_delay(case: Case, delay: str) -> None:
    path = save(case, frd(**{delay: 5e-3}))
    case.response(path, [delay, "delay"], H=lambda f: H_de(f) * np.exp(-2j * np.pi * f * 5e-3))


@cell("frd", "label", "no names")
def test_no_names(case: Case) -> None:
    empty = np.array([np.array([], dtype="U1"), None], dtype=object)[:-1]
    case.frf(save(case, frd(InputName=empty, OutputName=empty)), words=["name", "--map", "output"], H=H_de, within=1e-6)


@cell("frd", "label", "two inputs")
def test_two_inputs(case: Case) -> None:
    H = response()[1]
    path = save(
        case, frd(ResponseData=np.array([H, 3.0 * H])[None], InputName=names("Va", "Vb"), InputUnit=names("V", "V"))
    )
    case.response(path, ["input", "Vb"])


@cell("frd", "label", "two outputs")
def test_two_outputs(case: Case) -> None:
    f, H = response()
    path = save(
        case,
        frd(ResponseData=np.array([H, H_da(f)])[:, None], OutputName=names("de", "da"), OutputUnit=names("m", "m")),
    )
    case.response(path, ["output"], H={"de": H_de, "da": H_da})
    assert case.outcome == {"used"}


@cell("frd", "quality", "NaN in ResponseData")
def test_frd_nan(case: Case) -> None:
    H = response()[1]
    H[50] = np.nan
    case.response(save(case, frd(H)), ["NaN", "number"], H=None)


@cell("frd", "kind", "negative frequencies: two-sided")
def test_frd_two_sided(case: Case) -> None:
    f = 5.0 * np.arange(-100, 101)
    case.response(save(case, frd(H_de(f), f)), ["negative", "two-sided", "frequenc"])


@cell("frd", "kind", "magnitude alone: real ResponseData")
def test_frd_real(case: Case) -> None:
    case.response(save(case, frd(np.abs(response()[1]))), ["real", "phase", "magnitude", "complex"], H=None)


@cell("MATLAB", "kind", "response, cross spectrum, auto spectra and coherence by vectors")
def test_spectra_beside_the_response(case: Case) -> None:
    f, H = response()
    contents = {
        "Freq_domain": f, "Hf_chan_2": H, "Hf_coh_chan_2": np.full(f.size, 0.97),
        "Hf_Cross_Spec_chan_2": 3.0 * H, "Auto_Spec_chan_1": np.full(f.size, 4.0), "Auto_Spec_chan_2": np.abs(H) ** 2,
    }  # fmt: skip
    case.frf(
        save(case, contents),
        words=["spec", "Hf_", "coh"],
        H=H_de,
        within=1e-6,
        options=["--map", "f=Freq_domain"],
        check=coherent(0.97),
    )


@cell("MATLAB", "kind", "`{id}` over `f`: a spectrum, no response")
@pytest.mark.parametrize("name", ["Pxy", "Gxy", "Sxy", "G1_2", "Cross_Spectrum"])
def test_cross_spectrum_alone(case: Case, name: str) -> None:
    f, H = response()
    case.response(save(case, {"f": f, name: 3.0 * H}), ["spectr", name], H=None)


@cell("MATLAB", "kind", "`U` and `Y` over `f`: spectra of input and output")
def test_spectra_of_input_and_output(case: Case) -> None:
    f, H = response()
    U = np.exp(1j * np.arange(f.size))
    case.frf(save(case, {"f": f, "U": U, "Y": H * U}), words=["spectr", r"\bU\b"], H=H_de, within=1e-6)


@cell("MATLAB", "kind", "`Txy`, `Cxy`, `Pxx` over `F`, as tfestimate and mscohere return them")
def test_estimates_of_matlab(case: Case) -> None:
    f, H = response()
    contents = {"F": f, "Txy": H, "Cxy": np.full(f.size, 0.97), "Pxx": np.ones(f.size)}
    case.frf(
        save(case, contents),
        words=["Txy", "Cxy", "Pxx", "spectr"],
        H=H_de,
        within=1e-6,
        check=coherent(0.97),
    )


@cell("MATLAB", "kind", "`mag` and `phase` over `w`, as bode returns them")
def test_bode(case: Case) -> None:
    f, H = response()
    contents = {"w": 2 * np.pi * f, "mag": np.abs(H), "phase": np.degrees(np.unwrap(np.angle(H)))}
    case.response(save(case, contents), ["mag", "phase", "complex"])


@cell("MATLAB", "unit", "`w`, angular frequency, over a complex response `de`")
def test_angular_frequency(case: Case) -> None:
    f, H = response()
    case.response(save(case, {"w": 2 * np.pi * f, "de": H}), [r"\bw\b", "frequenc", "rad"])


@cell("MATLAB", "label", "`f` and `w` that contradict each other")
def test_two_frequencies(case: Case) -> None:
    f, H = response()
    case.response(save(case, {"f": f, "freq": 2 * np.pi * f, "de": H}), ["freq", r"\bf\b"], H=None)


@cell("MATLAB", "quality", "coherence `C1_2` of {id}")
@pytest.mark.parametrize("value", [97.0, 1.2, -0.1], ids=["97 (percent)", "1.2", "-0.1"])
def test_impossible_coherence(case: Case, value: float) -> None:
    f, H = response()
    case.response(save(case, {"f": f, "H1_2": H, "C1_2": np.full(f.size, value)}), ["coherence", "C1_2"], H=None)


@cell("MATLAB", "quality", "coherence `C1_2` with one value less")
def test_coherence_is_shorter(case: Case) -> None:
    f, H = response()
    case.response(
        save(case, {"f": f, "H1_2": H, "C1_2": np.full(f.size - 1, 0.97)}),
        ["coherence", "C1_2", "values"],
        said="C1_2|coherence",
    )
