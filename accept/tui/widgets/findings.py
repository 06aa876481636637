"""Findings of a step, each with its value in place inside its limits."""

from collections.abc import Sequence

from rich.text import Text
from textual.widgets import Static

from accept.tui.widgets.limit_bar import after_number, limit_bar, limits, numbers
from accept.workflow.advice import advice
from accept.workflow.state.step_judgement import StepJudgement
from accept.workflow.status import of_findings
from checks.declare import Check
from checks.verdict import Finding

_STRIP = 32


class Findings(Static):
    """Shows one judgement, or words in its place."""

    def show(self, check: Check, judgement: StepJudgement | None, words: str = "") -> None:
        self.update(findings_text(check, judgement) if judgement else Text(words, "dim"))


def findings_text(check: Check, judgement: StepJudgement) -> Text:
    """What to do stands below the finding that it is about; findings of one cause share it."""
    text, told = Text(), set[str]()
    for finding in judgement.findings:
        text.append_text(finding_text(finding))
        for line in advice(check, finding):
            if line not in told:
                text.append(f"  → {line}\n", "bold yellow")
            told.add(line)
    for _, q in judgement.information:
        text.append(f"  {q.name}  {numbers(q.value, q.U, q.unit)}\n", "dim")
    for note in judgement.notes:
        text.append(f"  note: {note}\n", "dim")
    text.rstrip()
    return text


def finding_text(f: Finding) -> Text:
    """Two lines, and a third with the reason where there is one."""
    status = of_findings([f])
    colour = status.style
    text = Text.assemble((f"{status.mark} {f.quantity}", colour), "  ", numbers(f.value, f.U, f.unit), "  ")
    text.append(f"{status.word}\n", colour)
    drawn = limit_bar(f.value, f.U, f.lower, f.upper, _STRIP)
    text.append(f"  {drawn}  ", colour)
    text.append(f"{limits(f.lower, f.upper)}{after_number(f.unit)}, {f.rule}\n", "dim")
    if f.reason:
        text.append(f"  {f.reason}\n", colour)
    return text


def missing_words(labels: Sequence[str]) -> str:
    """What was not given, as one sentence."""
    return f"Missing: {', '.join(labels)}" if labels else ""
