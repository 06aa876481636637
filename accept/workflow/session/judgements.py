"""Judgements of a unit: those of its steps and of the whole, as long as they hold, and what is still open."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from statistics import median
from typing import Any

from accept.base.documents.results import Information, UnitRecord
from accept.base.version import code_sha256
from accept.judging.advice import action
from accept.store.payloads import ReadingFailed, RecordLinked, RecordRefused, StepJudged, ValueTaken
from accept.workflow.session import panel_cache
from accept.workflow.session.gap import UnitGap
from accept.workflow.session.unit import OpenUnit
from accept.workflow.state.unit_state import Given
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.section import note_lines, ready
from accept.workflow.steps.status import Status, judgement_of, open_steps, status_of
from checks.cause import Cause
from checks.picture import Panel
from checks.verdict import Finding, Verdict

_ENTRIES = (ValueTaken.KIND, RecordLinked.KIND, RecordRefused.KIND, StepJudged.KIND, ReadingFailed.KIND)  # hold no unit
FEWEST = 5  # values of a quantity; of fewer none is usual
Held = Callable[[Mapping[str, Sequence[str]]], Sequence[str]]
Weigh = Callable[[Sequence[Finding], Sequence[Information], Mapping[str, Any] | None], Sequence[Finding]]


class Judgements:
    """Knows what was found at one unit. before: what each of the last units of its kind measured, by quantity, the
    newest first; earlier: the same as values by quantity; usual: the median of these."""

    def __init__(
        self, unit: OpenUnit, gap: UnitGap, held: Held, weigh: Weigh, before: Sequence[Mapping[str, float]]
    ) -> None:
        """held: returns the nonconformances that hold the unit, from the notes on its steps; weigh: findings of several
        steps beside each other, with what else they measured and what the gap analysis found."""
        self._unit, self._gap, self._holding, self._weigh, self.before = unit, gap, held, weigh, before
        self.earlier = earlier_values(before)
        self.usual: Mapping[str, float] = {quantity: median(values) for quantity, values in self.earlier.items()}
        self._panels: dict[tuple[str, int], Mapping[str, Panel]] = {}
        self._result: tuple[Given, UnitRecord] | None = None
        self._held: tuple[int, Sequence[str]] | None = None
        self._compared: tuple[int, Sequence[Finding]] | None = None
        self._open: tuple[int, Sequence[WorkflowStep]] | None = None

    def status(self, step: WorkflowStep) -> Status:
        status = status_of(step, self._unit.state(step.name), self.of_step(step.name))
        return Status.HELD if status is Status.PASS and self.nonconformances else status

    @property
    def nonconformances(self) -> Sequence[str]:
        """Return the nonconformances that hold the unit, noted in this attempt or an earlier one. Raises StoreError."""
        upto = max((e.seq for e in self._unit.events if e.what not in _ENTRIES), default=0)
        if self._held is None or self._held[0] != upto:
            notes = {step.name: note_lines(self._unit.state(step.name)) for step in self._unit.steps}
            self._held = upto, self._holding(notes)
        return self._held[1]

    def next_step(self, after: str | None = None) -> WorkflowStep | None:
        """Return the first step that is not complete, at which a restarted workflow stands; of those behind `after`,
        then of those before it that were not judged: one without a result stays behind, and the way leads on."""
        steps, waiting = self._unit.steps, self.waiting
        at = next((i + 1 for i, step in enumerate(steps) if step.name == after), 0)
        behind = {step.name for step in steps[at:]}
        ahead = [step for step in waiting if step.name in behind]
        left = [s for s in waiting if s.name not in {after, *behind} and self.of_step(s.name) is None]
        return next(iter(ahead + left), None)

    def of_step(self, step: str) -> StepJudged | None:
        """Return the stored judgement of a step if it still holds, as the judgement of the whole unit leaves it: what
        another step contradicts has no result, nor has what a reservation of the last summary took it from."""
        own = self._own(step)
        if own is None:
            return own
        refuted = {f.quantity: f for f in self._last_findings if f.check == step and _is_reserved(f)}
        refuted = {f.quantity: f for f in self._consistent() if f.check == step} | refuted
        return replace(own, findings=tuple(refuted.get(f.quantity, f) for f in own.findings))

    def _own(self, step: str) -> StepJudged | None:
        """Return the stored judgement of a step by itself, if it still holds."""
        return judgement_of(self._unit.state(step), self._unit.spec_name)

    def _consistent(self) -> Sequence[Finding]:
        """Return the findings of all steps that are judged; without a result where steps contradict each other, or
        where they show an error of the bench."""
        if self._compared is None or self._compared[0] != self._unit.run.seq:
            own = [j for step in self._unit.steps if (j := self._own(step.name)) is not None]
            findings = [finding for each in own for finding in each.findings]
            information = [stated for each in own for stated in each.information]
            self._compared = self._unit.run.seq, self._weigh(findings, information, self._gap.found)
        return self._compared[1]

    def action_at_source(self, step: WorkflowStep) -> str | None:
        """Return what to put right first at the records that a derived step reads; None if nothing is known there."""
        read = self.of_step(step.check.reads) if step.derived else None
        return None if read is None else action(read.findings)

    @property
    def _last_findings(self) -> Sequence[Finding]:
        """Return the findings of the last judgement of the unit, made by this or an earlier run of the program; none if
        its inputs, spec or program have changed since."""
        if self.result is not None:
            return self.result.findings
        judged = self._unit.attempt.judged
        same = judged is not None and (judged.spec_sha256, judged.code_sha256) == (
            self._unit.spec.sha256,
            code_sha256(),
        )
        return judged.result.findings if judged is not None and same else ()

    def panels(self, step: str) -> Mapping[str, Panel]:
        """Return the pictures of the last judgement of a step by this program, none before it; of a slow step also
        those kept by an earlier run."""
        key = (step, self._unit.state(step).upto)
        if key not in self._panels and self._unit.step(step).check.model is not None:
            self._panels[key] = panel_cache.load(self._unit.folder, *key)
        return self._panels.get(key, {})

    @property
    def waiting(self) -> Sequence[WorkflowStep]:
        """Return the steps that are not complete; asked for at every key, so found once for the last event."""
        if self._open is None or self._open[0] != self._unit.run.seq:
            states = {step.name: self._unit.state(step.name) for step in self._unit.steps}
            self._open = self._unit.run.seq, open_steps(self._unit.steps, states, self._unit.spec_name)
        return self._open[1]

    @property
    def unjudged(self) -> list[WorkflowStep]:
        """Return the steps that could be judged and were not since their last entry, by this spec and this program."""
        return [s for s in self._unit.steps if ready(s, self._unit.state(s.name)) and self.of_step(s.name) is None]

    @property
    def result(self) -> UnitRecord | None:
        """Return the last judgement of the whole unit, None if its inputs have changed since."""
        attempt = self._unit.attempt
        if self._result is None or attempt.verdict is None or self._result[0] != attempt.given:
            return None
        return self._result[1]

    def keep(self, given: Given, result: UnitRecord) -> None:
        self._result = given, result

    def keep_step(self, judged: StepJudged, step: WorkflowStep, panels: Mapping[str, Panel]) -> None:
        """Store the judgement of a step and keep its pictures. Raises StoreError, OSError."""
        unit, name = self._unit, step.name
        self._panels[name, judged.upto] = panels
        if step.check.model is not None:
            panel_cache.save(unit.folder, name, judged.upto, panels)
        with unit.mutex:  # an entry that came meanwhile may be in the folder: it is judged by itself
            if unit.state(name).upto == judged.upto and self._own(name) != judged:
                unit.append(judged)


def earlier_values(units: Sequence[Mapping[str, float]]) -> dict[str, Sequence[float]]:
    """Return the values of each quantity over units that measured it."""
    values = defaultdict[str, list[float]](list)
    for unit in units:
        for quantity, value in unit.items():
            values[quantity].append(value)
    return {quantity: found for quantity, found in values.items() if len(found) >= FEWEST}


def _is_reserved(finding: Finding) -> bool:
    """Return whether the judgement of the whole unit may have changed a finding; a nonconformance, which holds every
    step, is shown by itself."""
    held = finding.cause is not None and finding.cause.cause is Cause.NONCONFORMANCE
    return finding.verdict is Verdict.NO_RESULT or (finding.verdict is Verdict.CONDITIONAL and not held)
