"""Text tables as other programs write them, by every door: what they state is used, or refused with line and column."""

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from accept.analysis.record_responses import read_any
from accept.fleet import gauge
from accept.fleet.errors import FleetError
from checks.declare import CsvTable, Series
from checks.errors import RecordError
from checks.record import Record
from hw import records
from hw.records.responses import read_response_file
from specs.bench import channel_map

N, FS = 400, 4000.0
T = np.arange(N) / FS
RNG = np.random.default_rng(48)
VA = np.round(RNG.standard_normal(N), 6)
DE_NM = np.round(2000.0 * np.roll(VA, 3), 3)
SERIES = Series("low", "a record", {"Va": "V", "de": "m"})
HEIGHTS = CsvTable("points", "Heights", ("x_mm", "y_mm", "z_um"), min_rows=2)
LIBRARY = ("could not convert", "codec", "zero-size", "invalid literal", "Error:", "array")
WRONG_WAY = "record again"


def table(sep: str = ",", decimal: str = ".", heads: tuple[str, ...] = ("t", "Va [V]", "de [nm]")) -> str:
    """The record as pandas writes it."""
    frame = pd.DataFrame(dict(zip(heads, (T, VA, DE_NM), strict=True)))
    return str(frame.to_csv(sep=sep, decimal=decimal, index=False))


def write(folder: Path, text: str | bytes, name: str = "r.csv", encoding: str = "utf-8") -> Path:
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return folder / name


def read(path: Path, **names: str) -> Record:
    return records.read(path, SERIES, names)


def same(record: Record) -> None:
    """By both doors of records the numbers are those that were written; nine digits of the times are."""
    np.testing.assert_allclose(record.t - record.t[0], T, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record["Va"], VA, rtol=0, atol=1e-12)
    np.testing.assert_allclose(record["de"], DE_NM * 1e-9, rtol=1e-12)


def both_doors(path: Path) -> None:
    same(read(path))
    same(read_any(path, "Va", {}, None))


def refused(path: Path, *words: str) -> str:
    """Both doors refuse in the same words, none of them a library's."""
    said = []
    for door in (lambda: read(path), lambda: read_any(path, "Va", {}, None)):
        with pytest.raises(RecordError) as error:
            door()
        said.append(str(error.value))
        for each in words:
            assert each in said[-1]
        assert not any(each in said[-1] for each in (*LIBRARY, WRONG_WAY))
        assert said[-1].startswith(path.name)
    return said[0]


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"], ids=lambda e: e
)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["lf", "crlf", "cr"])
@pytest.mark.parametrize("sep", [",", ";", "\t"], ids=["comma", "semicolon", "tab"])
def test_encodings_ends_of_lines_and_separators(encoding, end, sep, tmp_path):
    text = table(sep, heads=("t", "Va", "de [µm]")).replace("\n", end)
    mark = "\ufeff" if encoding[-3:] in ("-le", "-be") else ""
    path = write(tmp_path, mark + text, encoding=encoding)
    record = read(path)
    np.testing.assert_allclose(record["de"], DE_NM * 1e-6, rtol=1e-12)
    np.testing.assert_allclose(read_any(path, "Va", {}, None)["Va"], VA, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (table().encode("utf-16-le"), "is UTF-16 without its mark (BOM); save it as UTF-8"),
        (table().encode("utf-16-be"), "is UTF-16 without its mark"),
        (table().encode("utf-32"), "is UTF-32; save it as UTF-8"),
        (table().encode("utf-32-le"), "is UTF-32 without its mark"),
        (table().encode("utf-16")[:-1], "is UTF-16 and breaks off"),
        (b"PK\x03\x04\x14\x00\x00\x00" + bytes(range(256)) * 9, "is not text: byte 6 is zero"),
        (b"t,Va,de\n" + b"\x81\x8d\n", "is neither UTF-8 nor Windows-1252 (byte 9 is 0x81)"),
    ],
)
def test_what_is_not_read_as_text_is_called_by_its_name(raw, words, tmp_path):
    refused(write(tmp_path, raw), words)


