"""Findings of a step, each with its value in place inside its limits."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import median
from types import MappingProxyType

from rich.text import Text

from accept.judging.advice import ADVICE, advice
from accept.pictures.labels import label_of
from accept.pictures.words import pretty
from accept.store.payloads import StepJudged
from accept.tui.widgets.hanging import ROOM, Hanging
from accept.tui.widgets.limit_bar import LimitBar, limits, numbers, usual_words
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.status import Status, of_findings
from checks.cause import Cause
from checks.declare import Check
from checks.verdict import Finding

NO_USUAL: Mapping[str, float] = MappingProxyType({})
_ABOVE = "as above"  # of a reason that another finding gave
_STRIP, _LEAST_STRIP, _LIMITS = 30, 18, 44  # columns of the drawn bar; the last without a value
_FEW = 3  # findings that are drawn with their limits; more stand in a table, so that all of them are seen


class Findings(Hanging):
    """Shows one judgement, or words in its place. whole: with values without limits."""

    whole = False

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id, classes="card")
        self.border_title = "Result"

    def show(
        self,
        check: Check,
        judgement: StepJudged | None,
        words: str = "",
        usual: Mapping[str, float] = NO_USUAL,
        first: str = "",
    ) -> None:
        status = of_findings(judgement.findings) if judgement is not None else None
        self.set_class(status is Status.FAIL, "bad")
        self.set_class(status in (Status.NO_RESULT, Status.CONDITIONAL), "todo")
        self.display = bool(words or judgement is not None)

        def text_of(room: int) -> Text:
            if judgement is None:
                return Text(words, "dim")
            return findings_text(check, judgement, usual, first, whole=self.whole, room=room)

        self.fit(text_of)


def findings_text(
    check: Check,
    judgement: StepJudged,
    usual: Mapping[str, float] = NO_USUAL,
    first: str = "",
    *,
    whole: bool = False,
    room: int = ROOM,
) -> Text:
    """Return the findings; what to do stands below the one that it is about, and those of one cause share reason and
    advice. usual: values of the units before, by quantity; first: what to put right at the records, before a misfit is
    analysed; whole: with the values that have no limits; room: columns."""
    text, told = Text(), set[str]()
    drawn = len(judgement.findings) <= _FEW
    widths = _widths(judgement.findings)
    bounds = max((len(limits(f.lower, f.upper, f.unit)) for f in judgement.findings), default=0)
    for finding in judgement.findings:
        shown = replace(finding, reason=_ABOVE) if finding.reason in told else finding
        mine = usual.get(finding.quantity)
        text.append_text(finding_text(shown, mine, room, bounds) if drawn else finding_row(shown, *widths, room))
        told.add(finding.reason or "")
        for advised in advice(check, finding):
            line = first if first and advised == ADVICE[Cause.MODEL_MISFIT] else advised
            if line not in told:
                text.append(f"  → {pretty(line)}\n", "bold yellow")
            told.add(line)
    name = max((len(label_of(i.quantity)) for i in judgement.information), default=0)
    for i in judgement.information if whole else ():
        text.append(f"  {label_of(i.quantity):<{name}}  {numbers(i.value, i.U, i.unit)}\n", "dim")
    if judgement.information and not whole:
        count = len(judgement.information)
        text.append(f"  ^D: {count} more value{'s' if count > 1 else ''}, without limits\n", "dim")
    text.rstrip()
    return text


def notes_text(judgement: StepJudged) -> Text:
    """Return what a judgement notes beside its findings, a line each."""
    return Text("\n".join(f"· {note_line(note)}" for note in judgement.notes), "dim")


def note_line(note: str) -> str:
    """Return a note with signs for its units and roots. On paper, where words are compared, roots stay words."""
    return pretty(note).replace("sqrt ", "√")


def _widths(findings: Sequence[Finding]) -> tuple[int, int]:
    """Return the columns of names and of values in a table of findings."""
    names = (len(label_of(f.quantity)) for f in findings)
    return max(names, default=0), max((len(_value(f)) for f in findings), default=0)


def finding_text(f: Finding, usual: float | None = None, room: int = ROOM, longest: int = 0) -> Text:
    """Return a finding with its bar, and its reason in a line of its own. usual: its value at other units; room:
    columns; longest: of these the limits of any finding beside it take."""
    status, value = of_findings([f]), "" if f.value is None else _value(f)
    colour, head = status.style, f"{status.mark} {label_of(f.quantity)}"
    text = Text.assemble((head, colour))
    if value:
        fits = len(head) + 2 + len(value) + 2 + len(status.word) <= room
        text.append("  " if fits else "\n  ").append(value, "bold")
    text.append(f"  {status.word}\n", colour)
    bounds = limits(f.lower, f.upper, f.unit)
    beside = room - 4 - max(longest, len(bounds))
    width = min(_STRIP, beside) if beside >= _LEAST_STRIP else min(_STRIP, max(_LEAST_STRIP, room - 2))
    drawn = LimitBar(f.lower, f.upper, width, f.value).drawn(colour, f.U, usual)
    text.append("  ").append_text(drawn).append("  " if beside >= _LEAST_STRIP else "\n  ")
    text.append(f"{bounds}{usual_words(usual)}\n", "dim")
    if f.reason:
        text.append(f"  {pretty(f.reason)}\n", colour)
    return text


def finding_row(f: Finding, name: int, value: int, room: int = ROOM) -> Text:
    """Return a finding in one line, with its limits behind it or whole below it, and a line with its reason if it has
    one. name, value: columns of these; room: of the whole."""
    status = of_findings([f])
    text = Text.assemble((f"{status.mark} {label_of(f.quantity):<{name}}  ", status.style))
    bounds = limits(f.lower, f.upper, f.unit)
    fits = 2 + name + 2 + value + 2 + len(bounds) <= room
    if 2 + name + 2 + value > room:  # value and limits share the next line, or have one each
        text = Text.assemble((f"{status.mark} {label_of(f.quantity)}\n    ", status.style))
        fits = 4 + value + 2 + len(bounds) <= room
    text.append(f"{_value(f):<{value}}", "bold").append(f"{'  ' if fits else chr(10) + '    '}{bounds}\n", "dim")
    if f.reason and not (f.reason == _ABOVE and f.value is None):
        text.append(f"    {pretty(f.reason)}\n", status.style)
    return text


def _value(f: Finding) -> str:
    if f.value is None:
        return _ABOVE if f.reason == _ABOVE else "no value"
    return numbers(f.value, f.U, f.unit)


def limits_text(step: WorkflowStep, earlier: Mapping[str, Sequence[float]], room: int) -> Text:
    """Return the limits of a step, each with the values of the units before, and the forms in which it can be given.
    room: columns."""
    text, width = Text(), min(_LIMITS, room - 2)
    for name, limit in step.asked.limits.items():
        values = earlier.get(name, ())
        usual = median(values) if values else None
        bar = LimitBar(limit.lower, limit.upper, width)
        text.append(f"{label_of(name)}  {limits(limit.lower, limit.upper, limit.unit)}{usual_words(usual)}\n")
        above = [bar.spread_above(values)] if values else []
        for row in (*above, bar.drawn("cyan", usual=usual), bar.numbers_below()):
            row.rstrip()
            row.pad_left(2)
            text.append_text(row).append("\n")
        text.append(f"  {limit.rule}; {pretty(limit.source)}\n\n", "dim")
    if not step.derived:
        text.append("Given as\n", "bold")
    for form in () if step.derived else step.check.forms:
        inputs = ", ".join(declared.label for declared in form.inputs)
        text.append(f"  {form.name}: {pretty(inputs)}\n", "dim")
    text.rstrip()
    return text
