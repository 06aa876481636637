"""Reservations: facts against a unit that the bench's store knows and its folder does not show, and their effect on the
verdict.

A recording that is filed twice does not count (`copies`), one that was read otherwise before makes no
finding pass that did not (`reread`), nor does one that an earlier attempt holds something against
(`superseded`); a strut with a part that was not accepted (`parts`) is
conditional at best. So is a unit with a nonconformance (`nonconformance`), which changes no finding:
each is a statement of conformity about what was measured ([ISO17025] 7.8.6).
Every judgement is given its reservations here: those of batch, report and workflow, one by another spec, and that of
`accept verify`, which takes them from the certificate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from accept.base.documents.results import UnitRecord
from accept.judging.reservations.copies import Samples, copies_of
from accept.judging.reservations.folder_name import doubted_folder
from accept.judging.reservations.nonconformance import RELEASING, standing
from accept.judging.reservations.parts import part_doubts
from accept.judging.reservations.reread import Rereading, rereadings
from accept.judging.reservations.superseded import Approval
from accept.judging.rules import reserved
from accept.store import Event, Store
from accept.store.decisions import in_notes
from accept.units import UnitFolder
from checks.cause import Cause


@dataclass(frozen=True)
class Reservations:
    """Doubts of the store about a unit, which weaken its result. copies: recordings of the unit that are filed
    elsewhere too. part_doubts: doubts about its parts, a sentence each. nonconformances: those that hold it;
    superseded: check -> the one of them that an earlier attempt holds against its evidence. dispositions: what quality
    assurance decided about those that hold it no more. folder: its name if that is another unit's serial, and the
    serial that looks like its own. rereadings: by quantity, of recordings that were read otherwise before. of_findings:
    an earlier program made a nonconformance a doubt about every finding."""

    copies: tuple[Mapping[str, Any], ...] = ()
    part_doubts: tuple[str, ...] = ()
    nonconformances: tuple[str, ...] = ()
    dispositions: tuple[Mapping[str, Any], ...] = ()
    folder: Mapping[str, str] = field(default_factory=dict)
    rereadings: Mapping[str, Rereading] = field(default_factory=dict)
    superseded: Mapping[str, str] = field(default_factory=dict)
    of_findings: bool = False

    @classmethod
    def known(
        cls,
        store: Store,
        unit: UnitFolder,
        entry: UnitRecord | None,
        confirmed_by: str = "",
        past: Sequence[Event] | None = None,
        approval: Approval | None = None,
    ) -> "Reservations":
        """Return what the store knows now of a unit with this result, None before the first. confirmed_by: who
        confirmed that a folder with another serial as its name is of this unit. past: the unit's events, if they were
        read before. approval: of the spec that judges it. Raises StoreError."""
        samples: Samples = {} if entry is None else entry.samples
        alone = cls(
            tuple(copies_of(store, unit.serial, str(unit.path.resolve()), samples)),
            tuple(part_doubts(store, unit.header)),
            folder=doubted_folder(store, unit, confirmed_by),
            rereadings={} if entry is None else rereadings(store, unit.serial, samples, entry.findings, entry.inputs),
        )
        if entry is not None:  # what is held already needs no earlier attempt
            entry = replace(entry, findings=alone.apply(entry).findings, copies=alone.copies)
        now = standing(store, unit.serial, unit.notes, entry, past=past, approval=approval)
        return replace(
            alone,
            nonconformances=now.open,
            dispositions=tuple(decided.to_json() for decided in now.released),
            superseded=now.superseded,
        )

    @classmethod
    def stated(cls, entry: UnitRecord) -> "Reservations":
        """Return the reservations that an entry of results.json states."""
        causes = [one.cause for f in entry.findings if f.cause is not None for one in f.cause.all()]
        return cls(**{name: getattr(entry, name) for name in STATED}, of_findings=Cause.NONCONFORMANCE in causes)

    def with_notes(self, notes: Mapping[str, Sequence[str]]) -> "Reservations":
        """Return these and the nonconformances among the folder's notes, but for those that a disposition released."""
        last = {w: given["disposition"]["choice"] for given in self.dispositions for w in given["nonconformances"]}
        here = [words for words in in_notes(notes) if words in self.nonconformances or last.get(words) not in RELEASING]
        return replace(self, nonconformances=(*here, *(n for n in self.nonconformances if n not in here)))

    def __bool__(self) -> bool:
        return any(getattr(self, name) for name in STATED)

    def apply(self, record: UnitRecord) -> UnitRecord:
        """Return the record with its reservations stated, and its findings and verdict as they leave them; the same
        object if there are no reservations."""
        if not self:
            return record
        return reserved(replace(record, **{name: getattr(self, name) for name in STATED}), self.of_findings)


STATED = tuple(field.name for field in fields(Reservations) if field.name != "of_findings")  # in a record too