@pytest.mark.parametrize("suffix", ["csv", "txt", "dat", "tsv", "asc"])
def test_blanks_between_the_fields_and_names_in_a_comment(suffix, tmp_path):
    """As numpy's savetxt writes it, and padded as gnuplot's tables are."""
    out = io.StringIO()
    np.savetxt(out, np.c_[T, VA, DE_NM], fmt="%15.9g", header="t Va [V] de [nm]")
    both_doors(write(tmp_path, out.getvalue(), f"r.{suffix}"))


@pytest.mark.parametrize("sep", [";", "\t", " "])
def test_decimal_commas(sep, tmp_path):
    both_doors(write(tmp_path, table(sep, ",").replace(" [", "[") if sep == " " else table(sep, ",")))


def test_quoted_numbers_and_names(tmp_path):
    frame = pd.DataFrame({"t": T, "Va, at the DAC [V]": VA, "de [nm]": DE_NM}).map(lambda x: repr(float(x)))
    text = frame.map(lambda x: x.replace(".", ",")).to_csv(index=False, quoting=1)
    record = read(write(tmp_path, text), Va="Va, at the DAC")
    np.testing.assert_allclose(record["Va"], VA, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: s.replace("\n", ";12.345\n").replace("];12.345", "];da"), ["'12.345' in column 'da'", "'0,0'"]),
        (lambda s: s.replace(",", "."), []),  # one mark alone is the decimal one
        (lambda s: s.replace("\n0,0;", "\n1.234,5;"), ["line 2 holds '1.234,5' in column 't': write the numbers"]),
        (lambda s: s.replace("\n0,0;", "\n1,234,567;"), ["line 2: column 't' holds '1,234,567'", "thousands marks"]),
        (lambda s: s.replace("\n0,0;", "\n1 234,5;"), ["line 2: column 't' holds '1 234,5'", "thousands marks"]),
        (lambda s: s.replace("\n0,0;", "\n1'234,5;"), ["line 2: column 't' holds '1'234,5'", "thousands marks"]),
        (lambda s: s.replace("\n0,0;", "\n1\u202f234,5;"), ["line 2: column 't'", "thousands marks"]),
        (lambda s: s.replace("\n0,0;", "\n\u22120,1;"), ["line 2: column 't'", "write '-' for its sign"]),
    ],
)  # fmt: skip
def test_marks_that_contradict_each_other(change, words, tmp_path):
    path = write(tmp_path, change(table(";", ",")))
    if words:
        refused(path, *words)
    else:
        both_doors(path)


def test_points_in_thousands_of_one_column_alone(tmp_path):
    """998, 999, 1.000, 1.001: whole nanometres as a German export groups them."""
    grouped = [f"{n:,}".replace(",", ".") for n in range(900, 900 + N)]
    rows = [f"{k};{k % 7};{v}" for k, v in enumerate(grouped)]
    refused(write(tmp_path, "\n".join(["t [ms];Va;de [nm]", *rows, ""])), "'900'", "'1.000'", "thousands or decimals?")


def test_three_decimals_are_no_thousands(tmp_path):
    text = table(",", heads=("t", "Va", "de [nm]"))
    path = write(tmp_path, text.replace("\n0.0,", "\n0,"))  # a whole number among three decimals
    same(read(path))
    frame = gauge.read_table(write(tmp_path, "nr;value\n1;9,247\n2;9,252\n3;9,250\n", "g.csv"), ("value",))
    assert frame["value"].tolist() == [9.247, 9.252, 9.25]


def test_decimal_commas_between_commas(tmp_path):
    path = write(tmp_path, "t,Va\n" + "".join(f"0,{k:04d},1,5\n" for k in range(N)))
    refused(path, "line 2: row 1 has 4 fields, the header has 2; decimal commas need ';' between the fields")


