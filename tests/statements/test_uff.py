"""Universal files: data set 58 by pyuff, and line by line from the public description of 58, 58b and 164."""

import struct
from dataclasses import dataclass

import numpy as np
import pytest
import pyuff

from tests.statements.case import Case, cell, coherent
from tests.statements.plant import FS, SHIFT, H_da, H_de, late, record, response

TIME, FREQUENCY, RPM, DISPLACEMENT, ACCELERATION, FORCE, UNKNOWN = 17, 18, 19, 8, 12, 13, 0


@dataclass
class Axis:
    """Record 8 to 11: what is along an axis, in which unit."""

    kind: int = UNKNOWN
    name: str = "NONE"
    unit: str = "NONE"

    def line(self) -> str:
        return f"{self.kind:10d}{0:5d}{0:5d}{0:5d} {self.name:<20s} {self.unit:<20s}\n"


SECONDS, HERTZ = Axis(TIME, "Time", "s"), Axis(FREQUENCY, "Frequency", "Hz")
VOLT, METRE = Axis(UNKNOWN, "Voltage", "V"), Axis(DISPLACEMENT, "Displacement", "m")


def data_set(
    values: np.ndarray,
    function: int,
    name: str,
    reference: str = "Va",
    start: float = 0.0,
    step: float = 1.0,
    abscissa: Axis = SECONDS,
    ordinate: Axis = METRE,
    denominator: Axis | None = None,
    count: int | None = None,
    fill: str = "",
    uneven: np.ndarray | None = None,
) -> str:
    """Return data set 58 in double precision. count: number of points that record 7 states; fill: what a program puts
    behind the last value of the last line; uneven: abscissae, written beside the values."""
    form = 6 if np.iscomplexobj(values) else 4
    spacing = 1 if uneven is None else 0
    numbers = np.column_stack([values.real, values.imag]).ravel() if form == 6 else values
    text = f"{'    -1':<80s}\n{'    58':<80s}\n" + "".join(
        f"{line:<80s}\n" for line in (name, "NONE", "20-Nov-26 10:00:00")
    )
    text += f"{'NONE':<80s}\n" * 2
    text += f"{function:5d}{0:10d}{0:5d}{0:10d} {name:<10s}{1:10d}{3:4d} {reference:<10s}{0:10d}{0:4d}\n"
    text += f"{form:10d}{count or values.size:10d}{spacing:10d}{start:13.5e}{step:13.5e}{0.0:13.5e}\n"
    text += abscissa.line() + ordinate.line() + (denominator or Axis()).line() + Axis().line()
    if uneven is None:
        text += "\n".join("".join(f"{x:20.12e}" for x in numbers[k : k + 4]) for k in range(0, numbers.size, 4))
    elif form == 6:  # E13.5,2E20.12
        text += "\n".join(f"{x:13.5e}{y.real:20.12e}{y.imag:20.12e}" for x, y in zip(uneven, values, strict=True))
    else:  # 2(E13.5,E20.12)
        pairs = [f"{x:13.5e}{y:20.12e}" for x, y in zip(uneven, values, strict=True)]
        text += "\n".join("".join(pairs[k : k + 2]) for k in range(0, len(pairs), 2))
    return text + fill + "\n    -1\n"


def time(values: np.ndarray, name: str, ordinate: Axis, **more: object) -> str:
    said = {"step": 1.0 / FS, "reference": "NONE", **more}
    return data_set(values, 1, name, ordinate=ordinate, **said)  # type: ignore[arg-type]


def two(made: dict[str, np.ndarray], **de: object) -> str:
    return time(made["Va"], "Va", VOLT) + time(made["de"], "de", METRE, **de)


def frf(H: np.ndarray | None = None, function: int = 4, **more: object) -> str:
    said = {"start": 5.0, "step": 5.0, "abscissa": HERTZ, "denominator": VOLT, **more}
    return data_set(response()[1] if H is None else H, function, str(said.pop("name", "de")), **said)  # type: ignore[arg-type]


def units(code: int, length: float, force: float = 1.0, words: str = "") -> str:
    """Return data set 164: values of the file are divided by its factors to give SI."""
    return (
        f"    -1\n   164\n{code:10d}{words:<20s}{2:10d}\n"
        + "".join(f"{x:25.17e}" for x in (length, force, 1.0)).replace("e", "D")
        + f"\n{273.15:25.17e}".replace("e", "D")
        + "\n    -1\n"
    )


# Records


@cell("UFF 58", "start", "equal starts")
def test_record(case: Case) -> None:
    case.record(case.text("r.uff", two(record())), ["start"])
    assert case.outcome == {"used"}


