"""Tables as spreadsheets, LabVIEW, pandas and analysers write them, with the marks of several countries."""

import csv
import io
import re

import numpy as np
import pandas as pd
import pytest

from tests.statements.case import Case, cell
from tests.statements.plant import FS, SHIFT, H_de, H_force, hits, late, record

NAMES = ("t", "Va", "de")


def table(
    made: dict[str, np.ndarray],
    header: tuple[str, ...] = NAMES,
    separator: str = ",",
    decimal: str = ".",
    end: str = "\n",
    factors: tuple[float, ...] = (1.0, 1.0, 1.0),
    form: str = "%.9g",
) -> str:
    """Return a table by pandas: header as written, numbers with nine digits."""
    frame = pd.DataFrame({k: factor * made[name] for k, (name, factor) in enumerate(zip(made, factors, strict=True))})
    body = frame.to_csv(
        sep=separator, decimal=decimal, index=False, header=False, float_format=form, lineterminator=end
    )
    return separator.join(header) + end + body if header else body


# Records: layout


@cell("CSV", "layout", "written by pandas")
def test_plain(case: Case) -> None:
    case.record(case.text("r.csv", table(record())), ["table"])
    assert case.outcome == {"used"}


@cell("CSV", "layout", "{id}")
@pytest.mark.parametrize(
    ("encoding", "separator"),
    [("utf-16", "\t"), ("utf-16-le", "\t"), ("utf-16-be", ","), ("utf-16", ";")],
    ids=["UTF-16 with its mark", "UTF-16 LE without", "UTF-16 BE without", "UTF-16, semicolons"],
)
def test_utf16(case: Case, encoding: str, separator: str) -> None:
    text = table(record(), ("t [s]", "Va [V]", "de [m]"), separator, end="\r\n")
    case.record(case.text("r.txt" if separator == "\t" else "r.csv", text, encoding), ["UTF-16"])


@cell("CSV", "layout", "UTF-8 with its mark, CR LF")
def test_utf8_mark(case: Case) -> None:
    case.record(case.text("r.csv", table(record(), end="\r\n"), "utf-8-sig"), ["UTF-8"])
    assert case.outcome == {"used"}


@cell("CSV", "layout", "lines end in CR alone")
def test_old_mac(case: Case) -> None:
    case.record(case.text("r.csv", table(record(), end="\n").replace("\n", "\r")), ["line", "CR"])


@cell("CSV", "layout", "header in cp1252: {id}")
@pytest.mark.parametrize("header", ["t [µs]", "Größe"], ids=["micro", "umlauts"])
def test_cp1252(case: Case, header: str) -> None:
    if header.startswith("t"):
        text = table(record(), (header, "Va [V]", "de [µm]"), factors=(1e6, 1.0, 1e6))
        case.record(case.text("r.csv", text, "cp1252"), ["cp1252", "1252", "UTF-8", "µ"])
    else:
        text = table(record(), ("t", "Va", header))
        case.record(case.text("r.csv", text, "cp1252"), ["1252", "UTF-8"], channels={"de": header})


@cell("CSV", "layout", "`sep=;` above the names, as Excel reads it")
def test_sep(case: Case) -> None:
    case.record(case.text("r.csv", "sep=;\n" + table(record(), separator=";", decimal=",")), ["line 1", "sep="])


@cell("CSV", "layout", "{id} above the names")
@pytest.mark.parametrize(
    "above",
    ["Operator,Test\nDate,2026-11-20\nSample rate,2000\n\n", "My measurement\n", "# made by X\n# 2026-11-20\n", "\n\n"],
    ids=["a preamble with a rate", "a title", "comments (#)", "empty lines"],
)
def test_preamble(case: Case, above: str) -> None:
    case.record(
        case.text("r.csv", above + table(record())), ["line 1", "first line", "preamble", "comment", "title", "#"]
    )


