"""An open unit with its five subjects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from accept.workflow.session.entries import Entries, Undo
from accept.workflow.session.gap import UnitGap
from accept.workflow.session.judgements import Held, Judgements, Weigh
from accept.workflow.session.records import Records
from accept.workflow.session.unit import OpenUnit


@dataclass(eq=False, repr=False)
class Session(OpenUnit):
    """One technician at one unit. `accept.workflow.session.open_session` opens it. held, weigh, before: as `Judgements`
    has them."""

    held: Held
    weigh: Weigh
    before: Sequence[Mapping[str, float]]

    def __post_init__(self) -> None:
        super().__post_init__()
        self.entries, self.records, self.undo = Entries(self), Records(self), Undo(self)
        self.gap = UnitGap(self)
        self.judgements = Judgements(self, self.gap, self.held, self.weigh, self.before)
