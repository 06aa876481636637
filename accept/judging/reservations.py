"""What the bench's store knows against a unit that its folder does not show, and what that does to its verdict.

A recording that is filed twice counts for nothing (`accept.judging.copies`); a strut with a part that was not accepted
is conditional at best (`accept.judging.parts`). Every judgement is given its reservations here: those of batch, report
and workflow, one by another spec, and that of `accept verify`, which takes them from the certificate.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from accept.judging.copies import Copy, Samples, copies_of, sections_withheld, without_copies
from accept.judging.parts import part_doubts, weakened_by_parts
from accept.judging.result import UnitResult
from accept.store import Store
from checks.acceptance import CHECKS
from checks.verdict import Finding, unit_verdict


@dataclass(frozen=True)
class Reservations:
    """copies: recordings of the unit that are filed elsewhere too. part_doubts: what speaks against its parts, a
    sentence each."""

    copies: Sequence[Copy] = ()
    part_doubts: Sequence[str] = ()

    @classmethod
    def known(
        cls, store: Store, serial: str, folder: str, samples: Samples, parts: Mapping[str, str]
    ) -> "Reservations":
        """Return what the store knows now. folder: where the unit lies, resolved. Raises StoreError."""
        return cls(tuple(copies_of(store, serial, folder, samples)), tuple(part_doubts(store, serial, parts)))

    @classmethod
    def stated(cls, entry: Mapping[str, Any]) -> "Reservations":
        """Return those that an entry of results.json states."""
        return cls(tuple(entry.get("copies", ())), tuple(entry.get("part_doubts", ())))

    def __bool__(self) -> bool:
        return bool(self.copies or self.part_doubts)

    def weaken(self, findings: Iterable[Finding]) -> tuple[Finding, ...]:
        """Return the findings of a unit with these reservations."""
        if not self:
            return tuple(findings)
        found = tuple(without_copies(f, self.copies) for f in findings)
        return weakened_by_parts(found, self.part_doubts)

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
        )