@cell("UFF 58", "start", "both sets start at 3 s")
def test_common_start(case: Case) -> None:
    made = record()
    text = time(made["Va"], "Va", VOLT, start=3.0) + time(made["de"], "de", METRE, start=3.0)
    case.record(case.text("r.uff", text), ["start"])


@cell("UFF 58", "start", "de starts 5 ms later")
def test_start(case: Case) -> None:
    case.record(case.text("r.uff", two(late(), start=SHIFT / FS)), ["start"])


@cell("UFF 58", "start", "de starts 5 ms later, written by pyuff")
def test_start_by_pyuff(case: Case) -> None:
    made = late()
    sets = []
    for name, start, unit in (("Va", 0.0, "V"), ("de", SHIFT / FS, "m")):
        x = start + made["t"]
        sets.append(
            pyuff.prepare_58(
                func_type=1, rsp_node=1, rsp_dir=3, ref_node=1, ref_dir=3, rsp_ent_name=name, data=made[name], x=x,
                id1=name, binary=0, abscissa_spacing=1, abscissa_min=x[0], abscissa_inc=1.0 / FS, num_pts=x.size,
                ord_data_type=4, abscissa_spec_data_type=TIME, abscissa_axis_units_lab="s", ordinate_spec_data_type=0,
                ordinate_axis_units_lab=unit, orddenom_spec_data_type=0, z_axis_spec_data_type=0,
                return_full_dict=False,
            )
        )  # fmt: skip
    pyuff.UFF(str(case.path("r.uff"))).write_sets(sets, "add")
    case.record(case.path("r.uff"), ["start"])


@cell("UFF 58", "increment", "two increments")
def test_two_increments(case: Case) -> None:
    made = record()
    text = time(made["Va"], "Va", VOLT) + time(made["de"][::2], "de", METRE, step=2.0 / FS)
    case.record(case.text("r.uff", text), ["increment", "sampling", "step", "rate"])


@cell("UFF 58", "increment", "two increments, equal numbers of values")
def test_two_increments_of_equal_length(case: Case) -> None:
    case.record(case.text("r.uff", two(record(), step=2.0 / FS)), ["increment", "sampling", "step", "rate"], H=None)


@cell("UFF 58", "increment", "increment {id}")
@pytest.mark.parametrize("step", [0.0, -1.0 / FS], ids=["zero", "negative"])
def test_impossible_increment(case: Case, step: float) -> None:
    made = record()
    text = time(made["Va"], "Va", VOLT, step=step) + time(made["de"], "de", METRE, step=step)
    case.record(case.text("r.uff", text), ["increment", "sampling", "step", "time"], H=None)


@cell("UFF 58", "increment", "uneven spacing that is even")
def test_abscissae_are_written(case: Case) -> None:
    made = record()
    text = time(made["Va"], "Va", VOLT, uneven=made["t"]) + time(made["de"], "de", METRE, uneven=made["t"])
    case.record(case.text("r.uff", text), ["uneven", "spac", "time"])


@cell("UFF 58", "increment", "uneven spacing: ten samples are missing")
def test_abscissae_have_a_gap(case: Case) -> None:
    made = {name: np.delete(values, slice(1000, 1010)) for name, values in record().items()}
    text = time(made["Va"], "Va", VOLT, uneven=made["t"]) + time(made["de"], "de", METRE, uneven=made["t"])
    case.record(case.text("r.uff", text), ["uneven", "spac", "time", "sampl"], within=0.02)


@cell("UFF 58", "unit", "abscissa in ms")
def test_time_in_ms(case: Case) -> None:
    made = record()
    ms = Axis(TIME, "Time", "ms")
    text = "".join(time(made[n], n, axis, step=1e3 / FS, abscissa=ms) for n, axis in (("Va", VOLT), ("de", METRE)))
    case.record(case.text("r.uff", text), ["ms"])


@cell("UFF 58", "unit", "record of de in {id}")
@pytest.mark.parametrize("unit", ["mm", "um", "µm", "nm"])
def test_record_in_other_units(case: Case, unit: str) -> None:
    made = record()
    factor = {"mm": 1e3, "um": 1e6, "µm": 1e6, "nm": 1e9}[unit]
    text = time(made["Va"], "Va", VOLT) + time(factor * made["de"], "de", Axis(DISPLACEMENT, "Displacement", unit))
    case.record(case.text("r.uff", text, "latin-1"), [unit, "unit"])


