"""The gap analysis of a unit as a job: here or in a worker."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accept.base.console import say
from accept.base.worker_process import too_large
from accept.gap import analyse_unit
from accept.gap.summary import summary
from accept.units.unit_folder import UnitError, UnitFolder
from checks.errors import ModelError, RecordError
from checks.gap import GapRefused


@dataclass(frozen=True, eq=False)
class GapAnswer:
    """gap.json, and lines for a person."""

    document: Mapping[str, Any]
    words: Sequence[str]


@dataclass(frozen=True)
class GapJob:
    """The gap analysis of a unit; its files go into `out`."""

    unit: UnitFolder
    out: Path
    model: str
    without: tuple[str, ...] = ()
    empirical: bool = False
    html: bool = False

    def run(self) -> GapAnswer | str:
        """Return the answer, or the reason if there is no answer."""
        serial = self.unit.serial
        try:
            done = analyse_unit.analyse(self.unit, self.model, self.without, lambda words: say(f"{serial}: {words}"))
        except (GapRefused, ModelError, RecordError, UnitError) as e:
            return str(e)
        except MemoryError:
            return too_large()
        added = analyse_unit.write(done, self.out, self.empirical, self.html)
        return GapAnswer(done.document, summary(serial, done.result, added))
