"""Findings of a step, each with its value in place inside its limits."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from rich.text import Text

from accept.judging.advice import ADVICE, advice
from accept.pictures.labels import label_of
from accept.store.payloads import StepJudged
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.limit_bar import after_number, limit_bar, limits, numbers, usual_words
from accept.workflow.steps.status import of_findings
from checks.cause import Cause
from checks.declare import Check
from checks.verdict import Finding

NO_USUAL: Mapping[str, float] = MappingProxyType({})
_ABOVE = "as above"  # of a reason that another finding gave
_STRIP = 30  # columns of the drawn bar
_FEW = 3  # findings that are drawn with their limits; more stand in a table, so that all of them are seen
_ROOM = 59  # columns beside the steps at 80: a limit that has no room there stands whole on the next line


class Findings(Hanging):
    """Shows one judgement, or words in its place. whole: with what is for information."""

    whole = False

    def show(
        self,
        check: Check,
        judgement: StepJudged | None,
        words: str = "",
        usual: Mapping[str, float] = NO_USUAL,
        first: str = "",
    ) -> None:
        text = findings_text(check, judgement, usual, first, whole=self.whole) if judgement else Text(words, "dim")
        self.display = bool(text.plain)
        self.hang(text)


def findings_text(
    check: Check,
    judgement: StepJudged,
    usual: Mapping[str, float] = NO_USUAL,
    first: str = "",
    *,
    whole: bool = False,
) -> Text:
    """Return the findings; what to do stands below the one that it is about, and those of one cause share reason and
    advice. usual: values of the units before, by quantity; first: what to put right at the records, before a misfit is
    analysed; whole: with the values that have no limits."""
    text, told = Text(), set[str]()
    drawn = len(judgement.findings) <= _FEW
    widths = _widths(judgement.findings)
    for finding in judgement.findings:
        shown = replace(finding, reason=_ABOVE) if finding.reason in told else finding
        text.append_text(finding_text(shown, usual.get(finding.quantity)) if drawn else finding_row(shown, *widths))
        told.add(finding.reason or "")
        for advised in advice(check, finding):
            line = first if first and advised == ADVICE[Cause.MODEL_MISFIT] else advised
            if line not in told:
                text.append(f"  → {line}\n", "bold yellow")
            told.add(line)
    name = max((len(label_of(i.quantity)) for i in judgement.information), default=0)
    for i in judgement.information if whole else ():
        text.append(f"  {label_of(i.quantity):<{name}}  {numbers(i.value, i.U, i.unit)}\n", "dim")
    for note in judgement.notes:
        text.append(f"  Note: {note}\n", "dim")
    if judgement.information and not whole:
        count = len(judgement.information)
        text.append(f"  Ctrl+D: {count} more value{'s' if count > 1 else ''}, without limits\n", "dim")
    text.rstrip()
    return text


def _widths(findings: Sequence[Finding]) -> tuple[int, int]:
    """Return the columns of names and of values in a table of findings."""
    names = (len(label_of(f.quantity)) for f in findings)
    return max(names, default=0), max((len(_value(f)) for f in findings), default=0)


def finding_text(f: Finding, usual: float | None = None) -> Text:
    """Return a finding in two lines, and a third with its reason if it has one. usual: its value at other units."""
    status = of_findings([f])
    colour = status.style
    text = Text.assemble((f"{status.mark} {label_of(f.quantity)}", colour), "  ")
    if f.value is not None:
        text.append(f"{_value(f)}  ", "bold")
    text.append(f"{status.word}\n", colour)
    drawn = limit_bar(f.value, f.U, f.lower, f.upper, _STRIP, usual)
    text.append(f"  {drawn}  ", colour)
    text.append(f"{limits(f.lower, f.upper)}{after_number(f.unit)}{usual_words(usual)}\n", "dim")
    if f.reason:
        text.append(f"  {f.reason}\n", colour)
    return text


def finding_row(f: Finding, name: int, value: int) -> Text:
    """Return a finding in one line, with its limits behind it or whole below it, and a line with its reason if it has
    one. name, value: columns of these."""
    status = of_findings([f])
    text = Text.assemble((f"{status.mark} {label_of(f.quantity):<{name}}  ", status.style))
    bounds = f"{limits(f.lower, f.upper)}{after_number(f.unit)}"
    fits = 2 + name + 2 + value + 2 + len(bounds) <= _ROOM
    text.append(f"{_value(f):<{value}}", "bold").append(f"{'  ' if fits else chr(10) + '    '}{bounds}\n", "dim")
    if f.reason and not (f.reason == _ABOVE and f.value is None):
        text.append(f"    {f.reason}\n", status.style)
    return text


def _value(f: Finding) -> str:
    if f.value is None:
        return _ABOVE if f.reason == _ABOVE else "no value"
    return numbers(f.value, f.U, f.unit)