@cell("UFF 164", "unit", "record without labels, code 5 (mm)")
def test_record_by_164(case: Case) -> None:
    made = record()
    text = time(made["Va"], "Va", Axis()) + time(1e3 * made["de"], "de", Axis(DISPLACEMENT))
    case.record(case.text("r.uff", units(5, 1e3, 1e3, "mm (milli-newton)") + text), ["164", "mm", "unit"])


@cell("UFF 58", "unit", "acceleration in m/s^2 under the name de")
def test_acceleration(case: Case) -> None:
    made = record()
    text = time(made["Va"], "Va", VOLT) + time(made["de"], "de", Axis(ACCELERATION, "Acceleration", "m/s^2"))
    case.record(case.text("r.uff", text), [r"m/s", "acceleration", "unit"], H=None)


@cell("UFF 58", "label", "de occurs twice")
def test_name_twice(case: Case) -> None:
    made = record()
    text = two(made) + time(3.0 * made["de"], "de", METRE)
    case.frf(case.text("r.uff", text), words=["twice", "more than once", "two"], H=H_de)


@cell("UFF 58", "quality", "record 7 states one value more than there is")
def test_a_value_is_missing(case: Case) -> None:
    made = record()
    made = {name: values[:-1] for name, values in made.items()}
    text = time(made["Va"], "Va", VOLT, count=3600) + time(made["de"], "de", METRE, count=3600)
    case.record(case.text("r.uff", text), ["3600", "3599", "values", "points"], H=None)


@cell("UFF 58", "layout", "odd number of values, the last line filled with {id}")
@pytest.mark.parametrize("fill", [f"{0.0:20.12e}", " " * 20], ids=["a zero", "blanks"])
def test_last_line_is_filled(case: Case, fill: str) -> None:
    made = {name: values[:-1] for name, values in record().items()}
    text = time(made["Va"], "Va", VOLT, fill=fill) + time(made["de"], "de", METRE, fill=fill)
    case.record(case.text("r.uff", text), ["3599", "values", "points"])
    assert case.outcome == {"used"}, "a line that is filled is no defect"


@cell("UFF 58", "layout", "lines end in CR LF")
def test_dos_lines(case: Case) -> None:
    case.record(case.text("r.uff", two(record()).replace("\n", "\r\n")), ["line"])
    assert case.outcome == {"used"}


def binary(values: np.ndarray, name: str, ordinate: Axis, order: str, precision: str) -> bytes:
    """Return data set 58b: record 1 states order of bytes and length, eleven lines follow, then the values."""
    head = time(values[:4], name, ordinate, count=values.size).splitlines(keepends=True)[2:13]
    if precision == "f4":
        head[6] = f"{2:10d}" + head[6][10:]
    data = values.astype(order + precision).tobytes()
    first = f"{58:6d}b{1 if order == '<' else 2:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return f"    -1\n{first}\n".encode() + "".join(head).encode() + data + b"\n    -1\n"


@cell("UFF 58b", "layout", "{id}")
@pytest.mark.parametrize(
    ("order", "precision"),
    [("<", "f8"), (">", "f8"), ("<", "f4"), (">", "f4")],
    ids=["little-endian", "big-endian", "little-endian, single", "big-endian, single"],
)
def test_binary(case: Case, order: str, precision: str) -> None:
    made = record()
    case.path("r.uff").write_bytes(
        binary(made["Va"], "Va", VOLT, order, precision) + binary(made["de"], "de", METRE, order, precision)
    )
    case.record(case.path("r.uff"), ["58b", "binary"])


@cell("UFF 58b", "layout", "stated little-endian, written big-endian")
def test_binary_of_the_other_order(case: Case) -> None:
    made = record()
    text = b"".join(
        binary(made[n].byteswap(), n, axis, "<", "f8") for n, axis in (("Va", VOLT), ("de", METRE))
    )  # fmt: skip
    case.path("r.uff").write_bytes(text)
    case.record(case.path("r.uff"), ["order", "endian", "binary", "size", "large", "10.5", "exceeds", "finite"], H=None)


@cell("UFF 58b", "quality", "the file ends within the values")
def test_binary_is_cut(case: Case) -> None:
    made = record()
    whole = binary(made["Va"], "Va", VOLT, "<", "f8") + binary(made["de"], "de", METRE, "<", "f8")
    case.path("r.uff").write_bytes(whole[:-8000])
    case.record(case.path("r.uff"), ["cut", "3600", "values", "points", "end"], H=None)


# Responses


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


def test_the_words_of_struct_are_those_of_the_format() -> None:
    """The bytes of 58b are IEEE doubles in the stated order."""
    assert binary(np.array([1.0, 2.0, 3.0, 4.0]), "Va", VOLT, ">", "f8").count(struct.pack(">d", 3.0)) == 1
