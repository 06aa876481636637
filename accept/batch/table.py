"""The table of units that batch and demo print, and why a unit was not accepted."""

from collections.abc import Iterator
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from accept.gap.text import one_line
from accept.judging.advice import stored_advice
from accept.judging.nonconformance import stated_words
from accept.judging.result import UnitResult
from accept.pictures import signs
from accept.pictures.labels import label_and_name, label_of
from checks.cause import Reason
from checks.rounding import rounded
from checks.verdict import Verdict

HELD = "held until quality assurance decides"  # of a unit with a nonconformance
MAX_COLUMNS = 7  # more do not fit into 80 columns; the reasons below the table say what matters


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
        word = signs.unit_word(unit["verdict"], unit.get("nonconformances") or (), unit.get("dispositions") or ())
        simulated = ", simulated" if unit.get("simulated") else ""
        table.add_row(unit["serial"], *cells, Text.assemble((word, signs.UNITS[word].bold), simulated))
    return table


def reasons(units: list[dict[str, Any]]) -> list[str]:
    """Return a line per reason why findings are no pass (unit, quantities, verdict, reason), and below it what to
    do."""
    return [line for unit in units for line in _reasons(unit)]


def reasons_of(result: UnitResult) -> list[str]:
    """Return the same of one unit that was just judged."""
    return list(_reasons(result.to_json()))


def _reasons(unit: dict[str, Any]) -> Iterator[str]:
    """Yield what holds the unit and what was decided about it, then the reasons, each once with all quantities that
    have it; of several, a later line has those that are new. What was said as the unit's action, or above, is not said
    again."""
    yield from (f"{unit['serial']}: {HELD}: {words}" for words in unit.get("nonconformances", ()))
    yield from (f"{unit['serial']}: {words}" for words in stated_words(unit))
    alike: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for finding in unit["findings"]:
        if finding["verdict"] != Verdict.PASS:
            alike.setdefault((finding["verdict"], *_sentences(finding)), []).append(finding)
    told: dict[str, str] = {}
    advised = {unit.get("action") or ""}
    for (verdict, *sentences), findings in alike.items():
        new = "; ".join(sentence for sentence in sentences if sentence not in told)
        named = "; ".join(label_and_name(finding["quantity"]) for finding in findings)
        why = new or f"as {told[sentences[0]]}: {sentences[0]}"
        yield f"{unit['serial']}: {named}: {verdict.replace('_', ' ')}, {why}"
        told |= {sentence: label_of(findings[0]["quantity"]) for sentence in sentences if sentence not in told}
        for line in dict.fromkeys(line for finding in findings for line in stored_advice(finding)):
            if not any(line in said for said in advised):
                yield f"{unit['serial']}:   → {line}"
            advised.add(line)


def _sentences(finding: dict[str, Any]) -> list[str]:
    """Return the sentences of a reason, which may hold semicolons themselves; the reason if its causes tell another."""
    reason = finding["reason"] or "no reason is stated"
    try:
        each = [one.sentence() for one in Reason.read(finding.get("cause")).all()]
    except (KeyError, ValueError, TypeError):  # no cause, or one of another version
        return [reason]
    return each if "; ".join(each) == reason else [reason]


def actions(units: list[dict[str, Any]]) -> list[str]:
    """Return a line for each unit at whose bench something needs correction."""
    return [f"{unit['serial']}: what to do: {unit['action']}" for unit in units if "action" in unit]


def simulated(units: list[dict[str, Any]]) -> list[str]:
    """Return a line that names the units which no instrument measured, none if all were measured."""
    serials = [unit["serial"] for unit in units if unit.get("simulated")]
    return [f"{signs.SIMULATED}: {', '.join(serials)}: no verdict about a real unit"] if serials else []


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
