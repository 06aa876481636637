"""Answers to questions about many units: the judgements in question, and their rows as a table, as CSV and as JSON."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

import pandas as pd
from rich.table import Column, Table
from rich.text import Text

from accept.base.console import stdout
from accept.base.names import shown_name
from accept.base.plain_text import listed
from accept.commands.answer import SPACED, File, Remark, csv_of, table
from accept.commands.fleet.options import JudgementFilter, Outputs
from accept.fleet.errors import FleetError
from accept.fleet.findings_file import HELD_BY, NOT_STATED
from accept.fleet.golden import not_counted
from accept.fleet.measurements import GOLDEN, day, is_between
from accept.fleet.yields import VOID
from accept.pictures.labels import label_and_name, label_of

WHOLE = ("serial", "time", "verdict", "unit_verdict")  # columns that are looked for by eye
NARROW = 100  # columns of a terminal below which the day stands alone
TITLES = {  # on the terminal; files keep the names of the columns
    "unit_verdict": "verdict",
    "causes": "not passed",
    "judged_from": "judged from",
    "first": "passed first",
    "last": "passed by now",
    "first_pass": "first-pass yield",
    "lo": "from",
    "hi": "to",
    "sigma_within": "sigma within",
    "sigma_overall": "sigma overall",
    "percent_of_study": "% of study",
    "percent_of_variance": "% of variance",
    "percent_of_tolerance": "% of tolerance",
    "mean_square": "mean square",
    "by_ranges": "by averages and ranges",
}


def is_chosen(frame: pd.DataFrame, choice: JudgementFilter) -> pd.Series:
    """Return which rows are asked about. Raises FleetError if there are none."""
    rows = is_between(frame, day(choice.since), day(choice.until, last=True))
    if choice.kind is not None:
        rows &= frame["kind"] == choice.kind
    if not rows.any():
        raise FleetError("the store holds no such judgement" if len(frame) else "no unit has been judged yet")
    return rows


def chosen(frame: pd.DataFrame, choice: JudgementFilter) -> pd.DataFrame:
    """Return the rows that are asked about. Raises FleetError if there are none."""
    return frame[is_chosen(frame, choice)]


def left_out(frame: pd.DataFrame) -> Iterator[Remark]:
    """Yield remarks about the attempts that do not count: void ones, and those of simulated and of golden units."""
    for words, rows in (("void", frame["voided"] != ""), ("simulated", frame["simulated"])):
        attempts = frame[rows].drop_duplicates("seq")
        named = [f"{row['serial']} attempt {row['attempt']}" for row in attempts.to_dict("records")]
        if named:
            yield Remark(f"{len(named)} {words} and not counted: {listed(named, 10)}")
    if words := golden_left_out(frame[frame[GOLDEN]]):
        yield words


def golden_left_out(frame: pd.DataFrame) -> Remark:
    """Return the remark about judgements of golden units."""
    return Remark(not_counted(frame["seq"].nunique(), frame["serial"]))


def files(outputs: Outputs, frame: pd.DataFrame, document: Any = None) -> tuple[File, File]:
    """Return the rows as JSON and CSV, times as ISO 8601, missing numbers as null or empty. document: the JSON."""

    def records() -> bytes:
        return (frame.to_json(orient="records", date_format="iso", indent=1) + "\n").encode()

    return (
        File(outputs.json, records if document is None else document),
        File(outputs.csv, lambda: csv_of(frame)),
    )


def rows(frame: pd.DataFrame, title: str, formats: Mapping[str, str] = MappingProxyType({})) -> Table:
    """Return a table of rows. formats: column -> format of its numbers, e.g. "{:.4g}"; text is never cut."""
    names = list(map(str, frame.columns))
    shown = (
        [Text(_label_words(n, _cell_text(v, formats.get(n)))) for n, v in zip(names, row, strict=True)]
        for row in frame.itertuples(index=False)
    )
    return table(map(_column, names), shown, title=title, **SPACED)


def _column(name: str) -> Column:
    title = TITLES.get(name, name)
    return Column(title, no_wrap=name in WHOLE, min_width=max(map(len, title.split()), default=1))


def telling(frame: pd.DataFrame, *columns: str) -> pd.DataFrame:
    """Drop the columns, of those named, that are empty in every row."""
    empty = [c for c in columns if frame[c].isna().all() or frame[c].isin([NOT_STATED, ""]).all()]
    return frame.drop(columns=[*empty, *(c for c in columns if frame[c].dtype == bool and not frame[c].any())])


def named(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a frame with its operators as they are shown: a name that was only typed is marked."""
    pairs = zip(frame["operator"], frame["typed"], strict=True)
    return frame.assign(operator=[shown_name(who, typed) for who, typed in pairs])


def _label_words(column: str, text: str) -> str:
    """Return a quantity by its label and its code name, which other commands take; other texts as they are shown."""
    if column == "quantity":
        return text if text in (*HELD_BY, VOID) else label_and_name(text)
    if column == "causes":
        return "; ".join(map(label_of, text.split(", "))) if text else ""
    return text.replace("_", " ") if column in ("verdict", "unit_verdict") else text


def _cell_text(value: object, format: str | None) -> str:
    if value is None or value is pd.NaT or (isinstance(value, float) and value != value):
        return "-"
    if isinstance(value, pd.Timestamp):
        return value.strftime("%Y-%m-%d %H:%M" if stdout.width >= NARROW else "%Y-%m-%d")
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = (format or ("{:.5g}" if isinstance(value, float) else "{}")).format(value)
    return "".join(c if c.isprintable() else "?" for c in text)
