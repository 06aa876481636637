"""The table of units that batch and demo print, and why a unit was not accepted."""

from collections.abc import Iterator
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from accept.gap.text import one_line
from accept.judging.result import UnitResult
from accept.pictures import signs
from accept.pictures.labels import label_and_name, label_of
from checks.rounding import rounded
from checks.verdict import Verdict

MAX_COLUMNS = 7  # more do not fit into 80 columns; the reasons below the table say what matters
SHORT = 30  # characters of a reason that is said again: no longer than to say where it stands


def units_table(units: list[dict[str, Any]], extra: dict[str, dict[str, str]] | None = None) -> Table:
    """Return a row per unit with its judged values (if they are few) and its verdict.

    extra : column title -> serial -> text, put before the judged quantities.
    """
    extra = extra or {}
    quantities = list(dict.fromkeys(f["quantity"] for unit in units for f in unit["findings"]))
    shown = quantities if len(quantities) <= MAX_COLUMNS - len(extra) else []
    table = Table(
        "unit", *extra, *(_title(q, units) for q in shown), "verdict", box=box.SIMPLE_HEAD, padding=0, pad_edge=False
    )
    for column in table.columns[1:-1]:
        column.justify = "right"
    for column in table.columns:
        column.no_wrap = True
    for unit in units:
        found = {f["quantity"]: f for f in unit["findings"]}
        cells = [Text(column.get(unit["serial"], "")) for column in extra.values()]
        cells += [_cell(found.get(q)) for q in shown]
        table.add_row(unit["serial"], *cells, Text(unit["verdict"], style=signs.UNITS[unit["verdict"]].bold))
    return table


def reasons(units: list[dict[str, Any]]) -> list[str]:
    """Return a line per finding that is not a pass: unit, quantity, verdict, reason."""
    return [
        line
        for unit in units
        for line in _reasons(unit["serial"], [(f["quantity"], f["verdict"], f["reason"]) for f in unit["findings"]])
    ]


def reasons_of(result: UnitResult) -> list[str]:
    """Return a line per finding that is not a pass, of one unit that was just judged."""
    return list(_reasons(result.serial, [(f.quantity, str(f.verdict), f.reason) for f in result.findings]))


def _reasons(serial: str, findings: list[tuple[str, str, str | None]]) -> Iterator[str]:
    """Yield the reasons; a long one is printed once, and a later finding with the same reason names the first."""
    told: dict[str, str] = {}
    for quantity, verdict, reason in findings:
        if verdict == Verdict.PASS:
            continue
        parts = (reason or "no reason is stated").split("; ")
        new = "; ".join(part for part in parts if part not in told or len(part) <= SHORT)
        why = new or f"same reason as {told[parts[0]]}"
        yield f"{serial}: {label_and_name(quantity)}: {verdict.replace('_', ' ')}, {why}"
        told |= {part: label_of(quantity) for part in parts if part not in told}


def actions(units: list[dict[str, Any]]) -> list[str]:
    """Return a line for each unit at whose bench something needs correction."""
    return [f"{unit['serial']}: what to do: {unit['action']}" for unit in units if "action" in unit]


def explanations(units: list[dict[str, Any]]) -> list[str]:
    """Return a line per unit whose responses were compared with a model."""
    return [f"{unit['serial']}: {one_line(unit['gap'])}" for unit in units if "gap" in unit]


def _title(quantity: str, units: list[dict[str, Any]]) -> str:
    unit = next(f["unit"] for u in units for f in u["findings"] if f["quantity"] == quantity)
    suffix = "_" + unit.replace(" ", "_").replace("/", "_per_")
    return quantity.removesuffix(suffix).replace("_", " ") + f"\n{unit}"


def _cell(finding: dict[str, Any] | None) -> Text:
    if finding is None or finding["value"] is None:
        return Text("-  ")
    bad, mark = finding["verdict"] != "pass", signs.FINDINGS[finding["verdict"]].mark
    return Text(f"{rounded(finding['value'], finding['U'])} {mark if bad else ' '}", style="red" if bad else "")