@pytest.mark.parametrize(
    ("bare", "first", "sep"),
    [
        ("sep=;\n", "", ";"),
        ("Operator;Test\nDate;2026-11-20\nSample rate;4000\n\n", "lines 1 to 3", ";"),
        ("# taken by Ann\n# on the long bench\n", "lines 1 to 2", ","),
        ("% comment, with a comma\n", "line 1", "\t"),
        ("".join(f"# line {k}\n" for k in range(300)), "lines 1 to 300", ","),
        ("Kanal 0;Kanal 1;Kanal 2\n", "line 1", ";"),
        ("fs = 4000 Hz\n", "line 1", ","),
        ("Unit: A-01\nVerstaerker: PD200\n", "lines 1 to 2", ","),
        ("Sample interval [ms];0,25\n", "line 1", ";"),
    ],
)
def test_lines_above_the_names(bare, first, sep, tmp_path):
    path = write(tmp_path, bare + table(sep, "," if "0,25" in bare else "."))
    record = read(path)
    same(record)
    assert first in "".join(record.remarks)
    same(read_any(path, "Va", {}, None))


@pytest.mark.parametrize(
    ("bare", "words"),
    [
        ("Gain,20\n", "line 1 states 'Gain,20', which is not used"),
        ("# scale factor: 0.1\n", "which is not used"),
        ("Operator,Ann\nUnit,mV\n", "line 2 states 'Unit,mV'"),
        ("Sample rate,5000\n", "a sampling time of 0.0002 s, but column 't' has steps of 0.00025 s"),
        ("dt = 1 ms\n", "a sampling time of 0.001 s, but column 't'"),
        ("t,da\n0,1\n1,2\n", "line 2 holds numbers, above the names in line 4"),
        ("Polarity,inverted\n", "line 1 states 'Polarity,inverted'"),
        ("Vertical Units,V,V\n", "line 1 states 'Vertical Units,V,V'"),
    ],
)
def test_a_line_above_the_names_that_changes_the_numbers_is_not_ignored(bare, words, tmp_path):
    refused(write(tmp_path, bare + table()), words)


