"""The gap analysis of a unit: its responses, and what the model does not explain in them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from accept.store import Event
from accept.store.payloads import GapExplained
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.session import panel_cache
from accept.workflow.session.unit import Subject
from accept.workflow.state.unit_state import StepState
from checks.picture import Panel
from specs.spec import Spec

Explanation = tuple[Mapping[str, Any], Mapping[str, Panel]]  # the key `gap` of a result ([DESIGN] 6), all its pictures
Explain = Callable[[Path, Spec], Explanation]


class UnitGap(Subject):
    """Explains the responses of one unit."""

    @property
    def responses(self) -> StepState | None:
        """Return the step whose records the gap workflow explains; None if the spec asks for none."""
        unit = self._unit
        return unit.attempt.step("frf") if "frf" in {step.name for step in unit.steps} else None

    @property
    def found(self) -> Mapping[str, Any] | None:
        """Return the answer of the gap workflow for the present responses, None before it."""
        found, state = self._unit.attempt.gap, self.responses
        return found[1] if found and state and found[0] == state.upto else None

    @property
    def panels(self) -> Mapping[str, Panel]:
        state = self.responses
        return {} if self.found is None or state is None else panel_cache.load(self._unit.folder, "gap", state.upto)

    def explain(self, explain: Explain) -> Event:
        """Run the gap workflow on the present responses and store its answer. Raises EntryError without responses,
        StoreError, OSError, and what `explain` does."""
        unit = self._unit
        attempt, state = unit.written(), self.responses
        if state is None or not state.entries:
            raise EntryError("load the frequency responses first")
        document, drawn = explain(unit.folder, unit.spec)
        panel_cache.save(unit.folder, "gap", attempt.step("frf").upto, drawn)
        return unit.append(GapExplained(attempt.step("frf").upto, document))