@cell("CSV", "increment", "the preamble says 4000 Hz, the time 2000 Hz")
def test_rate_of_the_preamble(case: Case) -> None:
    text = "Sample rate [Hz],4000\n\n" + table(record())
    # A preamble that is only skipped leaves the time, which is right: the rate beside it may not go unseen.
    case.record(case.text("r.csv", text), ["line 1", "first line", "preamble", "rate", "4000"], H=None)


@cell("CSV", "layout", "names from numpy, behind #")
def test_savetxt(case: Case) -> None:
    np.savetxt(
        case.path("r.csv"), np.column_stack(list(record().values())), delimiter=",", header="t,Va,de", fmt="%.9g"
    )
    case.record(case.path("r.csv"), ["#", "line 1", "first line", "comment"])


@cell("CSV", "label", "no names, numbers alone")
def test_no_names(case: Case) -> None:
    case.record(case.text("r.csv", table(record(), ())), ["name", "header"], H=None)


@cell("CSV", "label", "unnamed index of pandas before the time")
def test_index_of_pandas(case: Case) -> None:
    frame = pd.DataFrame(record())
    frame.to_csv(case.path("r.csv"), float_format="%.9g")
    case.record(case.path("r.csv"), ["name", "empty", "column 1", "first column"])


@cell("CSV", "layout", "a separator more at the end of {id}")
@pytest.mark.parametrize("lines", ["each line", "the values"])
def test_trailing_separator(case: Case, lines: str) -> None:
    head, _, body = table(record()).partition("\n")
    text = head + ("," if lines == "each line" else "") + "\n" + body.replace("\n", ",\n")
    case.record(case.text("r.csv", text), ["empty", "trailing", "at the end", "without a name"])


@cell("CSV", "layout", "every field in quotes")
def test_quotes(case: Case) -> None:
    out = io.StringIO()
    writer = csv.writer(out, quoting=csv.QUOTE_ALL, lineterminator="\r\n")
    made = record()
    writer.writerow(["t [s]", "Va [V]", "de [m]"])
    writer.writerows([f"{x:.9g}" for x in row] for row in zip(*made.values(), strict=True))
    case.record(case.text("r.csv", out.getvalue()), ["quot"])


@cell("CSV", "layout", "columns apart by {id}")
@pytest.mark.parametrize("separator", ["\t", "   "], ids=["tabs", "blanks"])
def test_other_separators(case: Case, separator: str) -> None:
    text = table(record(), separator="\t").replace("\t", separator)
    case.record(case.text("r.txt", text), ["separat", "column", "blank", "space"])


@cell("CSV", "label", "two columns are called de")
def test_column_twice(case: Case) -> None:
    made = record()
    made = {**made, "again": 3.0 * made["de"]}
    text = table(made, ("t", "Va", "de", "de"), factors=(1.0,) * 4)
    case.frf(case.text("r.csv", text), words=["twice", "more than once", "unique", "two columns"], H=None)


@cell("CSV", "label", "blanks around the names")
def test_blanks_around_names(case: Case) -> None:
    case.record(case.text("r.csv", table(record(), (" t ", " Va", "de "))), ["name", "blank", "Va"])


@cell("CSV", "label", "names in other letters: T, VA, DE")
def test_capitals(case: Case) -> None:
    case.frf(case.text("r.csv", table(record(), ("T", "VA", "DE"))), words=["Va"])


@cell("CSV", "label", "a column of text beside the numbers")
def test_column_of_text(case: Case) -> None:
    lines = table(record()).splitlines()
    text = "\n".join([lines[0] + ",remark", *(line + ",ok" for line in lines[1:])]) + "\n"
    case.record(case.text("r.csv", text), ["remark", "text", "number", "ok"])


# Records: start and increment


@cell("CSV", "start", "time starts at {id}")
@pytest.mark.parametrize("start", [5.0, -0.1, 1.7e9], ids=["5 s", "-0.1 s", "1.7e9 s (epoch)"])
def test_start_of_time(case: Case, start: float) -> None:
    made = record()
    made["t"] = start + made["t"]
    # Sixteen digits of an epoch are 0.2 us, 5e-4 of a step.
    case.record(case.text("r.csv", table(made, form="%.17g")), ["time", "start"], within=2e-3)


