"""An open unit with its five subjects."""

from collections.abc import Mapping
from typing import Any

from accept.workflow.session.entries import Entries
from accept.workflow.session.gap import UnitGap
from accept.workflow.session.judgements import Held, Judgements
from accept.workflow.session.records import Records
from accept.workflow.session.undo import Undo
from accept.workflow.session.unit import OpenUnit


class Session(OpenUnit):
    """One technician at one unit. `accept.workflow.session.open_session` opens it."""

    def __init__(self, *given: Any, held: Held, usual: Mapping[str, float], **named: Any) -> None:
        """Open a unit as `OpenUnit`, `Judgements` have it. Raises as `OpenUnit`."""
        super().__init__(*given, **named)
        self.entries, self.records, self.undo = Entries(self), Records(self), Undo(self)
        self.gap = UnitGap(self)
        self.judgements = Judgements(self, self.gap, held, usual)
