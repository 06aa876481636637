"""The services of the bench for the first screen. All but the properties may block."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from accept.workflow.bench import Workbench
from accept.workflow.dialogue.begin import Begun, BenchKinds, LookUp
from accept.workflow.dialogue.start import Proposed
from accept.workflow.steps.overview import Overview, week_of
from accept.workflow.steps.unit_list import KnownUnit, queues


@dataclass(frozen=True)
class BeginService:
    """Serves units that are begun at a bench. Raises StoreError, and what opening a unit raises."""

    bench: Workbench

    @property
    def kinds(self) -> BenchKinds:
        return BenchKinds(tuple(self.bench.specs), self.bench.problem, self.bench.described)

    @property
    def bench_name(self) -> str:
        return "" if self.bench.stated is None else self.bench.stated.name

    @property
    def answering(self) -> Mapping[str, bool | None]:
        """Return the instruments by name: whether each answers, None if that is not known."""
        return self.bench.instruments.answering

    def proposed(self, operator: str) -> Proposed:
        """Return the proposals of a bench that was just opened. operator: "" for who worked there last."""
        operator, taken = operator or self.bench.last_operator(), self.bench.taken
        serial = self.bench.unfinished(operator) if operator else ""
        texts = {} if taken is None else {"serial": taken.serial, "kind": taken.kind, **taken.header.parts}
        return Proposed(operator, serial or self.bench.proposed, texts)

    def look_up(self, asked: LookUp) -> tuple[KnownUnit | None, str]:
        """Return the entry of a serial, and why the operator cannot sign here, "" if nothing is known."""
        bench, operator = self.bench, asked.operator
        return bench.known_one(asked.serial), bench.services.key_problem(bench.home, operator) if operator else ""

    def overview(self) -> Overview:
        """Return the units, what they wait for and what they come to."""
        units = self.bench.known()
        return Overview(units, queues(units, self.bench.specs), week_of(units, datetime.now().astimezone()))

    def doubt(self, begun: Begun) -> str | None:
        """Return the question about a serial that looks like a known one, or about the unit folder that is continued
        and is called like another one; None without a doubt."""
        bench, taken = self.bench, self.bench.taken
        own = taken if taken is not None and taken.serial == begun.serial else None
        return None if begun.confirmed else bench.services.serial_doubt(bench.store, begun.serial, own)

    def add(self, begun: Begun) -> bool | str:
        """Begin a unit of a tray unless it is in doubt: return the doubt, else whether it is new."""
        if self.bench.known_one(begun.serial) is not None:
            return False
        if (doubt := self.doubt(begun)) is None:
            self.bench.add(begun)
        return doubt or True