@cell("CSV", "start", "a column of time for each channel, that of de 5 ms later")
def test_two_times(case: Case) -> None:
    made = late()
    made = {"t": made["t"], "Va": made["Va"], "t2": made["t"] + SHIFT / FS, "de": made["de"]}
    text = table(made, ("Time 1 [s]", "Va [V]", "Time 2 [s]", "de [m]"), factors=(1.0,) * 4)
    case.frf(case.text("r.csv", text), words=["Time 2", "two times", "time axes", "columns of time"], H={"de": H_de})


@cell("CSV", "increment", "two columns of time, `t` and `time`, that differ")
def test_two_times_that_differ(case: Case) -> None:
    made = record()
    made = {**made, "time": 2.0 * made["t"]}
    text = table(made, ("t", "Va", "de", "time"), factors=(1.0,) * 4)
    case.frf(case.text("r.csv", text), words=["time", r"\bt\b"], H=None)


@cell("CSV", "unit", "time as {id}")
@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("t [ms]", 1e3), ("Time (ms)", 1e3), ("time_ms", 1e3), ("t/ms", 1e3), ("t [µs]", 1e6), ("t [us]", 1e6),
        ("Zeit in ms", 1e3), ("Time [min]", 1 / 60), ("t [s]", 1.0), ("Time (seconds)", 1.0), ("t [msec]", 1e3),
    ],
    ids=["t [ms]", "Time (ms)", "time_ms", "t over ms", "t [micro s]", "t [us]", "Zeit in ms", "Time [min]", "t [s]",
         "Time (seconds)", "t [msec]"],
)  # fmt: skip
def test_unit_of_time(case: Case, name: str, factor: float) -> None:
    text = table(record(), (name, "Va", "de"), factors=(factor, 1.0, 1.0), form="%.12g")
    case.record(case.text("r.csv", text), ["unit", "ms", "msec", "min", "seconds", re.escape(name)])


@cell("CSV", "unit", "time in {id}, nothing says so")
@pytest.mark.parametrize("factor", [1e3, 1e6, 1e9], ids=["ms", "us", "ns"])
def test_time_without_unit(case: Case, factor: float) -> None:
    text = table(record(), factors=(factor, 1.0, 1.0), form="%.12g")
    case.record(case.text("r.csv", text), ["did you mean", "sampling", "ms"])


@cell("CSV", "unit", "hits with time in ms, nothing says so")
def test_time_of_hits_without_unit(case: Case) -> None:
    text = table(hits(), ("t", "force [N]", "x [m]"), factors=(1e3, 1.0, 1.0), form="%.12g")
    path = case.text("h.csv", text)
    case.frf(
        path, words=["did you mean", "sampling", "ms"], options=["--hammer", "--input", "force"], H=H_force, within=0.01
    )


@cell("CSV", "unit", "hits with Time (ms)")
def test_time_of_hits(case: Case) -> None:
    text = table(hits(), ("Time (ms)", "force [N]", "x [um]"), factors=(1e3, 1.0, 1e6), form="%.12g")
    path = case.text("h.csv", text)
    case.frf(path, words=["ms", "unit"], options=["--hammer", "--input", "force"], H={"x": H_force}, within=0.01)


@cell("CSV", "unit", "hits of two files, x in m and in mm")
def test_hits_of_two_units(case: Case) -> None:
    metres = case.text("a.csv", table(hits(3), ("t [s]", "force [N]", "x [m]"), form="%.12g"))
    mm = table(hits(3), ("t [s]", "force [N]", "x [mm]"), factors=(1.0, 1.01, 1.01e3), form="%.12g")
    options = ["--hammer", "--input", "force"]
    case.frf(metres, case.text("b.csv", mm), words=["mm", "unit"], options=options, H={"x": H_force}, within=0.01)


