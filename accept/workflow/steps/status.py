"""The status of a step: a mark, a word and a role for its colour."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from enum import Enum

from accept.base.version import code_sha256
from accept.pictures import signs
from accept.store.payloads import StepJudged
from accept.workflow.state.unit_state import Attempt, StepState
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.section import full, ready
from checks.verdict import Finding


def _shown(verdict: str) -> tuple[str, str, str]:
    sign = signs.FINDINGS[verdict]
    return sign.mark, sign.word, sign.tone.style


class Status(Enum):
    """(mark, word, style of a terminal). The mark is clear without colour."""

    NOT_DONE = "·", "not done", "dim"
    TAKEN = "○", "taken", "cyan"
    PASS = _shown("pass")
    CONDITIONAL = _shown("conditional")
    FAIL = _shown("fail")
    NO_RESULT = _shown("no_result")
    REFUSED = "?", "record refused", signs.FINDINGS["no_result"].tone.style
    HELD = "!", "held", "bold red"  # it passes, and a nonconformance holds the unit

    def __init__(self, mark: str, word: str, style: str) -> None:
        self.mark, self.word, self.style = mark, word, style


UNFINISHED = (Status.NOT_DONE, Status.TAKEN, Status.REFUSED)
_WORST_FIRST = (Status.FAIL, Status.NO_RESULT, Status.CONDITIONAL, Status.PASS)


def of_findings(findings: Iterable[Finding]) -> Status:
    """Return the status of the worst finding; a step without any finding was only taken."""
    found = {Status[f.verdict.name] for f in findings}
    return next((status for status in _WORST_FIRST if status in found), Status.TAKEN)


def judgement_of(state: StepState, spec: str) -> StepJudged | None:
    """Return the judgement that still holds: same entries, same spec, by this program."""
    last = state.judgements.get(state.upto)
    return last if last is not None and (last.spec, last.code) == (spec, code_sha256()) else None


def status_of(step: WorkflowStep, state: StepState, judgement: StepJudged | None) -> Status:
    """Return the status of a step by its entries and the judgement that holds, None without one."""
    if judgement is None or not ready(step, state):
        return Status.REFUSED if state.refused else Status.TAKEN if state.entries else Status.NOT_DONE
    return of_findings(judgement.findings)


def state_of(attempt: Attempt, step: WorkflowStep) -> StepState:
    """Return the state of a step of an attempt; of a derived one, with the entries of the step whose data it reads, and
    the records that were refused there."""
    own, read = attempt.step(step.name), attempt.step(step.check.reads)
    return replace(own, entries=read.entries, refused=read.refused) if step.derived else own


def open_steps(steps: Iterable[WorkflowStep], states: Mapping[str, StepState], spec: str) -> list[WorkflowStep]:
    """Return the steps that are not complete, in order; at the first of them a restarted workflow stands.

    A step is complete if all its inputs were given, or if it was judged without an optional input and every quantity
    has a result; a step without data of its own, if it was judged.
    """

    def complete(step: WorkflowStep) -> bool:
        state = states.get(step.name, StepState())
        if not ready(step, state):
            return False
        judgement = judgement_of(state, spec)
        if step.derived:
            return judgement is not None
        return full(step, state) or (judgement is not None and of_findings(judgement.findings) is not Status.NO_RESULT)

    return [step for step in steps if not complete(step)]
