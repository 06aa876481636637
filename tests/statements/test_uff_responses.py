"""Responses in universal files: data set 58 by pyuff and by its public description, data set 164."""

import numpy as np
import pytest
import pyuff

from tests.statements.case import Case, cell, coherent
from tests.statements.plant import H_da, H_de, record, response
from tests.statements.test_uff import (
    ACCELERATION,
    DISPLACEMENT,
    FREQUENCY,
    RPM,
    SECONDS,
    UNKNOWN,
    VOLT,
    Axis,
    frf,
    two,
    units,
)


@cell("UFF 58", "kind", "type 4: frequency response")
def test_response(case: Case) -> None:
    case.response(case.text("h.uff", frf()), ["response"])
    assert case.outcome == {"used"}


@cell("UFF 58", "kind", "type 4, written by pyuff")
def test_response_by_pyuff(case: Case) -> None:
    f, H = response()
    made = pyuff.prepare_58(
        func_type=4, rsp_node=1, rsp_dir=3, ref_node=1, ref_dir=3, rsp_ent_name="de", ref_ent_name="Va", data=H, x=f,
        id1="de", binary=0, abscissa_spacing=1, abscissa_min=f[0], abscissa_inc=5.0, num_pts=f.size, ord_data_type=6,
        abscissa_spec_data_type=FREQUENCY, abscissa_axis_units_lab="Hz",
        ordinate_spec_data_type=DISPLACEMENT, ordinate_axis_units_lab="m",
        orddenom_spec_data_type=0, orddenom_axis_units_lab="V",
        z_axis_spec_data_type=0, return_full_dict=False,
    )  # fmt: skip
    pyuff.UFF(str(case.path("h.uff"))).write_sets(made, "add")
    case.response(case.path("h.uff"), ["response"])
    assert case.outcome == {"used"}


@cell("UFF 58", "unit", "abscissa labelled {id}")
@pytest.mark.parametrize("label", ["Hz", "kHz", "rad/s", "rpm", "1/min", "Order", "cpm"])
def test_label_of_the_abscissa(case: Case, label: str) -> None:
    factor = {"Hz": 1.0, "kHz": 1e-3, "rad/s": 2 * np.pi, "rpm": 60.0, "1/min": 60.0, "Order": 1.0, "cpm": 60.0}[label]
    axis = Axis(FREQUENCY, "Frequency", label)
    path = case.text("h.uff", frf(start=5.0 * factor, step=5.0 * factor, abscissa=axis))
    # 2 pi in five digits, as the format has it: 2e-6 of the frequency, on a flank of 1 % damping 2e-4 of |H|
    case.response(path, [label, "abscissa", "frequenc"], H=None if label == "Order" else H_de, within=2e-3)


@cell("UFF 58", "unit", "abscissa of kind 19 (rpm) without label")
def test_kind_of_the_abscissa(case: Case) -> None:
    path = case.text("h.uff", frf(start=300.0, step=300.0, abscissa=Axis(RPM)))
    case.response(path, ["rpm", "abscissa", "19"])


@cell("UFF 58", "kind", "type 4 over time")
def test_response_over_time(case: Case) -> None:
    path = case.text("h.uff", frf(abscissa=SECONDS))
    case.response(path, ["abscissa", "time", r"\bs\b"], H=None)


@cell("UFF 58", "unit", "ordinate labelled {id}")
@pytest.mark.parametrize("label", ["mm", "µm", "nm", "m/V", "mm/V"])
def test_label_of_the_ordinate(case: Case, label: str) -> None:
    factor = {"mm": 1e3, "µm": 1e6, "nm": 1e9, "m/V": 1.0, "mm/V": 1e3}[label]
    text = frf(factor * response()[1], ordinate=Axis(DISPLACEMENT, "Displacement", label))
    case.response(case.text("h.uff", text, "latin-1"), [label, "unit"])


@cell("UFF 58", "unit", "denominator labelled mV")
def test_label_of_the_denominator(case: Case) -> None:
    text = frf(1e-3 * response()[1], denominator=Axis(UNKNOWN, "Voltage", "mV"))
    case.response(case.text("h.uff", text), ["mV", "unit"])