@cell("CSV", "unit", "hits of two files, force in N and in lbf")
def test_hits_of_two_units_of_force(case: Case) -> None:
    newton = case.text("a.csv", table(hits(3), ("t [s]", "force [N]", "x [m]"), form="%.12g"))
    pounds = table(hits(3), ("t [s]", "force [lbf]", "x [m]"), factors=(1.0, 1.01 / 4.4482216, 1.01), form="%.12g")
    options = ["--hammer", "--input", "force"]
    case.frf(newton, case.text("b.csv", pounds), words=["lbf", "unit"], options=options, H={"x": H_force}, within=0.01)


@cell("CSV", "scale", "hits of reversed polarity: said, wherever the sign is turned")
def test_reversed_hammer(case: Case) -> None:
    made = hits()
    made["force"] = -made["force"]
    path = case.text("h.csv", table(made, ("t [s]", "force [N]", "x [m]"), form="%.12g"))

    def right(response: dict[str, object]) -> None:
        assert response["impacts"], response

    for turned in (H_force, lambda f: -H_force(f)):  # as recorded, or turned: either way with a word
        try:
            case.frf(
                path,
                words=["polarity", "sign", "negative"],
                options=["--hammer", "--input", "force"],
                H={"x": turned},
                within=0.01,
                check=right,
                said="polarity|sign|negative|revers",
            )
            return
        except AssertionError as error:
            last = error
            if "used without a word" in str(error):
                raise
    raise last


@cell("CSV", "increment", "time as {id}")
@pytest.mark.parametrize(
    "form",
    [
        "2026-11-20 10:00:00.000000",
        "20.11.2026 10:00:00,0000",
        "10:00:00.000000",
        "00:00,0000",
        "11/20/2026 10:00:00.000 AM",
    ],
    ids=["date of pandas", "German date", "time of day", "minutes of Excel", "US date in ms"],
)
def test_dates(case: Case, form: str) -> None:
    made = record()
    stamps = pd.Timestamp("2026-11-20 10:00:00") + pd.to_timedelta(made["t"], unit="s")
    write = {
        "2026": lambda x: x.isoformat(sep=" ", timespec="microseconds"),
        "20.1": lambda x: x.strftime("%d.%m.%Y %H:%M:%S,") + f"{x.microsecond // 100:04d}",
        "10:0": lambda x: x.strftime("%H:%M:%S.%f"),
        "00:0": lambda x: x.strftime("%M:%S,") + f"{x.microsecond // 100:04d}",
        "11/2": lambda x: x.strftime("%m/%d/%Y %I:%M:%S.") + f"{x.microsecond // 1000:03d} AM",
    }[form[:4]]
    comma = "," in form
    separator = ";" if comma else ","
    rows = [
        separator.join([write(stamp), *(f"{x:.9g}".replace(".", "," if comma else ".") for x in values)])
        for stamp, *values in zip(stamps, made["Va"], made["de"], strict=True)
    ]
    text = "\n".join([separator.join(("Time", "Va", "de")), *rows]) + "\n"
    case.record(
        case.text("r.csv", text), ["date", "clock", "time of day", "--ts"], H=None if form.startswith("11/") else H_de
    )


@cell("CSV", "increment", "time as serial days of a spreadsheet")
def test_serial_days(case: Case) -> None:
    made = record()
    made["t"] = 46346.5 + made["t"] / 86400.0
    case.record(
        case.text("r.csv", table(made, ("Time", "Va", "de"), form="%.15g")),
        ["days", "date", "sampling"],
        within=0.05,
    )


@cell("CSV", "increment", "time written with three decimals: each value twice")
def test_rounded_time(case: Case) -> None:
    lines = table(record()).splitlines()
    t = record()["t"]
    text = "\n".join([lines[0], *(f"{x:.3f},{line.partition(',')[2]}" for x, line in zip(t, lines[1:], strict=True))])
    case.record(case.text("r.csv", text + "\n"), ["time", "twice", "steps", "sampl", "digits"])


