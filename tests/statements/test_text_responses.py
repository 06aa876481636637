"""Responses in tables of spreadsheets, pandas and analysers."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.statements.case import Case, cell, coherent
from tests.statements.plant import H_da, H_de, response


def frf(
    header: str = "f [Hz],de_re [m/V],de_im [m/V]",
    more: dict[str, float] | None = None,
    f_factor: float = 1.0,
    H: np.ndarray | None = None,
    factors: tuple[float, float] = (1.0, 1.0),
) -> str:
    lines, right = response()
    H = right if H is None else H
    columns = [f_factor * lines, factors[0] * H.real, factors[1] * H.imag]
    columns += [np.full(lines.size, value) for value in (more or {}).values()]
    header = ",".join([header, *(more or {})])
    return header + "\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in zip(*columns, strict=True)) + "\n"


DIGITS = 3e-6  # nine digits of f on a flank of 1 % damping


@cell("CSV", "kind", "response: f, de_re, de_im")
def test_response(case: Case) -> None:
    case.response(case.text("h.csv", frf()), ["response"], within=DIGITS)
    assert case.outcome == {"used"}


@cell("CSV", "unit", "frequencies as {id}")
@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("f [kHz]", 1e-3), ("Frequency (Hz)", 1.0), ("freq [rad/s]", 2 * np.pi), ("f [rpm]", 60.0), ("f [1/min]", 60.0),
        ("f [MHz]", 1e-6), ("omega [rad/s]", 2 * np.pi), ("w", 2 * np.pi), ("f_kHz", 1e-3), ("Frequenz [Hz]", 1.0),
        ("f [mHz]", 1e3),
    ],
    ids=["f [kHz]", "Frequency (Hz)", "freq [rad per s]", "f [rpm]", "f [1 per min]", "f [MHz]", "omega [rad per s]",
         "w", "f_kHz", "Frequenz [Hz]", "f [mHz]"],
)  # fmt: skip
def test_unit_of_frequency(case: Case, name: str, factor: float) -> None:
    text = frf(f"{name},de_re [m/V],de_im [m/V]", f_factor=factor)
    unit = name.rpartition(" ")[2].strip("[]()")
    case.response(case.text("h.csv", text), [unit, "frequenc"], within=DIGITS)


@cell("CSV", "unit", "response in {id}")
@pytest.mark.parametrize(
    ("re", "im", "factors"),
    [
        ("um/V", "um/V", (1e6, 1e6)), ("nm/V", "nm/V", (1e9, 1e9)), ("um/V", "m/V", (1e6, 1.0)),
        ("m/mV", "m/mV", (1e-3, 1e-3)), ("µm/V", "µm/V", (1e6, 1e6)),
    ],
    ids=["um per V", "nm per V", "um per V and m per V", "m per mV", "micro m per V"],
)  # fmt: skip
def test_unit_of_a_response(case: Case, re: str, im: str, factors: tuple[float, float]) -> None:
    text = frf(f"f [Hz],de_re [{re}],de_im [{im}]", factors=factors)
    case.response(case.text("h.csv", text), [re, im, "unit"], within=DIGITS)


@cell("CSV", "unit", "response in {id}: no length per volt")
@pytest.mark.parametrize("unit", ["m/s2/V", "dB", "%"], ids=["m per s2 per V", "dB", "percent"])
def test_response_of_another_kind(case: Case, unit: str) -> None:
    text = frf(f"f [Hz],de_re [{unit}],de_im [{unit}]")
    case.frf(case.text("h.csv", text), words=[unit, "unit"], H=None)


@cell("CSV", "unit", "response in m/N: its input is a force")
def test_response_per_newton(case: Case) -> None:
    def per_newton(answer: dict[str, Any]) -> None:
        assert answer["input"] == "force"
        assert answer["units"]["force"] == "N"

    path = case.text("h.csv", frf("f [Hz],de_re [m/N],de_im [m/N]"))
    case.frf(path, words=["m/N", "unit"], within=DIGITS, check=per_newton)
    assert case.outcome == {"used"}


@cell("CSV", "label", "magnitude and phase as {id}")
@pytest.mark.parametrize(
    ("header", "magnitude", "phase"),
    [
        ("f,de_dB,de_deg", "dB", "deg"), ("f [Hz],de_abs [m/V],de_deg", "", "deg"),
        ("Frequency (Hz),Magnitude,Phase", "", "deg"), ("f [Hz],de [dB],phase [rad]", "dB", "rad"),
        ("Frequency (Hz),Magnitude (dB),Phase (deg)", "dB", "deg"),
    ],
    ids=["de_dB, de_deg", "de_abs, de_deg", "Magnitude, Phase", "de [dB], phase [rad]", "Magnitude (dB), Phase (deg)"],
)  # fmt: skip
def test_magnitude_and_phase(case: Case, header: str, magnitude: str, phase: str) -> None:
    f, H = response()
    columns = [
        f,
        20 * np.log10(np.abs(H)) if magnitude else np.abs(H),
        np.degrees(np.angle(H)) if phase == "deg" else np.angle(H),
    ]
    text = header + "\n" + "\n".join(",".join(f"{x:.12g}" for x in row) for row in zip(*columns, strict=True)) + "\n"
    case.response(case.text("h.csv", text), ["dB", "deg", "magnitude", "phase", "de_re", "real"], within=1e-5)


@cell("CSV", "label", "complex numbers as {id}")
@pytest.mark.parametrize(
    "form",
    [
        "{re:.9g}{im:+.9g}j",
        "{re:.9g}{im:+.9g}i",
        "({re:.9g}{im:+.9g}j)",
        "{re:.9g} {sign} {abs:.9g}i",
        '"{re:.9g}{im:+.9g}i"',
    ],
    ids=["a+bj", "a+bi", "(a+bj)", "a + bi", "quoted a+bi"],
)
@pytest.mark.parametrize("header", ["f,de\n", ""], ids=["with names", "without names"])
def test_complex_numbers(case: Case, form: str, header: str) -> None:
    f, H = response()
    rows = [
        f"{x:g}," + form.format(re=h.real, im=h.imag, sign="+" if h.imag >= 0 else "-", abs=abs(h.imag))
        for x, h in zip(f, H, strict=True)
    ]
    path = case.text("h.csv", header + "\n".join(rows) + "\n")
    case.response(path, ["complex", "a\\+b", "de_re", "names", "header", "real"], within=DIGITS)


@cell("CSV", "label", "complex numbers with decimal commas: 1,2-3,4i")
def test_complex_numbers_of_a_german_spreadsheet(case: Case) -> None:
    f, H = response()
    rows = [f"{x:g};{h.real:.9g}{h.imag:+.9g}i".replace(".", ",") for x, h in zip(f, H, strict=True)]
    path = case.text("h.csv", "f;de\n" + "\n".join(rows) + "\n")
    case.response(path, ["complex", "de_re", "real"], within=DIGITS)


@cell("CSV", "kind", "two-sided, with negative frequencies")
def test_two_sided(case: Case) -> None:
    f = 5.0 * np.arange(-100, 101)
    H = H_de(f)
    text = "f,de_re,de_im\n" + "\n".join(f"{x:g},{h.real:.9g},{h.imag:.9g}" for x, h in zip(f, H, strict=True)) + "\n"
    case.response(case.text("h.csv", text), ["negative", "two-sided"], within=DIGITS)


@cell("CSV", "kind", "magnitude alone")
def test_magnitude_alone(case: Case) -> None:
    f, H = response()
    text = "f [Hz],de [m/V]\n" + "\n".join(f"{x:g},{abs(h):.9g}" for x, h in zip(f, H, strict=True)) + "\n"
    case.response(case.text("h.csv", text), ["phase", "de_re", "de_im", "real"], H=None)


@cell("CSV", "kind", "cross spectrum: {id}")
@pytest.mark.parametrize("name", ["Gxy", "cross_spectrum", "Sxy"])
def test_cross_spectrum(case: Case, name: str) -> None:
    case.response(case.text("h.csv", frf(f"f [Hz],{name}_re,{name}_im")), ["spectr", name], H=None)


@cell("CSV", "label", "an empty name before the frequencies (index of pandas)")
def test_index_in_a_response(case: Case) -> None:
    f, H = response()
    frame = pd.DataFrame({"f": f, "de_re": H.real, "de_im": H.imag})
    frame.to_csv(case.path("h.csv"))
    case.response(case.path("h.csv"), ["empty", "name", "column 1"], within=DIGITS)


@cell("CSV", "start", "frequencies from high to low")
def test_falling_frequencies(case: Case) -> None:
    head, *rows = frf().splitlines()
    case.response(
        case.text("h.csv", "\n".join([head, *rows[::-1]]) + "\n"),
        ["increas", "order", "ascend", "rise", "frequenc"],
        within=DIGITS,
    )


@cell("CSV", "increment", "a frequency occurs twice")
def test_frequency_twice(case: Case) -> None:
    head, *rows = frf().splitlines()
    case.response(
        case.text("h.csv", "\n".join([head, *rows[:50], rows[49], *rows[50:]]) + "\n"),
        ["twice", "increas", "frequenc"],
        H=None,
    )


@cell("CSV", "quality", "`de_coherence` = {id}")
@pytest.mark.parametrize("value", [98.7, 1.2, -0.1, -0.11], ids=["98.7", "1.2", "-0.1", "-0.11 (dB)"])
def test_impossible_coherence(case: Case, value: float) -> None:
    text = frf(more={"de_coherence": value})
    case.response(case.text("h.csv", text), ["coherence"], H=None)


@cell("CSV", "quality", "`de_coherence {id}` = 98.7")
@pytest.mark.parametrize("unit", ["[%]", "(%)"])
def test_coherence_in_percent(case: Case, unit: str) -> None:
    text = frf(more={f"de_coherence {unit}": 98.7})
    case.response(case.text("h.csv", text), ["coherence", "%"], within=DIGITS, check=coherent(0.987))


@cell("CSV", "quality", "coherence 0.987 with 20 averages")
def test_coherence(case: Case) -> None:
    text = frf(more={"de_coherence": 0.987})
    case.response(
        case.text("h.csv", text), ["coherence"], within=DIGITS, options=["--averages", 20], check=coherent(0.987)
    )
    assert case.outcome == {"used"}


@cell("CSV", "quality", "`de_var` = {id}")
@pytest.mark.parametrize("value", [-1e-16, float("inf")], ids=["negative", "infinite"])
def test_impossible_variance(case: Case, value: float) -> None:
    case.response(case.text("h.csv", frf(more={"de_var": value})), ["variance", "_var"], H=None)


@cell("CSV", "unit", "variance beside a response in um per V: converted by the square")
def test_unit_of_the_variance(case: Case) -> None:
    text = frf("f [Hz],de_re [um/V],de_im [um/V]", more={"de_var": 4e-4}, factors=(1e6, 1e6))

    def right(answer: dict[str, dict[str, list[float]]]) -> None:
        assert answer["var"]["de"] == pytest.approx(np.full(200, 4e-16), rel=1e-6)

    case.response(case.text("h.csv", text), ["variance", "_var", "unit"], within=DIGITS, check=right)


@cell("CSV", "quality", "NaN in a response")
def test_nan_in_a_response(case: Case) -> None:
    lines = frf().splitlines()
    lines[50] = lines[50].partition(",")[0] + ",NaN,NaN"
    case.response(case.text("h.csv", "\n".join(lines) + "\n"), ["NaN", "number"], H=None)


@cell("CSV", "label", "two outputs, one without its imaginary part")
def test_half_a_response(case: Case) -> None:
    case.response(case.text("h.csv", frf(more={"da_re": 1e-6})), ["da_im", "da_re", "da"], H=None)


@cell("CSV", "layout", "response: {id}")
@pytest.mark.parametrize(
    "how",
    ["UTF-16", "sep=;", "semicolons and decimal commas", "preamble", "UTF-8 with its mark", "trailing separators"],
)
def test_layout_of_a_response(case: Case, how: str) -> None:
    text = frf()
    if how in ("sep=;", "semicolons and decimal commas"):
        text = text.replace(",", ";").replace(".", ",")
    text = {"sep=;": "sep=;\n", "preamble": "Analyser,X-1\nDate,2026-11-20\n\n"}.get(how, "") + text
    if how == "trailing separators":
        text = text.replace("\n", ",\n")
    encoding = {"UTF-16": "utf-16", "UTF-8 with its mark": "utf-8-sig"}.get(how, "utf-8")
    path = case.text("h.csv", text, encoding)
    case.response(
        path, ["UTF-16", "sep=", "line 1", "first line", "preamble", "empty", "trailing", "at the end"], within=DIGITS
    )


@cell("CSV", "scale", "response in nm per V with thousands marks: {id}")
@pytest.mark.parametrize("mark", [".", ","])
def test_thousands_in_a_response(case: Case, mark: str) -> None:
    f, H = response()
    decimal = "," if mark == "." else "."

    def shown(x: float) -> str:
        return f"{x:,.6f}".replace(",", "\0").replace(".", decimal).replace("\0", mark)

    rows = [f"{x:g};{shown(1e9 * h.real)};{shown(1e9 * h.imag)}" for x, h in zip(f, H, strict=True)]
    path = case.text("h.csv", "f [Hz];de_re [nm/V];de_im [nm/V]\n" + "\n".join(rows) + "\n")
    case.response(path, ["thousand", "group", "decimal", "mark"], within=1e-5)


@cell("CSV", "kind", "two outputs of a response, written by pandas with numbers of complex type")
def test_complex_frame(case: Case) -> None:
    f, H = response()
    pd.DataFrame({"f": f, "de": H, "da": H_da(f)}).to_csv(case.path("h.csv"), index=False)
    case.response(case.path("h.csv"), ["complex", "de_re", "real"], within=DIGITS, H={"de": H_de, "da": H_da})