@cell("UFF 58", "unit", "de is an acceleration in m/s^2")
def test_response_of_acceleration(case: Case) -> None:
    text = frf(ordinate=Axis(ACCELERATION, "Acceleration", "m/s^2"))
    case.response(case.text("h.uff", text), ["m/s", "acceleration", "unit"], H=None)


CODES = {
    1: (1.0, "SI"), 2: (1 / 0.3048, "foot"), 3: (1.0, "m, kgf"), 4: (1 / 0.3048, "foot, poundal"), 5: (1e3, "mm, mN"),
    6: (1e2, "cm"), 7: (1 / 25.4e-3, "inch"), 8: (1e3, "mm, kgf"), 9: (2e3, "user"), 10: (1e3, "mm, N"),
}  # fmt: skip


@cell("UFF 164", "unit", "code and words {id}, no labels")
@pytest.mark.parametrize("code", CODES, ids=[f"{code} ({words})" for code, (_, words) in CODES.items()])
def test_units_by_164(case: Case, code: int) -> None:
    length, words = CODES[code]
    text = frf(length * response()[1], ordinate=Axis(DISPLACEMENT), denominator=Axis(UNKNOWN))
    case.response(case.text("h.uff", units(code, length, 1.0, words) + text), ["164", "unit"], within=1e-5)


@cell("UFF 164", "unit", "behind the function, code 5 (mm)")
def test_164_behind(case: Case) -> None:
    text = frf(1e3 * response()[1], ordinate=Axis(DISPLACEMENT), denominator=Axis(UNKNOWN))
    case.response(case.text("h.uff", text + units(5, 1e3, 1e3)), ["164", "mm", "unit"])


@cell("UFF 164", "unit", "code 5 (mm) against the label m")
def test_164_against_the_label(case: Case) -> None:
    case.response(case.text("h.uff", units(5, 1e3, 1e3) + frf()), ["164", "mm", "unit"], H=None)


@cell("UFF 164", "unit", "code 5 (mm) and the label mm: converted once")
def test_164_and_the_label_agree(case: Case) -> None:
    text = frf(1e3 * response()[1], ordinate=Axis(DISPLACEMENT, "Displacement", "mm"))
    case.response(case.text("h.uff", units(5, 1e3, 1e3) + text), ["164", "mm", "unit"])


@cell("UFF 164", "unit", "code 5 (mm), factors of SI")
def test_164_contradicts_itself(case: Case) -> None:
    text = frf(ordinate=Axis(DISPLACEMENT), denominator=Axis(UNKNOWN))
    case.response(case.text("h.uff", units(5, 1.0) + text), ["164", "mm", "unit", "factor"], H=None)


KINDS = {
    0: "unknown|general", 2: "auto|spectr", 3: "cross|spectr", 6: "coherence", 7: "correlation", 8: "correlation",
    9: "PSD|power|spectr", 10: "ESD|energy|spectr", 12: "spectr", 25: "impulse|finite|FIR|filter",
}  # fmt: skip


@cell("UFF 58", "kind", "only a function of type {id}")
@pytest.mark.parametrize("function", KINDS)
def test_other_functions(case: Case, function: int) -> None:
    values = response()[1]
    values = np.abs(values) if function in (2, 6, 9, 10) else values
    words = [*KINDS[function].split("|"), rf"type {function}\b", rf"function {function}\b"]
    case.response(case.text("h.uff", frf(values, function)), words, H=None)


@cell("UFF 58", "kind", "type 4 beside cross, auto spectrum and coherence")
def test_response_beside_spectra(case: Case) -> None:
    H = response()[1]
    text = frf(3.0 * H, 3) + frf(np.abs(H), 2, name="Va") + frf() + frf(np.full(H.size, 0.98), 6, ordinate=Axis())
    case.response(case.text("h.uff", text), ["spectr", "response"], check=coherent(0.98))


@cell("UFF 58", "kind", "type 5: transmissibility")
def test_transmissibility(case: Case) -> None:
    text = frf(response()[1], 5, name="de", denominator=VOLT)
    case.response(case.text("h.uff", text), ["transmissib", "type 5"])


