"""Findings of a step, each with its value in place inside its limits."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.text import Text
from textual.widgets import Static

from accept.tui.widgets.limit_bar import limit_bar, limits, numbers, unit
from accept.workflow.advice import advice
from accept.workflow.state.step_judgement import StepJudgement
from accept.workflow.status import of_findings
from checks.declare import Check

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
    for q in judgement.information:
        if q["value"] is not None:
            text.append(f"  {q['quantity']}  {numbers(q)}\n", "dim")
    for note in judgement.notes:
        text.append(f"  note: {note}\n", "dim")
    text.rstrip()
    return text


def finding_text(finding: Mapping[str, Any]) -> Text:
    """Two lines, and a third with the reason where there is one."""
    status = of_findings([finding])
    colour = status.style
    text = Text.assemble((f"{status.mark} {finding['quantity']}", colour), "  ", numbers(finding), "  ")
    text.append(f"{status.word}\n", colour)
    drawn = limit_bar(finding["value"], finding["U"], finding["lower"], finding["upper"], _STRIP)
    text.append(f"  {drawn}  ", colour)
    text.append(f"{limits(finding)}{unit(finding)}, {finding['rule']}\n", "dim")
    if finding["reason"]:
        text.append(f"  {finding['reason']}\n", colour)
    return text


def missing_words(labels: Sequence[str]) -> str:
    """What was not given, as one sentence."""
    return f"Missing: {', '.join(labels)}" if labels else ""