def test_a_stated_rate_is_the_time_of_a_table_without_one(tmp_path):
    frame = pd.DataFrame({"Va [V]": VA, "de [nm]": DE_NM})
    both_doors(write(tmp_path, "Sampling rate [kHz];4\n" + frame.to_csv(sep=";", index=False)))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (table().partition("\n")[2], "line 1 does not name the columns: names are expected above the numbers"),
        ("Run 7\nAnn\n", "line 1 does not name|line 2: column 'Run 7'"),
        ("t,Va,de\n", "holds a header and no rows"),
        (" \n\n", "is blank"),
        ("t,Va,Va\n" + table().partition("\n")[2], "line 1: two columns have the name 'Va'"),
    ],
)
def test_no_header(text, words, tmp_path):
    path = write(tmp_path, text)
    with pytest.raises(RecordError, match=words) as error:
        read(path)
    assert not any(each in str(error.value) for each in (*LIBRARY, WRONG_WAY))


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{mark}
Multi_Headings\tNo
X_Columns\t{columns}
Time_Pref\tRelative
Operator\tAnn
Date\t2026/11/20
Time\t10:00:00{mark}1970510124996275989
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t{samples}\t{samples}\t
Date\t2026/11/20\t2026/11/20\t
Time\t10:00:00{mark}5\t{other}\t
Y_Unit_Label\tVolts\tnm\t
X_Dimension\tTime\tTime\t
X0\t0{mark}0000000000000000E+0\t{start}\t
Delta_X\t{step}\t{step}\t
***End_of_Header***\t\t\t
X_Value\tVa\tde (Trigger)\tComment
"""


def lvm(mark: str = ".", columns: str = "No", step: str = "2.500000E-4", comment: str = "", **other: object) -> str:
    with_marks = {"start": f"0{mark}0", "other": f"10:00:00{mark}5", "samples": N}
    head = LVM.format(mark=mark, columns=columns, step=step.replace(".", mark), **with_marks | other)
    rows = [
        f"{f'{t:.6f}' if columns == 'One' else ''}\t{v:.6f}\t{d:.3f}{comment}"
        for t, v, d in zip(T, VA, DE_NM, strict=True)
    ]
    return (
        (head + "\n".join(rows) + "\n").replace("\t\n", "\t\n")
        if mark == "."
        else head + "\n".join(rows).replace(".", mark) + "\n"
    )


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("columns", ["No", "One"])
@pytest.mark.parametrize("comment", ["", "\thit"])
def test_labview_measurements(mark, columns, comment, tmp_path):
    """Increment, start, units and decimal mark as the header states them."""
    path = write(tmp_path, lvm(mark, columns, comment=comment).replace("\n", "\r\n"), "r.lvm")
    record = records.read(path, Series("r", "r", {"Va": "V", "de": "m"}))
    np.testing.assert_allclose(record.t, T, rtol=0, atol=5.1e-7 if columns == "One" else 1e-12)  # six decimals
    np.testing.assert_allclose(record["de"], DE_NM * 1e-9, rtol=1e-12)
    np.testing.assert_allclose(record["Va"], VA, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"start": "0.005"}, "several X0: 0.0000000000000000E+0, 0.005"),
        ({"other": "10:00:00.505"}, "several Time"),
        ({"samples": N + 1}, f"states {N + 1} samples and has {N} rows"),
        ({"columns": "Multi"}, "states X_Columns multi"),
        ({"columns": "One", "step": "2.600000E-3"}, "Delta_X = 0.0026, but X_Value begins 0, 0.00025"),
        ({"step": "0"}, "states Delta_X 0"),
    ],
)
def test_labview_statements_that_cannot_be_used(changed, words, tmp_path):
    refused(write(tmp_path, lvm(**changed), "r.lvm"), words)


def test_a_labview_statement_that_is_not_known_is_named(tmp_path):
    text = lvm().replace("Operator\tAnn", "Gain_Table\t20")
    refused(write(tmp_path, text, "r.lvm"), "line 9 states 'Gain_Table\t20', which is not used here")
    refused(write(tmp_path, lvm() + lvm(), "s.lvm"), "has 4 lines ***End_of_Header***", "one segment a file")


def test_empty_columns_and_rows_of_a_spreadsheet(tmp_path):
    for more in (",,", ","):
        path = write(tmp_path, table().replace("\n", f"{more}\n") + f",,{more}\n,,{more}\n")
        both_doors(path)
        said = "".join(read(path).remarks)
        assert "columns without name and values are left out" in said
        assert "rows without values at its end are left out (2)" in said
    spaced = "\n".join(",".join([*line.split(",")[:1], "", *line.split(",")[1:]]) for line in table().splitlines())
    same(read(write(tmp_path, spaced + "\n")))


def test_values_under_no_name_are_refused(tmp_path):
    index = pd.DataFrame({"t": T, "Va": VA, "de": DE_NM}).to_csv()  # a column of indices without name
    refused(write(tmp_path, index), "line 2 holds '0' in column 1, which line 1 does not name")
    late = table().replace("\n", ",\n").splitlines()
    late[300] += "7"
    refused(write(tmp_path, "\n".join([*late, ""])), "line 301 holds '7' in column 4, which line 1 does not name")


@pytest.mark.parametrize(
    ("head", "scale"),
    [("de [nm]", 1e-9), ("de (nm)", 1e-9), ("de_nm", 1e-9), ("de [µm]", 1e-6), ("de [inch]", 0.0254),
     ("de [mil]", 25.4e-6), ("de [cm]", 0.01)],
)  # fmt: skip
def test_units_in_the_header(head, scale, tmp_path):
    path = write(tmp_path, table(heads=("t", "Va", head)))
    source = {"de": head} if head == "de_nm" else {}
    np.testing.assert_allclose(read(path, **source)["de"], DE_NM * scale, rtol=1e-12)


@pytest.mark.parametrize(("name", "scale"), [("time_ms", 1e3), ("Time (ms)", 1e3), ("t [us]", 1e6), ("Zeit_s", 1.0)])
def test_units_of_the_time(name, scale, tmp_path):
    heads = (name, "Va", "de [nm]")
    frame = pd.DataFrame(dict(zip(heads, (np.round(T * scale, 6), VA, DE_NM), strict=True)))
    both_doors(write(tmp_path, frame.to_csv(index=False)))


def test_a_row_of_units_below_the_names(tmp_path):
    head, _, body = table(heads=("t", "Va", "de")).partition("\n")
    both_doors(write(tmp_path, f"{head}\n[s],[V],[nm]\n{body}"))
    both_doors(write(tmp_path, f"t,Va,de (Geber)\ns,V,nm\n{body}"))
    refused(write(tmp_path, f"t,Va,de [um]\ns,V,nm\n{body}"), "column 'de [um]' states two units, um and nm")


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("de [furlong]", "furlong does not fit here; use m"),
        ("de [V]", "V does not fit"),
        ("time_ms [s]", "two units, s and ms"),
    ],
)
def test_units_that_cannot_be_used_are_named(head, words, tmp_path):
    heads = (head, "Va", "de") if head.startswith("time") else ("t", "Va", head)
    refused(write(tmp_path, table(heads=heads)), words)


@pytest.mark.parametrize(
    ("head", "scale"), [("z_um", 1.0), ("z [um]", 1.0), ("z [nm]", 1e-3), ("z (inch)", 25400.0), ("z_um [µm]", 1.0)]
)
def test_heights_in_the_unit_that_their_column_states(head, scale, tmp_path):
    text = f"x_mm,y_mm,{head}\n-29.5,9,9000\n16,-9,-2500\n"
    found = records.read_table(write(tmp_path, text), HEIGHTS)
    np.testing.assert_allclose(found["z_um"], [9000 * scale, -2500 * scale], rtol=1e-12)
    assert ("converted to um" in "".join(found.remarks)) == (scale != 1.0)


@pytest.mark.parametrize("unit", ["nm", "mm", "inch"])
def test_a_column_whose_name_and_unit_differ_is_refused(unit, tmp_path):
    """`z_um [nm]` would be judged a thousand times too small if the name were right."""
    text = f"x_mm,y_mm,z_um [{unit}]\n-29.5,9,9000\n16,-9,-2500\n"
    with pytest.raises(RecordError) as error:
        records.read_table(write(tmp_path, text), HEIGHTS)
    words = f"line 1: column 'z_um [{unit}]' states two units, {unit} and um"
    assert words in str(error.value)
    assert f"Write 'z [{unit}]' or 'z [um]'" in str(error.value)


@pytest.mark.parametrize("how", ["utf-16", "semicolons", "trailing", "cp1252"])
def test_heights_as_spreadsheets_write_them(how, tmp_path):
    text = "x_mm,y_mm,z_um\n-29.5,9,0\n16,-9,-2.5\n"
    raw = {
        "utf-16": text.replace(",", "\t").encode("utf-16"),
        "semicolons": text.replace(",", ";").replace(".", ",").encode(),
        "trailing": text.replace("\n", ",,\r\n").encode(),
        "cp1252": text.replace("z_um", "z [µm]").encode("cp1252"),
    }[how]
    found = records.read_table(write(tmp_path, raw), HEIGHTS)
    assert found["x_mm"].tolist() == [-29.5, 16.0]
    assert found["z_um"].tolist() == [0.0, -2.5]


@pytest.mark.parametrize(
    "form",
    [
        lambda t: f"2026-11-26 10:00:{t:09.6f}",
        lambda t: f"2026/11/26T10:00:{t:09.6f}Z",
        lambda t: f"10:00:{t:09.6f}".replace(".", ","),
        lambda t: f"2026-11-26 23:59:{59 + t:09.6f}" if t < 1 else "",
        lambda t: str(pd.Timestamp("2026-10-25 01:59:55") + pd.Timedelta(t, "s")),
    ],
)
def test_times_of_day(form, tmp_path):
    rows = [f"{form(t)};{v};{d}" for t, v, d in zip(T.tolist(), VA.tolist(), DE_NM.tolist(), strict=True)]
    path = write(tmp_path, "\n".join(["timestamp;Va [V];de [nm]", *rows, ""]))
    both_doors(path)
    assert "seconds after its first row" in "".join(read(path).remarks)


def test_dates_in_another_form_are_called_dates(tmp_path):
    rows = [f"26.11.2026 10:00:{t:09.6f},{v},{d}" for t, v, d in zip(T, VA, DE_NM, strict=True)]
    path = write(tmp_path, "\n".join(["t,Va,de [nm]", *rows, ""]))
    with pytest.raises(RecordError, match=r"dates \('26.11.2026 10:00:00"):
        read(path)
    np.testing.assert_allclose(read_any(path, "Va", {"de": "de"}, 1 / FS)["Va"], VA, rtol=0, atol=1e-12)


def test_a_comment_among_the_rows_begins_no_table(tmp_path):
    lines = table(heads=("t", "Va", "de [nm]")).splitlines()
    lines[9:9] = ["# trigger"]
    path = write(tmp_path, "\n".join([*lines, ""]))
    with pytest.raises(RecordError, match="line 10"):
        read(path)


def test_two_columns_of_times(tmp_path):
    frame = pd.DataFrame({"t": T, "Zeit [ms]": 1e3 * T + 7.0, "Va": VA, "de [nm]": DE_NM})
    same(read(write(tmp_path, frame.to_csv(index=False))))  # one clock, counted from another zero
    frame["Zeit [ms]"] *= 1.01
    with pytest.raises(RecordError, match=r"'t' and 'Zeit \[ms\]' are two times that differ"):
        read(write(tmp_path, frame.to_csv(index=False)))


def test_columns_of_text_are_left_out_and_said(tmp_path):
    frame = pd.DataFrame({"t": T, "Va": VA, "de [nm]": DE_NM, "note": ["ok"] * N, "remark": [""] * N})
    path = write(tmp_path, frame.to_csv(index=False))
    same(read(path))
    said = "".join(read(path).remarks)
    assert "column 'note' holds text ('ok') and is left out" in said
    assert "column 'remark' holds no values and is left out" in said
    frame.loc[N - 1, "remark"] = "7"
    with pytest.raises(RecordError, match=f"line {N + 1}: column 'remark' holds '7' and is empty above"):
        read(write(tmp_path, frame.to_csv(index=False)))


def test_the_line_of_a_wrong_field_counts_every_line_of_the_file(tmp_path):
    lines = ("# by Ann\n\n" + table()).splitlines()
    lines[200:200] = [""]
    name, value, _ = lines[300].split(",")
    lines[300] = f"{name},{value},OVER"
    refused(write(tmp_path, "\n".join([*lines, ""])), "line 301: column 'de [nm]' holds 'OVER', expected a number")
    lines[300] = f"{name},{value}"
    refused(write(tmp_path, "\n".join([*lines, ""])), "line 301: row 297 has 2 fields, the header has 3")


def test_a_last_line_without_an_end(tmp_path):
    """A number cut short is still a number. Where all have the same decimals, it shows that none is missing."""
    fixed = "".join(f"{t:.6f},{v:.6f},{d:.3f}\n" for t, v, d in zip(T, VA, DE_NM, strict=True))
    whole = "t,Va,de [nm]\n" + fixed
    same(read(write(tmp_path, whole[:-1])))
    for cut in (whole[:-2], whole[:-3], table()[:-1]):
        path = write(tmp_path, cut)
        with pytest.raises(
            RecordError, match=rf"last line \({N + 1}\) has no end, .*if the file is whole, add a newline"
        ) as error:
            read(path)
        assert WRONG_WAY not in str(error.value)
        with pytest.raises(RecordError, match="last line"):
            read_any(path, "Va", {}, None)


STUDY = [(p, o, 9.0 + 0.1 * p + 0.01 * k) for p in range(3) for o in "AB" for k in range(2)]


@pytest.mark.parametrize(
    ("sep", "decimal", "encoding"),
    [(",", ".", "utf-8"), (";", ",", "cp1252"), ("\t", ",", "utf-16"), (";", ".", "utf-8-sig")],
)
def test_gauge_tables(sep, decimal, encoding, tmp_path):
    frame = pd.DataFrame(STUDY, columns=["Part", "operator", "value [µm]"])
    text = frame.to_csv(sep=sep, decimal=decimal, index=False, lineterminator="\r\n")
    found = gauge.read_table(write(tmp_path, text, encoding=encoding))
    assert found["value"].tolist() == [v for *_, v in STUDY]
    assert found["part"].tolist() == [str(p) for p, *_ in STUDY]
    assert found["operator"].tolist() == [o for _, o, _ in STUDY]


@pytest.mark.parametrize(
    ("text", "columns", "words"),
    [
        ("nr,value\n0,9,838\n1,9,839\n", ("value",), "row 1 has 3 fields, the header has 2; decimal commas need ';'"),
        ("part,operator,value\n1,A,9,262\n1,B,9,247\n", gauge.COLUMNS, "row 1 has 4 fields, the header has 3; decimal"),
        ("part,operator,value,value\n1,A,9.2,7\n", gauge.COLUMNS, "two columns have the name 'value'"),
        ("nr;value\n1;9.852\n2;0,25\n", ("value",), "which mark is the decimal one?"),
        ("nr;value\n1;1.234,5\n2;1.234,6\n", ("value",), "write the numbers without thousands marks"),
        ("value\n9,850\n9,851\n", ("value",), "decimal commas need ';'"),
        ("reference [mm],value [um]\n1,1\n2,2\n", ("reference", "value"), "expected one unit for both"),
        ("nr,value\n1,9.8\n2,\n3,9.7\n", ("value",), "line 3: column 'value' holds ''"),
        ("nr,value\n1,9.8\n2,nan\n3,9.7\n", ("value",), "column 'value' holds nan"),
    ],
)  # fmt: skip
def test_gauge_tables_that_are_refused(text, columns, words, tmp_path):
    with pytest.raises(FleetError) as error:
        gauge.read_table(write(tmp_path, text), columns)
    assert words in str(error.value)
    assert not any(each in str(error.value) for each in LIBRARY)


def test_responses_by_the_same_reader(tmp_path):
    f = np.arange(1.0, 60.0)
    frame = pd.DataFrame({"f [kHz]": f / 1e3, "de_re [um/V]": 2.0 / f, "de_im [um/V]": -0.1 / f})
    text = "sep=;\n" + frame.to_csv(sep=";", decimal=",", index=False)
    found = read_response_file(write(tmp_path, text, encoding="utf-16"), "Va")
    np.testing.assert_allclose(found.f, f, rtol=1e-12)
    assert found.units == {"Va": "V", "de": "um"}


def test_a_channel_map_names_columns_by_name_or_whole_header(tmp_path):
    text = table(";", ",", ("Zeit [s]", "Ausgang [V]", "Geber [nm]"))
    path = write(tmp_path, text)
    for names in ({"Va": "Ausgang", "de": "Geber"}, {"Va": "Ausgang [V]", "de": "Geber [nm]"}):
        same(records.read(path, SERIES, channel_map(names | {"t": "Zeit"})))
        same(read_any(path, "Va", names, None))
