"""Reservations: facts against a unit that the bench's store knows and its folder does not show, and their effect on the
verdict.

A recording that is filed twice does not count (`accept.judging.copies`), one that was read otherwise before makes no
finding pass that did not (`accept.judging.rereadings`); a strut with a part that was not accepted
(`accept.judging.parts`) and a unit with a nonconformance (`accept.judging.nonconformance`) are conditional at best.
Every judgement is given its reservations here: those of batch, report and workflow, one by another spec, and that of
`accept verify`, which takes them from the certificate.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from accept.base.documents.results import UnitEntry
from accept.judging.calibration import weakened
from accept.judging.copies import Copy, Samples, copies_of, sections_withheld, without_copies
from accept.judging.folder_name import ALIKE, CONFIRMED, NAME, doubted_folder
from accept.judging.nonconformance import in_notes, open_nonconformances
from accept.judging.parts import part_doubts
from accept.judging.rereadings import Rereading, rereadings, weaken_reread
from accept.judging.result import UnitResult
from accept.store import Event, Store
from accept.units.unit_folder import UnitFolder
from checks.acceptance import CHECKS
from checks.cause import Cause, because
from checks.verdict import Finding, unit_verdict


@dataclass(frozen=True)
class Reservations:
    """copies: recordings of the unit that are filed elsewhere too. part_doubts: doubts about its parts, a sentence
    each. nonconformances: those that hold it; superseded: check -> the one of them that holds its findings alone.
    folder: its name if that is another unit's serial, and the serial that looks like its own
    (`accept.judging.folder_name`). rereadings: by quantity, of recordings that were read otherwise before."""

    copies: Sequence[Copy] = ()
    part_doubts: Sequence[str] = ()
    nonconformances: Sequence[str] = ()
    folder: Mapping[str, str] = field(default_factory=dict)
    rereadings: Mapping[str, Rereading] = field(default_factory=dict)
    superseded: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def known(
        cls,
        store: Store,
        unit: UnitFolder,
        entry: UnitEntry | None,
        confirmed_by: str = "",
        past: Sequence[Event] | None = None,
    ) -> "Reservations":
        """Return what the store knows now of a unit with this result, None before the first. confirmed_by: who
        confirmed that a folder with another serial as its name is of this unit. past: the unit's events, if they were
        read before. Raises StoreError."""
        samples: Samples = {} if entry is None else entry.samples
        held, older = open_nonconformances(store, unit.serial, unit.notes, entry, past=past)
        return cls(
            tuple(copies_of(store, unit.serial, str(unit.path.resolve()), samples)),
            tuple(part_doubts(store, unit.serial, unit.parts)),
            tuple(held),
            doubted_folder(store, unit, confirmed_by),
            rereadings(store, unit.serial, samples, () if entry is None else entry.findings),
            older,
        )

    @classmethod
    def stated(cls, entry: UnitEntry) -> "Reservations":
        """Return the reservations that an entry of results.json states."""
        return cls(
            tuple(dict(copy) for copy in entry.copies),
            entry.part_doubts,
            entry.nonconformances,
            dict(entry.folder),
            entry.rereadings,
            dict(entry.superseded),
        )

    def with_notes(self, notes: Mapping[str, Sequence[str]]) -> "Reservations":
        """Return these and the nonconformances among the notes of the unit's folder."""
        here = in_notes(notes)
        return replace(self, nonconformances=(*here, *(n for n in self.nonconformances if n not in here)))

    def __bool__(self) -> bool:
        return bool(self.copies or self.part_doubts or self.nonconformances or self.folder or self.rereadings)

    def weaken(self, findings: Iterable[Finding]) -> tuple[Finding, ...]:
        """Return the findings of a unit with these reservations."""
        if not self:
            return tuple(findings)
        found = tuple(without_copies(f, self.copies) for f in findings)
        found = tuple(weaken_reread(f, self.rereadings.get(f.quantity)) for f in found)
        if self.part_doubts:
            doubt = because(Cause.PART_DOUBTED, detail="; ".join(self.part_doubts))
            found = tuple(weakened(f, doubt) for f in found)
        alone = set(self.superseded.values()) if self.superseded.keys() <= {f.check for f in found} else set()
        of_unit = [words for words in self.nonconformances if words not in alone]
        for check in {f.check for f in found} if self.nonconformances else ():
            words = [*of_unit, *(w for name, w in self.superseded.items() if name == check and w in alone)]
            held = because(Cause.NONCONFORMANCE, detail="; ".join(words))
            found = tuple(weakened(f, held) if words and f.check == check else f for f in found)
        if NAME in self.folder and CONFIRMED not in self.folder:
            doubt = because(Cause.FOLDER_NAME, name=self.folder[NAME])
            found = tuple(weakened(f, doubt) for f in found)
        if ALIKE in self.folder:
            doubt = because(Cause.SERIAL_ALIKE, name=self.folder[ALIKE])
            found = tuple(weakened(f, doubt) for f in found)
        return found

    def apply(self, result: UnitResult) -> UnitResult:
        """Return the result with its reservations stated, and its findings and verdict as they leave them; the same
        object if there are no reservations."""
        if not self:
            return result
        findings = self.weaken(result.findings)
        withheld = sections_withheld(self.copies)
        return replace(
            result,
            findings=findings,
            information=tuple((check, q) for check, q in result.information if CHECKS[check].reads not in withheld),
            verdict=unit_verdict(findings),
            copies=tuple(self.copies),
            part_doubts=tuple(self.part_doubts),
            nonconformances=tuple(self.nonconformances),
            folder=dict(self.folder),
            rereadings=self.rereadings,
            superseded=dict(self.superseded),
        )
