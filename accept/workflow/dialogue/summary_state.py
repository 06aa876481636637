"""State of the dialogue at the summary of a unit, and what is shown of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from accept.base.documents.results import UnitRecord, is_typed_note
from accept.base.names import shown_name
from accept.judging.advice import ADVICE, advice, first_advice
from accept.pictures.labels import label_of
from accept.store import Signature
from accept.store.payloads import RecordRefused, without_hashes
from accept.workflow.dialogue import turn
from accept.workflow.dialogue.summary_effects import Report
from accept.workflow.steps.status import Status, of_findings
from checks.acceptance import CHECKS
from checks.cause import Cause
from checks.verdict import RULES, Finding, UnitVerdict, Verdict

VALID, SIGNED = "valid", "signed"  # outcomes of a verification
_OUTCOMES = {VALID: "✓ verified", SIGNED: "◐ signed, not fully verified", "not valid": "✗ NOT VALID"}
_OPEN = {
    Status.FAIL: "failed",
    Status.NO_RESULT: "no result",
    Status.REFUSED: "record refused",
    Status.NOT_DONE: "not measured",
    Status.CONDITIONAL: "conditional",
}


@dataclass(frozen=True)
class SummaryFacts:
    """The unit as it is in the store. result: of the last judgement, None if its inputs have changed since; refused:
    quantity -> the record that it lacks; steps: name -> name in a list; about: quantity -> its requirement and what
    measured it, a line each; usual, earlier: quantity -> what the units before showed; idle: nothing is under way;
    in_front: no question stands in front of the summary."""

    serial: str
    operator: str
    result: UnitRecord | None
    refused: Mapping[str, RecordRefused] = field(default_factory=dict)
    steps: Mapping[str, str] = field(default_factory=dict)
    about: Mapping[str, Sequence[str]] = field(default_factory=dict)
    usual: Mapping[str, float] = field(default_factory=dict)
    earlier: Mapping[str, Sequence[float]] = field(default_factory=dict)
    nonconformances: Sequence[str] = ()
    verdict: str = ""
    certificate: str | None = None
    void: str | None = None
    signatures: Sequence[Signature] = ()
    training: bool = False
    idle: bool = True
    in_front: bool = True


@dataclass(frozen=True)
class SummaryDialogue:
    """State of the summary. row: the finding whose reason is shown; signs: its key came before the result; report: of
    the certificate that was signed here; failed: there is no result."""

    facts: SummaryFacts
    row: int = 0
    signs: bool = False
    report: Report | None = None
    failed: bool = False

    @property
    def findings(self) -> Sequence[Finding]:
        return () if self.facts.result is None else self.facts.result.findings

    def status(self, f: Finding) -> Status:
        """Return the status of a quantity; those without a result differ by the cause."""
        if f.verdict is Verdict.PASS and self.facts.result is not None and self.facts.result.nonconformances:
            return Status.HELD
        if f.quantity in self.facts.refused:
            return Status.REFUSED
        unmeasured = f.cause is not None and f.cause.cause is Cause.NOT_MEASURED and not f.cause.record
        return Status.NOT_DONE if unmeasured else of_findings([f])

    @property
    def open_words(self) -> list[str]:
        """Return the quantities that keep the unit from being accepted, by their status."""
        found = [(self.status(f), label_of(f.quantity)) for f in self.findings]
        groups = {word: [label for own, label in found if own is status] for status, word in _OPEN.items()}
        return [f"{word}: {listed(labels)}" for word, labels in groups.items() if labels]

    @property
    def closest(self) -> str:
        """Return which quantity lies closest to one of its two limits, "" without any that has two."""
        shares = {
            label_of(f.quantity): min(f.value - f.lower, f.upper - f.value) / (f.upper - f.lower)
            for f in self.findings
            if f.value is not None and f.lower is not None and f.upper is not None
        }
        if not shares or min(shares.values()) < 0.0:
            return ""
        label = min(shares, key=lambda each: shares[each])
        return f"closest to a limit: {label}, {shares[label]:.0%} of its zone away"

    @property
    def certificate_steps(self) -> list[tuple[str, bool | None]]:
        """Return the steps of a certificate: what is done, what failed (False) and what is still to come (None)."""
        signed = self.facts.certificate is not None or None
        verified = None if self.report is None else self.report.outcome == VALID
        countersigned = len(self.facts.signatures) > 1 or None
        return [("sign", signed), ("store", signed), ("verify", verified), ("QA", countersigned)]

    @property
    def todo(self) -> list[str]:
        """Return what to do first."""
        files = {refused.file: refused for refused in self.facts.refused.values()}
        first = first_advice(self.findings)
        return [*(f"{file}: {refused.action}" for file, refused in files.items()), *([first] if first else [])]

    @property
    def worst(self) -> int:
        """Return the first finding that is no pass."""
        return next((n for n, f in enumerate(self.findings) if f.verdict is not Verdict.PASS), 0)

    @property
    def detail(self) -> str:
        """Return why a finding is what it is and what to do about it unless it stands below the verdict, what asks for
        it and what measured it."""
        if not 0 <= self.row < len(self.findings) or self.facts.result is None:
            return ""
        f, said = self.findings[self.row], "\n → ".join(self.todo)
        refused = self.facts.refused.get(f.quantity)
        why, todo = f.reason or f.note or f"passes if {RULES[str(f.rule)]}", advice(CHECKS[f.check], f)
        if refused is not None:
            why, todo = refused.line, [refused.action]
        lines = [f"{label_of(f.quantity)}: {why}", *(f"→ {line}" for line in todo if line not in said)]
        if self.facts.result.nonconformances:
            hold = ADVICE[Cause.NONCONFORMANCE]
            lines.append(f"→ {hold.removeprefix('sign; ') if self.facts.certificate is not None else hold}")
        return "\n".join([*lines, *self.facts.about.get(f.quantity, ())])

    @property
    def notes(self) -> list[str]:
        """Return the notes, those that were typed first, each with its step as people read it."""
        result = self.facts.result
        if result is None:
            return []
        parts = (n.partition(": ") for n in sorted(result.notes, key=lambda note: not is_typed_note(note)))
        return [without_hashes(f"{self.facts.steps.get(step, step)}{colon}{words}") for step, colon, words in parts]

    @property
    def certificate_words(self) -> str:
        facts = self.facts
        if facts.certificate is None and facts.void is not None:
            lacks = " and lacks the nonconformance" if facts.nonconformances else ""
            void = f"✗ {Path(facts.void).name} is void: it is older than the last change{lacks}"
            return f"Certificate: not signed. {void}\n→ Do not hand it out. ^S: sign again, which replaces it"
        if facts.certificate is None:
            return f"Certificate: not signed. Judged in the name of {shown_name(facts.operator, typed=True)}"
        words = f"Certificate: {facts.certificate}"
        if self.report is not None:  # it names who signed
            return f"{_OUTCOMES[self.report.outcome]}: {self.report.reason}\n{words}"
        return f"{words}\nSigned by: {', '.join(f'{s.who} ({s.role})' for s in facts.signatures)}"

    @property
    def idle_keys(self) -> set[str]:
        """Return the keys that only say why they do nothing at present."""
        signed = self.facts.certificate is not None
        does = {"ctrl+s": not signed, "ctrl+t": self.awaits_qa, "ctrl+e": signed, "f8": self.failed}
        return {key for key, active in does.items() if not active}

    @property
    def awaits_qa(self) -> bool:
        """Return whether the technician has signed and quality assurance has not."""
        return self.facts.certificate is not None and len(self.facts.signatures) < 2

    @property
    def signed_words(self) -> str:
        """Return what follows the technician's signature: a unit that is not accepted is kept apart."""
        aside = "" if self.accepted or not self.awaits_qa else "Set the unit aside, QA decides about it (^T). "
        return f"{aside}F10: next unit"

    @property
    def accepted(self) -> bool:
        return self.facts.result is not None and self.facts.result.verdict is UnitVerdict.ACCEPTED


def listed(names: Sequence[str]) -> str:
    """Return names in a sentence; where one holds a comma, others stand between them."""
    return ("; " if any("," in name for name in names) else ", ").join(names)


Turn = turn.Turn[SummaryDialogue]
