"""Tables of `accept gauge` and `accept rr` as spreadsheets of several countries leave them."""

import io
import json

import numpy as np
import pandas as pd
import pytest

from tests.statements.case import Case, cell

READINGS = np.round(9.85 + 0.01 * np.random.default_rng(4).standard_normal(20), 3)
MEAN = float(READINGS.mean())
BIAS = ["--reference", "9.85", "--tolerance", "1"]


def bias(case: Case, text: str, words: list[str], encoding: str = "utf-8", mean: float | None = MEAN) -> None:
    """Ask for the mean of readings: equal to the digits of the table, or refused. mean: None where none is right."""
    path = case.text("bias.csv", text, encoding)
    case.table(["gauge", "bias"], path, None if mean is None else {"mean": mean}, 1e-9, words, *BIAS)


def column(
    header: str = "value", decimal: str = ".", before: str = "", after: str = "", end: str = "\n", form: str = "{:.3f}"
) -> str:
    rows = [before + form.format(x).replace(".", decimal) + after for x in READINGS]
    return header + end + end.join(rows) + end


@cell("Gauge table", "layout", "one column, points")
def test_plain(case: Case) -> None:
    bias(case, column(), ["value"])
    assert case.outcome == {"used"}


@cell("Gauge table", "scale", "decimal commas, {id}")
@pytest.mark.parametrize(
    ("header", "before", "after"),
    [("nr;value", "1;", ""), ("value", "", ""), ("value", '"', '"'), ("nr\tvalue", "1\t", "")],
    ids=["semicolons", "one column", "quotes", "tabs"],
)
def test_decimal_commas(case: Case, header: str, before: str, after: str) -> None:
    bias(case, column(header, ",", before, after), ["comma", "fields", "decimal"])


@cell("Gauge table", "scale", "decimal commas between commas")
def test_commas_for_both(case: Case) -> None:
    bias(case, column("nr,value", ",", "1,"), ["comma", "fields", "3"], mean=None)


@cell("Gauge table", "scale", "decimal commas, value before operator, all between commas")
def test_commas_for_both_in_front(case: Case) -> None:
    bias(case, column("value,operator", ",", "", ",A"), ["comma", "fields", "3"], mean=None)


@cell("Gauge table", "scale", "decimal commas in some rows, points in others")
def test_both_marks(case: Case) -> None:
    rows = [f"{k};{x:.3f}".replace(".", "," if k % 2 else ".") for k, x in enumerate(READINGS)]
    bias(case, "nr;value\n" + "\n".join(rows) + "\n", ["comma", "decimal", "point"])


@cell("Gauge table", "scale", "thousands marks: {id}")
@pytest.mark.parametrize(
    ("mark", "decimal"),
    [(".", ","), (",", "."), ("'", "."), (" ", ","), ("\u00a0", ",")],
    ids=["9.850,1", "9,850.1", "9'850.1", "9 850,1", "9 850,1 with no-break space"],
)
def test_thousands(case: Case, mark: str, decimal: str) -> None:
    rows = [f"1;{1e3 * x:,.1f}".replace(",", "\0").replace(".", decimal).replace("\0", mark) for x in READINGS]
    text = "nr;value\n" + "\n".join(rows) + "\n"
    bias(case, text, ["thousand", "group", "decimal", "mark"], mean=float(np.mean(1e3 * READINGS)))


@cell("Gauge table", "scale", "thousands marks without decimals beside decimals: {id}")
@pytest.mark.parametrize(("mark", "decimal"), [(".", ","), (",", ".")], ids=["9.850 beside 0,5", "9,850 beside 0.5"])
def test_whole_thousands(case: Case, mark: str, decimal: str) -> None:
    rows = [f"{0.5:.1f};{1e3 * x:,.0f}".replace(",", "\0").replace(".", decimal).replace("\0", mark) for x in READINGS]
    text = "temperature;value\n" + "\n".join(rows) + "\n"
    bias(case, text, ["thousand", "group", "decimal", "mark"], mean=float(np.mean(np.round(1e3 * READINGS))))


@cell("Gauge table", "layout", "{id}")
@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-8-sig", "cp1252"])
def test_encodings(case: Case, encoding: str) -> None:
    text = column(
        "Prüfer,value" if encoding == "cp1252" else "nr,value", before="Jürg," if encoding == "cp1252" else "1,"
    )
    bias(case, text, ["UTF-16", "UTF-8", "1252"], encoding)


