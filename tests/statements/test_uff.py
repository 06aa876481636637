"""Universal files: data set 58 by pyuff, and line by line from the public description of 58, 58b and 164."""

import struct
from dataclasses import dataclass

import numpy as np
import pytest
import pyuff

from tests.statements.case import Case, cell
from tests.statements.plant import FS, SHIFT, H_de, late, record, response

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


def test_the_bytes_of_58b_are_those_of_its_description() -> None:
    """The bytes of 58b are IEEE doubles in the stated order."""
    assert binary(np.array([1.0, 2.0, 3.0, 4.0]), "Va", VOLT, ">", "f8").count(struct.pack(">d", 3.0)) == 1
