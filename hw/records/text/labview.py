"""Header of LabVIEW measurement files (.lvm): two blocks of statements above a table, each of them used or refused.

The form is that of the maker's specification of the LabVIEW measurement file; its shapes were checked on public files.
"""

from collections.abc import Mapping, Sequence

from checks.errors import RecordError
from hw.records.text.layout import EMPTY, NUMBERS, Layout, split
from specs.units import parse_header

MAGIC, END = "LabVIEW Measurement", "***End_of_Header***"
_APART = {"tab": "\t", "comma": ","}
# What these state of operator, place and day changes no number.
_SPOKEN = {"Writer_Version", "Reader_Version", "Time_Pref", "Operator", "Description", "Project", "Notes", "Test_Name",
           "Test_Numbers", "Test_Series", "Model_Number", "Serial_Number", "UUT_Name", "UUT_S/N", "UUT_M/N",
           "Y_Dimension", "X_Unit_Label"}  # fmt: skip
_UNITS = {"volts": "V", "meters": "m", "newtons": "N"}  # as the maker's drivers write them
_USED = {"Separator", "Decimal_Separator", "Multi_Headings", "X_Columns", "Channels", "Samples", "Date", "Time",
         "Y_Unit_Label", "X_Dimension", "X0", "Delta_X"}  # fmt: skip


def lvm_layout(file: str, lines: Sequence[str]) -> Layout:
    """Return the layout of a LabVIEW measurement file. Raises RecordError for several segments, channels with times of
    their own, and a statement that is not known here."""
    ends = [i for i, line in enumerate(lines) if line.startswith(END)]
    if len(ends) != 2 or ends[1] + 2 >= len(lines):
        raise RecordError(f"{file}: has {len(ends)} lines {END}, expected two and one table below: one segment a file")
    comma = any(line.replace(" ", "").lower().startswith("separator,") for line in lines[: ends[0]])
    apart = "," if comma else "\t"
    above = _statements(file, lines, 1, ends[0], apart)
    segment = _statements(file, lines, ends[0] + 1, ends[1], apart)
    decimal = above.get("Decimal_Separator", ["."])[0] or "."
    x_columns = above.get("X_Columns", ["One"])[0].lower()
    if x_columns not in ("one", "no") or _APART.get(above.get("Separator", ["tab"])[0].lower()) != apart:
        raise RecordError(
            f"{file}: states X_Columns {x_columns} and Separator {above.get('Separator', ['Tab'])[0]}; expected "
            "X_Columns One or No and Separator Tab or Comma"
        )
    header = ends[1] + 1
    heads = [name for name in split(lines[header], apart) if name]
    if len(heads) < 2:
        raise RecordError(f"{file}: line {header + 1} holds '{lines[header][:60]}', expected X_Value and the channels")
    commented = heads[-1] == "Comment"
    names = heads[1 : -1 if commented else None]
    count = len(names)
    samples = [int(n) if n.isdecimal() else 0 for n in _row(segment, "Samples", count, "0")]
    live = [i for i in range(count) if samples[i] or not any(samples)]
    start, step = _clock(file, segment, live, count, decimal)
    labels = _row(segment, "Y_Unit_Label", count, "")
    units = [
        _UNITS.get(label.lower(), label) or parse_header(name)[1] for label, name in zip(labels, names, strict=True)
    ]
    kinds = [NUMBERS if i in live else EMPTY for i in range(count)]
    is_spectrum = segment.get("X_Dimension", ["Time"])[0] == "Frequency"
    time, clock = ("f", "Hz") if is_spectrum else ("t", "s"), None  # name and unit of the column X_Value
    columns = list(range(1, count + 1))
    if x_columns == "one":
        names, units, kinds, columns = [time[0], *names], [time[1], *units], [NUMBERS, *kinds], [0, *columns]
        _vet_rows(file, lines, header + 1, apart, start, step, decimal)
    else:
        clock = (start, step)
    remarks = [f"time {time[0]} from X0 = {start:g} and Delta_X = {step:g}"] if clock else []
    remarks += ["column 'Comment' is left out"] if commented else []
    return Layout(
        heads=tuple(names),
        units=tuple(units),
        kinds=tuple(kinds),
        columns=tuple(columns),
        width=count + 1,
        header=header,
        first=header + 1,
        apart=apart,
        decimal=decimal,
        clock=clock,
        commented=commented,
        samples=max(samples, default=0),
        remarks=tuple(remarks),
    )


def _statements(file: str, lines: Sequence[str], start: int, end: int, apart: str) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for i in range(start, end):
        key, *values = split(lines[i], apart)
        if key and key not in _SPOKEN | _USED:
            raise RecordError(f"{file}: line {i + 1} states '{lines[i].strip()[:60]}', which is not used here; delete "
                              "the line if the numbers hold without it")  # fmt: skip
        if key:
            found[key] = values or [""]
    return found


def _row(segment: Mapping[str, Sequence[str]], key: str, count: int, default: str) -> list[str]:
    """Return the values of a statement, one for each channel."""
    given = list(segment.get(key, ()))[:count]
    return [each or default for each in given] + [default] * (count - len(given))


def _clock(
    file: str, segment: Mapping[str, Sequence[str]], live: Sequence[int], count: int, decimal: str
) -> tuple[float, float]:
    """Return start and step that all channels have. Raises RecordError if they have several."""
    default = {"X0": "0", "X_Dimension": "Time"}
    own: dict[str, list[str | float]] = {}
    for key in ("X_Dimension", "Date", "Time", "X0", "Delta_X"):
        texts = [_row(segment, key, count, default.get(key, ""))[i] for i in live]
        try:
            values = [float(text.replace(decimal, ".")) if key in ("X0", "Delta_X") else text for text in texts]
        except ValueError as e:
            raise RecordError(f"{file}: states {key} {', '.join(texts)}; expected a number for each channel") from e
        own[key] = list(dict.fromkeys(values))
        if len(own[key]) != 1:
            words = f"{file}: its channels have several {key}: {', '.join(dict.fromkeys(texts))}"
            raise RecordError(f"{words}; one record has one time: write one file for each")
    if own["X_Dimension"][0] not in ("Time", "Frequency"):
        raise RecordError(f"{file}: states X_Dimension {own['X_Dimension'][0]}; expected Time or Frequency")
    start, step = float(own["X0"][0]), float(own["Delta_X"][0])
    if not step > 0.0:
        raise RecordError(f"{file}: states Delta_X {step:g}; expected a step above zero")
    return start, step


def _vet_rows(file: str, lines: Sequence[str], first: int, apart: str, start: float, step: float, decimal: str) -> None:
    """Raise RecordError if X_Value of the first rows is not as X0 and Delta_X state, to its six decimals."""
    try:
        x = [float(split(line, apart)[0].replace(decimal, ".")) for line in lines[first : first + 2] if line.strip()]
    except ValueError:
        return  # said where the rows are read
    near = max(1.1e-6, 1e-3 * step)
    if len(x) == 2 and not (abs(x[0] - start) <= near and abs(x[1] - x[0] - step) <= near):
        raise RecordError(
            f"{file}: states X0 = {start:g}, Delta_X = {step:g}, but X_Value begins {x[0]:g}, {x[1]:g}: which is right?"
        )
