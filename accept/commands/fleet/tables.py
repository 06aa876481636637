"""A table for people, scripts and spreadsheets: the same rows on the terminal, as CSV and as JSON."""

from collections.abc import Mapping

import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from accept.base.atomic_files import check_places, write_atomic
from accept.base.console import stdout
from accept.commands.fleet.options import Outputs

WHOLE = ("serial", "time")  # columns that are looked for by eye
DANGEROUS = ("=", "+", "-", "@", "\t", "\r")  # a spreadsheet takes a cell that begins so for a formula


def check(outputs: Outputs) -> None:
    """Raises OSError, before the work, for a place that cannot be written."""
    check_places(outputs.json, outputs.csv)


def write(outputs: Outputs, frame: pd.DataFrame) -> None:
    """Write the rows where they are wanted; times as ISO 8601, missing numbers as null or an empty cell."""
    if outputs.json is not None:
        write_atomic(outputs.json, (frame.to_json(orient="records", date_format="iso", indent=1) + "\n").encode())
    if outputs.csv is not None:
        write_atomic(outputs.csv, _harmless(frame).to_csv(index=False).encode())


def _harmless(frame: pd.DataFrame) -> pd.DataFrame:
    texts = frame.select_dtypes(include=["object", "string"]).columns
    return frame.assign(**{name: frame[name].map(_cell) for name in texts})


def _cell(value: object) -> object:
    return "'" + value if isinstance(value, str) and value.startswith(DANGEROUS) else value


def show(frame: pd.DataFrame, title: str, formats: Mapping[str, str] | None = None) -> None:
    """Print rows. formats: column -> format of its numbers, e.g. "{:.4g}"; text is never cut into pieces."""
    table = Table(*map(str, frame.columns), title=title, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    table.title_justify = "left"
    for column in table.columns:
        column.no_wrap = column.header in WHOLE
    given = formats or {}
    for row in frame.itertuples(index=False):
        table.add_row(*(Text(_shown(v, given.get(str(name)))) for name, v in zip(frame.columns, row, strict=True)))
    stdout.print(table)


def _shown(value: object, format: str | None) -> str:
    if value is None or value is pd.NaT or (isinstance(value, float) and value != value):
        return "-"
    if isinstance(value, pd.Timestamp):
        return value.strftime("%Y-%m-%d %H:%M")
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = (format or ("{:.5g}" if isinstance(value, float) else "{}")).format(value)
    return "".join(c if c.isprintable() else "?" for c in text)