@cell("CSV", "increment", "a counter `n` in place of a time")
def test_counter(case: Case) -> None:
    made = record()
    made["t"] = np.arange(made["t"].size)
    case.record(case.text("r.csv", table(made, ("n", "Va", "de"))), ["time", "--ts"], H=None)


@cell("CSV", "increment", "ten lines are missing")
def test_missing_lines(case: Case) -> None:
    lines = table(record()).splitlines()
    case.record(
        case.text("r.csv", "\n".join(lines[:1000] + lines[1010:]) + "\n"), ["time", "lost", "gap", "sampl"], within=0.02
    )


# Records: unit and scale


@cell("CSV", "unit", "de as {id}")
@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("de [nm]", 1e9), ("de (nm)", 1e9), ("de_nm", 1e9), ("de/nm", 1e9), ("de [µm]", 1e6), ("de [μm]", 1e6),
        ("de [mm]", 1e3), ("de in nm", 1e9), ("de [Nm]", 1e9), ("de, nm", 1e9),
    ],
    ids=["de [nm]", "de (nm)", "de_nm", "de over nm", "de [micro m]", "de [mu m]", "de [mm]", "de in nm",
         "de [Nm], a torque", "de comma nm"],
)  # fmt: skip
def test_unit_of_a_column(case: Case, name: str, factor: float) -> None:
    header = ("t [s]", "Va [V]", f'"{name}"' if "," in name else name)
    torque = name == "de [Nm]"
    text = table(record(), header, factors=(1.0, 1.0, factor))
    case.record(case.text("r.csv", text), ["unit", "nm", "mm", re.escape(name)], H=None if torque else H_de)


@cell("CSV", "unit", "a line of units below the names")
def test_line_of_units(case: Case) -> None:
    head, _, body = table(record(), factors=(1.0, 1e3, 1e9)).partition("\n")
    case.record(case.text("r.csv", f"{head}\ns,mV,nm\n{body}"), ["unit", "nm", "line 2", "row 1", "row 2"])


@cell("CSV", "unit", "de [{id}]: no length")
@pytest.mark.parametrize("unit", ["%", "counts", "V", "m/s2", "dB"])
def test_unit_of_another_kind(case: Case, unit: str) -> None:
    case.record(
        case.text("r.csv", table(record(), ("t [s]", "Va [V]", f"de [{unit}]"))), [unit, "unit", "percent"], H=None
    )


@cell("CSV", "unit", "Va in mV and kV")
def test_unit_of_the_drive(case: Case) -> None:
    text = table(record(), ("t [s]", "Va [mV]", "de [m]"), factors=(1.0, 1e3, 1.0))
    case.record(case.text("r.csv", text), ["mV", "unit"])


@cell("CSV", "scale", "Va in numbers of a 16-bit converter")
def test_counts(case: Case) -> None:
    made = record()
    made["Va"] = np.round(made["Va"] / 1e-4)
    case.record(case.text("r.csv", table(made)), ["10.5", "counts", "volt", r"\bV\b"], H=None)


@cell("CSV", "scale", "decimal commas, semicolons")
def test_decimal_commas(case: Case) -> None:
    case.record(case.text("r.csv", table(record(), separator=";", decimal=",")), ["comma"])
    assert case.outcome == {"used"}


def grouped(mark: str, decimal: str, separator: str, quote: bool = False) -> str:
    """Return a record with de in nm without decimals, grouped by a thousands mark as a spreadsheet prints it."""
    made = record()
    lines = [separator.join(("t [s]", "Va [V]", "de [nm]"))]
    for t, va, de in zip(made["t"], made["Va"], 1e9 * made["de"], strict=True):
        shown = f"{de:,.2f}".replace(",", "\0").replace(".", decimal).replace("\0", mark)
        text = [f"{t:.4f}".replace(".", decimal), f"{va:.9f}".replace(".", decimal), shown]
        lines.append(separator.join(f'"{x}"' if quote and separator in x else x for x in text))
    return "\n".join(lines) + "\n"


