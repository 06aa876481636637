"""The table of units that batch and demo print, and why a unit was not accepted."""

from collections.abc import Iterator, Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from accept.base.documents.results import SIMULATED, UnitRecord
from accept.gap import one_line
from accept.judging.advice import advice
from accept.pictures import signs
from accept.pictures.labels import label_and_name, label_of
from accept.store.decisions import stated_words
from checks.acceptance import CHECKS
from checks.rounding import rounded
from checks.verdict import Finding, Verdict

HELD = "held until quality assurance decides"  # of a unit with a nonconformance
MAX_COLUMNS = 7  # more do not fit into 80 columns; the reasons below the table say what matters


def units_table(units: Sequence[UnitRecord], extra: dict[str, dict[str, str]] | None = None) -> Table:
    """Return a row per unit with its judged values (if they are few) and its verdict.

    extra : column title -> serial -> text, put before the judged quantities.
    """
    extra = extra or {}
    quantities = list(dict.fromkeys(f.quantity for unit in units for f in unit.findings))
    shown = quantities if len(quantities) <= MAX_COLUMNS - len(extra) else []
    table = Table(
        "unit", *extra, *(_title(q, units) for q in shown), "verdict", box=box.SIMPLE_HEAD, padding=0, pad_edge=False
    )
    for column in table.columns[1:-1]:
        column.justify = "right"
    for column in table.columns:
        column.no_wrap = True
    for unit in units:
        found = {f.quantity: f for f in unit.findings}
        cells = [Text(column.get(unit.serial, "")) for column in extra.values()]
        cells += [_cell(found.get(q)) for q in shown]
        simulated = ", simulated" if unit.simulated else ""
        table.add_row(unit.serial, *cells, Text.assemble((unit.word, signs.UNITS[unit.word].bold), simulated))
    return table


def reasons(units: Sequence[UnitRecord]) -> list[str]:
    """Return a line per reason why findings are no pass (unit, quantities, verdict, reason), each with what to do."""
    return [line for unit in units for line in _reasons(unit)]


def _reasons(unit: UnitRecord) -> Iterator[str]:
    """Yield what holds the unit and what was decided about it, then the reasons, each once with all quantities that
    have it; of several, a later line has those that are new. What was said above is not repeated."""
    yield from (f"{unit.serial}: {HELD}: {words}" for words in unit.nonconformances)
    yield from (f"{unit.serial}: {words}" for words in stated_words(unit.dispositions))
    alike: dict[tuple[str, ...], list[Finding]] = {}
    for finding in unit.findings:
        if finding.verdict is not Verdict.PASS:
            alike.setdefault((finding.verdict, *_sentences(finding)), []).append(finding)
    told: dict[str, str] = {}
    advised = {unit.action or ""}
    for (verdict, *sentences), findings in alike.items():
        new = "; ".join(sentence for sentence in sentences if sentence not in told)
        named = "; ".join(label_and_name(finding.quantity) for finding in findings)
        why = new or f"as {told[sentences[0]]}: {sentences[0]}"
        yield f"{unit.serial}: {named}: {verdict.replace('_', ' ')}, {why}"
        told |= {sentence: label_of(findings[0].quantity) for sentence in sentences if sentence not in told}
        own = (finding for finding in findings if CHECKS.is_own(finding.check))
        for line in dict.fromkeys(line for finding in own for line in advice(CHECKS[finding.check], finding)):
            if not any(line in said for said in advised):
                yield f"{unit.serial}:   → {line}"
            advised.add(line)


def _sentences(finding: Finding) -> list[str]:
    """Return the sentences of a reason, which may hold semicolons themselves; the reason if its causes tell another."""
    reason = finding.reason or "no reason is stated"
    each = [] if finding.cause is None else [one.sentence() for one in finding.cause.all()]
    return each if "; ".join(each) == reason else [reason]


def actions(units: Sequence[UnitRecord]) -> list[str]:
    """Return a line for each unit at whose bench something needs correction."""
    return [f"{unit.serial}: what to do: {unit.action}" for unit in units if unit.action is not None]


def simulated(units: Sequence[UnitRecord]) -> list[str]:
    """Return a line that names the units which no instrument measured, none if all were measured."""
    serials = [unit.serial for unit in units if unit.simulated]
    return [f"{SIMULATED}: {', '.join(serials)}: no verdict about a real unit"] if serials else []


def explanations(units: Sequence[UnitRecord]) -> list[str]:
    """Return a line per unit whose responses were compared with a model."""
    return [f"{unit.serial}: {one_line(unit.gap)}" for unit in units if unit.gap is not None]


def _title(quantity: str, units: Sequence[UnitRecord]) -> str:
    unit = next(f.unit for u in units for f in u.findings if f.quantity == quantity)
    suffix = "_" + unit.replace(" ", "_").replace("/", "_per_")
    return quantity.removesuffix(suffix).replace("_", " ") + f"\n{unit}"


def _cell(finding: Finding | None) -> Text:
    if finding is None or finding.value is None:
        return Text("-  ")
    bad, mark = finding.verdict is not Verdict.PASS, signs.FINDINGS[finding.verdict].mark
    return Text(f"{rounded(finding.value, finding.U)} {mark if bad else ' '}", style="red" if bad else "")