@cell("UFF 58", "kind", "type 4 with real values: no phase")
def test_real_response(case: Case) -> None:
    case.response(case.text("h.uff", frf(np.abs(response()[1]))), ["real", "phase", "magnitude"], H=None)


@cell("UFF 58", "quality", "coherence {id}")
@pytest.mark.parametrize("value", [98.0, 1.2, -0.1], ids=["98 (percent)", "1.2", "-0.1"])
def test_impossible_coherence(case: Case, value: float) -> None:
    coherence = frf(np.full(200, value), 6, ordinate=Axis())
    case.response(case.text("h.uff", frf() + coherence), ["coherence"], H=None)


@cell("UFF 58", "quality", "coherence of 98 labelled %")
def test_coherence_in_percent(case: Case) -> None:
    coherence = frf(np.full(200, 98.0), 6, ordinate=Axis(UNKNOWN, "Coherence", "%"))
    case.response(case.text("h.uff", frf() + coherence), ["coherence"], check=coherent(0.98))


@cell("UFF 58", "quality", "coherence over other frequencies")
def test_coherence_over_other_frequencies(case: Case) -> None:
    coherence = frf(np.full(200, 0.98), 6, ordinate=Axis(), start=2.0, step=2.0)
    # Its lines are none of the response: it is no coherence of it, so it is refused or left out with a word.
    case.response(
        case.text("h.uff", frf() + coherence),
        ["coherence"],
        check=lambda answer: np.testing.assert_array_equal(np.array(answer["coherence"]["de"], dtype=float), np.nan),
        said=r"coherence.*(lines|frequenc|axis|abscissa)",
    )


@cell("UFF 58", "quality", "NaN in a response")
def test_nan_in_a_response(case: Case) -> None:
    H = response()[1]
    H[50] = np.nan
    case.response(case.text("h.uff", frf(H)), ["NaN", "number"], H=None)


@cell("UFF 58", "label", "two inputs")
def test_two_inputs(case: Case) -> None:
    path = case.text("h.uff", frf() + frf(3.0 * response()[1], reference="Vb"))
    case.response(path, ["input", "reference", "Vb"])


@cell("UFF 58", "label", "two outputs")
def test_two_outputs(case: Case) -> None:
    path = case.text("h.uff", frf() + frf(H_da(response()[0]), name="da"))
    case.response(path, ["output", "da"], H={"de": H_de, "da": H_da})
    assert case.outcome == {"used"}


@cell("UFF 58", "increment", "two outputs over different frequencies")
def test_two_frequency_axes(case: Case) -> None:
    f = 4.0 * np.arange(1, 201)
    text = frf() + frf(H_da(f), name="da", start=4.0, step=4.0)
    case.response(case.text("h.uff", text), ["frequenc", "increment", "abscissa"], H={"de": H_de, "da": H_da})


@cell("UFF 58", "start", "two outputs that start at 5 and 10 Hz")
def test_two_frequency_starts(case: Case) -> None:
    f = 5.0 * np.arange(2, 202)
    text = frf() + frf(H_da(f), name="da", start=10.0)
    case.response(case.text("h.uff", text), ["frequenc", "start", "abscissa"], H={"de": H_de, "da": H_da})


@cell("UFF 58", "kind", "negative frequencies: two-sided")
def test_two_sided(case: Case) -> None:
    f = 5.0 * np.arange(-100, 101)
    path = case.text("h.uff", frf(H_de(f), start=-500.0))
    case.response(path, ["negative", "two-sided", "frequenc"])


@cell("UFF 58", "kind", "a record and a response in one file")
def test_record_beside_a_response(case: Case) -> None:
    case.frf(case.text("r.uff", two(record()) + frf()), words=["record", "response", "type"], H=H_de)


@cell("UFF 58", "layout", "values in D exponents (Fortran)")
def test_fortran_exponents(case: Case) -> None:
    head, _, tail = frf().rpartition("NONE                 NONE")
    case.response(case.text("h.uff", head + "NONE                 NONE" + tail.replace("e", "D")), ["D", "number"])