# Two decimals of a nanometre beside some thousands: 1e-6 of the record, a line of it holds a hundredth of that: 1e-3.
@cell("CSV", "scale", "thousands marks: {id}")
@pytest.mark.parametrize(
    ("mark", "decimal", "separator", "quote"),
    [
        (".", ",", ";", False), (",", ".", ",", True), (",", ".", ";", False), (",", ".", "\t", False),
        (" ", ",", ";", False), ("\u00a0", ",", ";", False), ("\u202f", ",", ";", False), ("'", ".", ";", False),
        ("’", ".", ";", False), ("_", ".", ",", False),
    ],
    ids=["12.345,67", "quoted 12,345.67", "12,345.67 with semicolons", "12,345.67 with tabs", "12 345,67",
         "12 345,67 with no-break space", "12 345,67 with narrow space", "12'345.67",
         "12 345.67 with typographic apostrophe", "12_345.67"],
)  # fmt: skip
def test_thousands(case: Case, mark: str, decimal: str, separator: str, quote: bool) -> None:
    text = grouped(mark, decimal, separator, quote)
    case.record(case.text("r.csv", text), ["thousand", "group", "decimal", "mark"], within=5e-3)


@cell("CSV", "scale", "thousands marks without decimals: {id}")
@pytest.mark.parametrize(
    ("mark", "decimal", "separator"),
    [(".", ",", ";"), (",", ".", ";"), (",", ".", "\t"), ("'", ".", ";")],
    ids=["12.345 beside 0,25", "12,345 beside 0.25, semicolons", "12,345 beside 0.25, tabs", "12'345 beside 0.25"],
)
def test_whole_thousands(case: Case, mark: str, decimal: str, separator: str) -> None:
    # About 50 um each value has five digits: read with the mark as a decimal it is a thousand times too small. A step
    # of a nanometre beside 200 nm of a line, over nine periods, is 1e-4.
    made = record()
    lines = [separator.join(("t [s]", "Va [V]", "de [nm]"))]
    for t, va, de in zip(made["t"], made["Va"], np.round(1e9 * (made["de"] + 50e-6)), strict=True):
        shown = f"{de:,.0f}".replace(",", mark)
        lines.append(separator.join([f"{t:.4f}".replace(".", decimal), f"{va:.9f}".replace(".", decimal), shown]))
    path = case.text("r.csv", "\n".join(lines) + "\n")
    case.record(path, ["thousand", "group", "decimal", "mark"], within=5e-3)


@cell("CSV", "scale", "decimal commas between commas")
def test_commas_for_both(case: Case) -> None:
    path = case.text("r.csv", table(record(), separator=";", decimal=",", form="%.9f").replace(";", ","))
    case.record(path, ["comma", "fields"], H=None)


@cell("CSV", "quality", "{id} among the values")
@pytest.mark.parametrize(
    "word",
    ["NaN", "#N/A", "-1.#IND", "OL", "---", "", "#DIV/0!", "1e400"],
    ids=["NaN", "#N/A", "-1.#IND", "OL", "---", "an empty field", "#DIV/0!", "1e400"],
)
def test_no_number(case: Case, word: str) -> None:
    lines = table(record()).splitlines()
    lines[100] = lines[100].rpartition(",")[0] + "," + word
    words = ["NaN", "number", "empty", "row 99", "row 100", "line 101", "inf", "finite"]
    case.record(case.text("r.csv", "\n".join(lines) + "\n"), words, H=None)


@cell("CSV", "quality", "the last line is cut within a {id}")
@pytest.mark.parametrize("cut", ["number", "line"])
def test_cut(case: Case, cut: str) -> None:
    text = table(record()).rstrip("\n")
    text = text[:-6] if cut == "number" else text.rpartition(",")[0]
    case.record(case.text("r.csv", text), ["cut", "last"], H=None)


@cell("CSV", "quality", "the last line has no end of line")
def test_no_last_newline(case: Case) -> None:
    # Spreadsheets leave it out: nothing is lost, and nothing shows whether it is.
    case.record(case.text("r.csv", table(record()).rstrip("\n")), ["last line", "end"])