@cell("Gauge table", "layout", "{id}")
@pytest.mark.parametrize(
    "how",
    ["sep=;", "a title above", "comments", "trailing separators", "empty rows at the end", "CR LF", "empty first rows"],
)
def test_layouts(case: Case, how: str) -> None:
    text = {
        "sep=;": "sep=;\n" + column("nr;value", before="1;"),
        "a title above": "Study of 2026-11-20,\n" + column("nr,value", before="1,"),
        "comments": "# gauge 7\n" + column(),
        "trailing separators": column("nr,value,,", before="1,", after=",,"),
        "empty rows at the end": column("nr,value", before="1,") + ",\n,\n",
        "CR LF": column(end="\r\n"),
        "empty first rows": "\n\n" + column(),
    }[how]
    bias(case, text, ["line 1", "sep=", "header", "first line", "empty", "trailing", "comment"])


@cell("Gauge table", "label", "value twice")
def test_column_twice(case: Case) -> None:
    bias(case, column("value,value", after=",7"), ["twice", "two columns", "more than once"], mean=None)


@cell("Gauge table", "label", "header {id}")
@pytest.mark.parametrize("header", ["Value", " value ", '"value"', "VALUE"])
def test_names(case: Case, header: str) -> None:
    bias(case, column(header), ["value"])


@cell("Gauge table", "label", "header Wert")
def test_other_name(case: Case) -> None:
    bias(case, column("Wert"), ["Wert"])


@cell("Gauge table", "label", "no header")
def test_no_header(case: Case) -> None:
    bias(case, column().partition("\n")[2], ["value", "header"], mean=None)


@cell("Gauge table", "label", "index of pandas before value")
def test_index_of_pandas(case: Case) -> None:
    out = io.StringIO()
    pd.DataFrame({"value": READINGS}).to_csv(out)
    bias(case, out.getvalue(), ["name", "empty", "column 1"])


@cell("Gauge table", "unit", "value [{id}]")
@pytest.mark.parametrize("unit", ["mm", "um"])
def test_unit(case: Case, unit: str) -> None:
    # --reference has no unit: it is that of the column, whichever that is
    bias(case, column(f"value [{unit}]"), ["unit", unit])


@cell("Gauge table", "quality", "{id} among the values")
@pytest.mark.parametrize(
    "word",
    ["NaN", "", "OL", "#N/A", "inf", "999999"],
    ids=["NaN", "an empty field", "OL", "#N/A", "inf", "999999"],
)
def test_no_number(case: Case, word: str) -> None:
    rows = column("nr,value", before="1,").splitlines()
    rows[5] = f"1,{word}"
    readings = READINGS.copy()
    readings[4] = 999999.0
    words = ["number", "NaN", "row", "line", "empty", "finite"]
    bias(case, "\n".join(rows) + "\n", words, mean=float(readings.mean()) if word == "999999" else None)


REFERENCES = np.repeat([2.0, 4.0, 6.0, 8.0, 10.0], 6)
OFF = 0.02 + 0.01 * (REFERENCES - 6.0)
LINEAR = np.round(REFERENCES + OFF + 1e-3 * np.random.default_rng(5).standard_normal(REFERENCES.size), 4)


def linear(case: Case, text: str, words: list[str], right: bool = True) -> None:
    """Ask for the line of the bias over the references: its slope is that of a fit by numpy, or it is refused."""
    path = case.text("linearity.csv", text)
    out = case.path("line.json")
    code, said = case.run("gauge", "linearity", path, "--json", out, codes=(0, 3, 4, 6))
    if code == 6:
        case.refused(said, words)
        return
    assert right, f"taken, though no number can be right: {said}"
    slope = np.polyfit(REFERENCES, LINEAR - REFERENCES, 1)[0]
    assert any(value == pytest.approx(slope, rel=1e-6) for value in numbers(out.read_text())), out.read_text()
    case.used()


def numbers(text: str) -> list[float]:
    """Return every number of a JSON, whatever its key."""
    found: list[float] = []

    def walk(value: object) -> None:
        if isinstance(value, dict):
            for each in value.values():
                walk(each)
        elif isinstance(value, list):
            for each in value:
                walk(each)
        elif isinstance(value, int | float):
            found.append(float(value))

    walk(json.loads(text))
    return found


def pairs(header: str = "reference,value", separator: str = ",", decimal: str = ".", factor: float = 1.0) -> str:
    rows = [
        f"{r:.1f}{separator}{factor * v:.4f}".replace(".", decimal) for r, v in zip(REFERENCES, LINEAR, strict=True)
    ]
    return header + "\n" + "\n".join(rows) + "\n"


@cell("Gauge table", "layout", "linearity: two columns")
def test_linearity(case: Case) -> None:
    linear(case, pairs(), ["reference"])
    assert case.outcome == {"used"}


@cell("Gauge table", "scale", "linearity: decimal commas, semicolons")
def test_linearity_with_semicolons(case: Case) -> None:
    linear(case, pairs("reference;value", ";", ","), ["comma", "decimal", "column"])


@cell("Gauge table", "scale", "linearity: decimal commas between commas")
def test_linearity_with_commas(case: Case) -> None:
    linear(case, pairs(decimal=","), ["comma", "fields", "4"], right=False)


