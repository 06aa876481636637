"""The table of units that batch and demo print."""

from typing import Any

from rich.table import Table
from rich.text import Text

STYLES = {"accepted": "bold green", "conditional": "bold yellow", "rejected": "bold red", "incomplete": "bold yellow"}
MARKS = {"pass": "", "conditional": " ~", "fail": " ✗", "no_result": " ?"}


def units_table(units: list[dict[str, Any]], extra: dict[str, dict[str, str]] | None = None) -> Table:
    """A row per unit, a column per judged quantity, the verdict, and why where it is not accepted.

    extra : column title -> serial -> text, put before the judged quantities.
    """
    quantities = list(dict.fromkeys(f["quantity"] for unit in units for f in unit["findings"]))
    extra = extra or {}
    shown = quantities if len(quantities) <= MAX_COLUMNS else []
    table = Table("unit", *extra, *(_title(q, units) for q in shown), "verdict", "why")
    for unit in units:
        found = {f["quantity"]: f for f in unit["findings"]}
        cells = [Text(column.get(unit["serial"], "")) for column in extra.values()]
        cells += [_cell(found.get(q)) for q in shown]
        verdict = unit["verdict"]
        table.add_row(unit["serial"], *cells, Text(verdict, style=STYLES[verdict]), _why(unit))
    return table


MAX_COLUMNS = 6  # wider tables are unreadable at 80 columns; the reasons then say what matters


def _title(quantity: str, units: list[dict[str, Any]]) -> str:
    unit = next(f["unit"] for u in units for f in u["findings"] if f["quantity"] == quantity)
    suffix = "_" + unit.replace(" ", "_").replace("/", "_per_")
    return f"{quantity.removesuffix(suffix)} [{unit}]"


def _cell(finding: dict[str, Any] | None) -> Text:
    if finding is None or finding["value"] is None:
        return Text("-")
    bad = finding["verdict"] != "pass"
    return Text(f"{finding['value']:.4g}{MARKS[finding['verdict']]}", style="red" if bad else "")


def _why(unit: dict[str, Any]) -> str:
    grouped: dict[str, list[str]] = {}
    for f in unit["findings"]:
        if f["verdict"] != "pass":
            grouped.setdefault(f["verdict"].replace("_", " "), []).append(f["quantity"])
    return "; ".join(f"{verdict}: {', '.join(names)}" for verdict, names in grouped.items())
