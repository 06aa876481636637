"""Findings of a step, each with its value in place inside its limits."""

from collections.abc import Sequence
from dataclasses import replace

from rich.text import Text

from accept.judging.advice import advice
from accept.pictures.labels import label_of
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.limit_bar import after_number, limit_bar, limits, numbers
from accept.workflow.state.unit_state import StepJudgement
from accept.workflow.status import of_findings
from checks.declare import Check
from checks.verdict import Finding

_STRIP = 30  # columns of the drawn bar
_FEW = 3  # findings that are drawn with their limits; more stand in a table, so that all of them are seen
_NAME, _VALUE = 25, 18  # least columns of that table; with its limits it fits beside the steps at 80 columns


class Findings(Hanging):
    """Shows one judgement, or words in its place."""

    def show(self, check: Check, judgement: StepJudgement | None, words: str = "") -> None:
        text = findings_text(check, judgement) if judgement else Text(words, "dim")
        self.display = bool(text.plain)
        self.hang(text)


def findings_text(check: Check, judgement: StepJudgement) -> Text:
    """Return what to do stands below the finding that it is about; findings of one cause share reason and advice. What
    is for information comes last, and what is beyond doubt before what is not."""
    text, told = Text(), set[str]()
    name = max([_NAME, *(len(label_of(q.name)) for _, q in judgement.information)])
    one = finding_text if len(judgement.findings) <= _FEW else finding_row
    for finding in judgement.findings:
        text.append_text(one(replace(finding, reason="as above") if finding.reason in told else finding))
        told.add(finding.reason or "")
        for line in advice(check, finding):
            if line not in told:
                text.append(f"  → {line}\n", "bold yellow")
            told.add(line)
    for _, q in judgement.information:
        text.append(f"  {label_of(q.name):<{name}} {numbers(q.value, q.U, q.unit)}\n", "dim")
    for note in judgement.notes:
        text.append(f"  Note: {note}\n", "dim")
    text.rstrip()
    return text


def finding_text(f: Finding) -> Text:
    """Return a finding in two lines, and a third with its reason if it has one."""
    status = of_findings([f])
    colour = status.style
    text = Text.assemble((f"{status.mark} {label_of(f.quantity)}", colour), "  ")
    if f.value is not None:
        text.append(f"{_value(f)}  ", "bold")
    text.append(f"{status.word}\n", colour)
    drawn = limit_bar(f.value, f.U, f.lower, f.upper, _STRIP)
    text.append(f"  {drawn}  ", colour)
    text.append(f"{limits(f.lower, f.upper)}{after_number(f.unit)}\n", "dim")
    if f.reason:
        text.append(f"  {f.reason}\n", colour)
    return text


def finding_row(f: Finding) -> Text:
    """Return a finding in one line, and a second with its reason if it has one."""
    status = of_findings([f])
    text = Text.assemble((f"{status.mark} {label_of(f.quantity):<{_NAME}}", status.style))
    text.append(f"{_value(f):<{_VALUE}} ", "bold").append(f"{limits(f.lower, f.upper)}\n", "dim")
    if f.reason:
        text.append(f"    {f.reason}\n", status.style)
    return text


def _value(f: Finding) -> str:
    return "no value" if f.value is None else numbers(f.value, f.U, f.unit)


def missing_words(labels: Sequence[str]) -> str:
    """Return what was not given, as one sentence."""
    return f"Missing: {', '.join(labels)}" if labels else ""