@cell("Gauge table", "unit", "linearity: reference [mm], value [um]")
def test_linearity_of_two_units(case: Case) -> None:
    linear(case, pairs("reference [mm],value [um]", factor=1e3), ["unit", "um", "mm"])


@cell("Gauge table", "label", "linearity: columns exchanged")
def test_linearity_exchanged(case: Case) -> None:
    rows = [f"{v:.4f},{r:.1f}" for r, v in zip(REFERENCES, LINEAR, strict=True)]
    linear(case, "value,reference\n" + "\n".join(rows) + "\n", ["reference"])


STUDY = [
    (part, operator, round(9.0 + 0.1 * part + 0.01 * k + (0.005 if operator == "B" else 0.0), 3))
    for part in range(1, 11)
    for operator in "AB"
    for k in range(3)
]


def study(case: Case, text: str, words: list[str], encoding: str = "utf-8", right: bool = True) -> None:
    """Ask for the repeatability of a crossed study: each cell holds x, x + 0.01, x + 0.02, so its deviation is 0.01."""
    path, out = case.text("rr.csv", text, encoding), case.path("rr.json")
    code, said = case.run("rr", path, "--json", out, codes=(0, 3, 4, 6))
    if code == 6:
        case.refused(said, words)
        return
    assert right, f"taken, though no number can be right: {said}"
    # the interaction is not significant and is pooled by some programs: 40 and 58 degrees of freedom
    within = [np.sqrt(40 * 1e-4 / 40), np.sqrt(40 * 1e-4 / (40 + 9))]
    found = numbers(out.read_text())
    assert any(value == pytest.approx(x, rel=1e-6) for value in found for x in within), (within, out.read_text())
    case.used()


def rows_of_study(
    separator: str = ",", decimal: str = ".", header: str = "part,operator,value", quote: str = ""
) -> str:
    rows = [
        separator.join([str(part), operator, quote + f"{value:.3f}".replace(".", decimal) + quote])
        for part, operator, value in STUDY
    ]
    return header.replace(",", separator) + "\n" + "\n".join(rows) + "\n"


@cell("Gauge table", "layout", "study: part, operator, value")
def test_study(case: Case) -> None:
    study(case, rows_of_study(), ["part"])
    assert case.outcome == {"used"}


@cell("Gauge table", "scale", "study: decimal commas, semicolons")
def test_study_with_semicolons(case: Case) -> None:
    study(case, rows_of_study(";", ","), ["comma", "decimal", "column"])


@cell("Gauge table", "scale", "study: decimal commas between commas")
def test_study_with_commas(case: Case) -> None:
    study(case, rows_of_study(decimal=","), ["comma", "fields", "4 "], right=False)


@cell("Gauge table", "scale", "study: decimal commas in quotes")
def test_study_with_quotes(case: Case) -> None:
    study(case, rows_of_study(decimal=",", quote='"'), ["comma", "decimal"])


@cell("Gauge table", "label", "study: value twice")
def test_study_with_a_column_twice(case: Case) -> None:
    text = rows_of_study().replace("\n", ",7\n").replace("value,7", "value,value", 1)
    study(case, text, ["twice", "two columns", "more than once"], right=False)


@cell("Gauge table", "layout", "study: {id}")
@pytest.mark.parametrize("how", ["UTF-16", "cp1252", "trailing separators", "sep=;"])
def test_layouts_of_a_study(case: Case, how: str) -> None:
    text = {
        "cp1252": rows_of_study().replace("A", "Jürg"),
        "trailing separators": rows_of_study().replace("\n", ",,\n"),
        "sep=;": "sep=;\n" + rows_of_study(";"),
    }.get(how, rows_of_study())
    encoding = {"UTF-16": "utf-16", "cp1252": "cp1252"}.get(how, "utf-8")
    study(case, text, ["UTF-16", "UTF-8", "1252", "sep=", "line 1", "header", "first line", "empty"], encoding)


@cell("Gauge table", "label", "study: an operator's name in two forms of Unicode")
def test_one_name_in_two_forms(case: Case) -> None:
    lines = rows_of_study().replace(",A,", ",Jürg,").splitlines()
    lines = [x.replace("Jürg", "Ju\u0308rg") if k % 2 else x for k, x in enumerate(lines)]
    study(case, "\n".join(lines) + "\n", ["Unicode", "spell", "composed", "same name", "alike"])


@cell("Gauge table", "label", "study: names with blanks, `A` and `A `")
def test_names_with_blanks(case: Case) -> None:
    lines = [x.replace(",A,", ",A ,") if k % 2 else x for k, x in enumerate(rows_of_study().splitlines())]
    study(case, "\n".join(lines) + "\n", ["blank", "space", "spell", "same name", "alike"])
