"""An open unit with its five subjects."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from accept.store import Store
from accept.workflow.session.entries import Entries
from accept.workflow.session.gap import UnitGap
from accept.workflow.session.judgements import Held, Judgements, Weigh
from accept.workflow.session.records import Records
from accept.workflow.session.undo import Undo
from accept.workflow.session.unit import OpenUnit
from specs.bench import BenchFile
from specs.spec import Spec


class Session(OpenUnit):
    """One technician at one unit. `accept.workflow.session.open_session` opens it."""

    def __init__(
        self,
        store: Store,
        home: Path,
        spec: Spec,
        operator: str,
        serial: str,
        refuse: Callable[[Iterable[str]], None],
        stated: BenchFile | None = None,
        training: bool = False,
        simulated: bool = False,
        *,
        held: Held,
        weigh: Weigh,
        before: Sequence[Mapping[str, float]],
    ) -> None:
        """Open a unit as `OpenUnit`, `Judgements` have it. Raises as `OpenUnit`."""
        super().__init__(store, home, spec, operator, serial, refuse, stated, training, simulated)
        self.entries, self.records, self.undo = Entries(self), Records(self), Undo(self)
        self.gap = UnitGap(self)
        self.judgements = Judgements(self, self.gap, held, weigh, before)
