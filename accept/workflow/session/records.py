"""Records of a unit: those that are found in a folder and proposed, those that are linked, those that are refused."""

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from datetime import datetime
from pathlib import Path
from typing import Any

from accept.judging.advice import ADVICE, record_advice
from accept.store import Event, undone
from accept.store.payloads import RecordLinked, RecordRefused, StepRemeasured, payload_of
from accept.units import attach
from accept.workflow.entry import record_folder
from accept.workflow.entry.record_folder import Proposals
from accept.workflow.session.unit import Subject
from accept.workflow.steps.plan import WorkflowStep
from checks.cause import Cause
from checks.declare import CsvTable, Form, Series
from checks.errors import RecordError
from checks.verdict import Finding
from specs.bench import channel_map

_EVENTS_BACK = 5000  # of the store: whether a file belongs to another unit is asked of these


class Records(Subject):
    """Proposes and links records of one unit."""

    def link(
        self,
        step: str,
        declared: Series | CsvTable,
        source: Path,
        day: str | None = None,
        instrument: str | None = None,
        evidence: Mapping[str, Any] | None = None,
    ) -> Event:
        """Copy a record into the unit's folder and store that it is there, or that it was refused and why. instrument,
        evidence: of the readings, if it was measured live. Raises RecordError, OSError, StoreError."""
        unit, channels = self._unit, channel_map(self._unit.attempt.channels)
        form = unit.step(step).form_with(declared.name).name
        try:
            name, digest = attach.take_in(source, declared, unit.folder, channels, unit.spec.kind)
        except RecordError as e:
            if source.is_file():
                written, action = source.stat().st_mtime, self.link_advice(source, e)
                unit.append(
                    RecordRefused(step, form, declared.name, source.name, str(source), written, e.reason, action)
                )
            raise
        return unit.append(
            RecordLinked(step, form, declared.name, name, digest, str(source), day, instrument, evidence)
        )

    def link_advice(self, source: Path, why: RecordError) -> str:
        """Return what to do about a record that could not be linked."""
        if attach.damage(source):
            return ADVICE[Cause.FILE_DAMAGED]
        return next(iter(record_advice(why.reason)), "F2: choose another file")

    def lacks(self, declared: Series | CsvTable, source: Path) -> list[str]:
        """Return which channels of a record of this unit a file lacks, by their names."""
        return attach.lacks(source, declared, channel_map(self._unit.attempt.channels))

    def may_fit(self, declared: Series | CsvTable, source: Path) -> bool:
        """Return whether a file has the channels of a record of this unit, by their names."""
        return not self.lacks(declared, source)

    def refusal(self, finding: Finding) -> RecordRefused | None:
        """Return the record that was refused for a quantity that has no result for want of it, None without one."""
        reasons = () if finding.cause is None else finding.cause.all()
        missing = [reason.record for reason in reasons if reason.cause is Cause.NOT_MEASURED]
        refused = self._unit.state(finding.check).refused if missing else {}
        named = [refused[name] for name in missing if name in refused]
        return next(iter(named or ([] if all(missing) else refused.values())), None)

    def proposals(self, step: WorkflowStep, form: Form, folder: Path) -> Proposals:
        """Return the records in a folder that are proposed for the inputs of a form that have none yet. One that was
        refused is proposed again when it was written anew."""
        state = self._unit.state(step.name)
        files = [i for i in form.inputs if isinstance(i, Series | CsvTable)]
        given = {i.name for i in files if state.link(i.name) is not None}
        if len(given) == len(files):
            return {}
        known = self._sources()

        def taken(path: Path, mtime: float) -> bool:
            return mtime <= known.get(str(path), -math.inf) or mtime == state.unusable.get(str(path))

        others = self._inputs_of_others(step)
        return record_folder.proposals(folder, files, _about(step), self.may_fit, taken, attach.damage, others, given)

    def name_score(self, step: WorkflowStep, declared: Series | CsvTable, file: str) -> tuple[int, str]:
        """Return how far the name of a file speaks for an input of a step, and the step that it speaks for instead."""
        if any(isinstance(e, RecordLinked) and e.file == file for e in self._unit.state(step.name).entries):
            return -1, "in use"
        wanted = [i for i in step.form_with(declared.name).inputs if isinstance(i, Series | CsvTable)]
        return record_folder.name_score(file, declared, wanted, _about(step), self._inputs_of_others(step))

    def _inputs_of_others(self, step: WorkflowStep) -> Mapping[str, Sequence[Series | CsvTable]]:
        """Return words -> inputs of the steps whose records may lie in the same folder."""
        others = [other for other in self._unit.steps if other is not step and not other.derived]
        inputs = {_about(other): [i for form in other.check.forms for i in form.inputs] for other in others}
        return {about: [i for i in given if isinstance(i, Series | CsvTable)] for about, given in inputs.items()}

    def _sources(self) -> dict[str, float]:
        """Return when [s of the epoch] each file was last taken for a unit, among the latest events of the store. What
        was undone or replaced in this attempt is free again."""
        store = self._unit.store
        latest = store.events(what=RecordLinked.KIND, after=max(0, store.head().seq - _EVENTS_BACK))
        gone = undone(self._unit.events)
        gone |= self._replaced(gone)
        return {
            str(event.data["origin"]): datetime.fromisoformat(event.time).timestamp()
            for event in latest
            if event.seq not in gone
        }

    def _replaced(self, undone: AbstractSet[int]) -> set[int]:
        """Return the numbers of the events by which a record was linked in whose place another one was linked since.
        What went before a step was begun anew is not among them: it was measured then."""
        replaced, last = set[int](), dict[tuple[str, str], int]()
        for event in self._unit.events:
            match payload_of(event, RecordLinked, StepRemeasured):
                case RecordLinked() as link if event.seq > self._unit.begun and event.seq not in undone:
                    replaced |= {last[link.step, link.input]} if (link.step, link.input) in last else set()
                    last[link.step, link.input] = event.seq
                case StepRemeasured() as again:
                    last = {key: seq for key, seq in last.items() if key[0] != again.step}
        return replaced


def _about(step: WorkflowStep) -> str:
    """Return the words of a step that the names of its records may hold, its name in a list last."""
    return f"{step.name}\n{step.short}"
