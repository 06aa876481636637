"""The result of one unit, as judging returns it and as the store, the certificate and results.json hold it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from accept.base.documents.results import Information, UnitEntry
from accept.judging.advice import action
from accept.pictures import signs
from checks.declare import Measured
from checks.picture import Panel
from checks.quantity import Quantity
from checks.rounding import rounded, with_U
from checks.verdict import Finding, UnitVerdict

GAP_PICTURES = "gap/"  # how the names of the gap workflow's pictures begin, among those of a unit


@dataclass(frozen=True, eq=False)
class UnitResult:
    """One judged unit.

    findings : judged quantities. information : measured quantities that the spec does not limit.
    not_judged : sections of `unit.toml` that the spec does not ask about, with what is in them.
    inputs : file name (relative to the unit folder, `unit.toml` included) -> sha256.
    panels : pictures as data by name, for the certificate; not part of the JSON.
    calibration : a `calibration.Statement` if the unit was judged with a bench file; in the JSON only then.
    models : model file that the spec names -> its files -> sha256; in the JSON only if it names one.
    samples : sketches of its records (`accept.units.samples`); in the JSON only if it has records.
    copies : its recordings that exist elsewhere too (`accept.judging.copies`); in the JSON only if any does.
    nonconformances : those of the part that hold it (`accept.judging.nonconformance`); likewise. superseded: check ->
    the one of them that earlier attempts hold against its evidence.
    dispositions : what quality assurance decided about nonconformances of the unit; likewise.
    folder : name of its folder if that is another unit's serial (`accept.judging.folder_name`); likewise.
    rereadings : of its recordings that were read otherwise before (`accept.judging.rereadings`); likewise.
    part_doubts : doubts about its parts (`accept.judging.parts`); in the JSON only if any exists.
    gap : what `accept.gap.attach_to_result` found missing from the model; in the JSON only if that was asked for.
    measured : section -> day of measuring; origin, environment, provided : as its folder states them; in the JSON only
    then. simulated : no instrument measured it, as its folder states; in the JSON only then.
    """

    serial: str
    kind: str
    verdict: UnitVerdict
    findings: tuple[Finding, ...]
    information: tuple[tuple[str, Quantity], ...] = ()  # (check, quantity)
    not_judged: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    parts: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    spec_name: str = ""
    spec_sha256: str = ""
    panels: Mapping[str, Panel] = field(default_factory=dict)
    calibration: Mapping[str, Any] | None = None
    gap: Mapping[str, Any] | None = None
    models: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    samples: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    copies: tuple[Mapping[str, Any], ...] = ()
    part_doubts: tuple[str, ...] = ()
    nonconformances: tuple[str, ...] = ()
    superseded: Mapping[str, str] = field(default_factory=dict)
    dispositions: tuple[Mapping[str, Any], ...] = ()
    folder: Mapping[str, str] = field(default_factory=dict)
    rereadings: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    measured: Mapping[str, str] = field(default_factory=dict)
    origin: Mapping[str, str] = field(default_factory=dict)
    environment: Mapping[str, Measured] = field(default_factory=dict)
    provided: Mapping[str, str] = field(default_factory=dict)
    simulated: bool = False

    @property
    def spec(self) -> str:
        """The spec as events name it."""
        return f"{self.spec_name}@{self.spec_sha256}"

    @property
    def word(self) -> str:
        """The verdict as people read it."""
        return signs.unit_word(self.verdict, self.nonconformances, self.dispositions)

    @property
    def action(self) -> str | None:
        """What to correct at the bench before it is measured again, None if no such cause is known."""
        return action(self.findings)

    def __repr__(self) -> str:
        """Return a line for the unit and one for each finding: what a notebook shows."""
        by_spec = signs.marked(f"{self.word} by spec {self.spec_name}", self.simulated)
        lines = [f"{self.serial} ({self.kind}): {by_spec}"]
        for f in self.findings:
            value = "" if f.value is None else f" {with_U(f.value, f.U) if f.U else rounded(f.value, None)}"
            why = "" if f.reason is None else f", {f.reason}"
            lines.append(f"  {f.quantity}{value}: {f.verdict.replace('_', ' ')}{why}")
        return "\n".join(lines)

    @property
    def entry(self) -> UnitEntry:
        """Return the unit's entry in results.json, without its certificate."""
        return UnitEntry(
            serial=self.serial,
            kind=self.kind,
            verdict=self.verdict,
            findings=self.findings,
            information=tuple(Information.of(check, quantity) for check, quantity in self.information),
            not_judged=self.not_judged,
            notes=self.notes,
            parts=dict(self.parts),
            inputs=dict(sorted(self.inputs.items())),
            copies=self.copies,
            part_doubts=self.part_doubts,
            action=self.action,
            nonconformances=self.nonconformances,
            superseded=dict(self.superseded),
            dispositions=self.dispositions,
            folder=dict(self.folder),
            rereadings=self.rereadings,
            calibration=self.calibration,
            gap=self.gap,
            models=self.models,
            samples=self.samples,
            measured=dict(self.measured),
            origin=dict(self.origin),
            environment=dict(self.environment),
            provided=dict(self.provided),
            simulated=self.simulated,
        )

    def to_json(self) -> dict[str, Any]:
        """Return `entry` as JSON; NaN never appears, a missing number is null."""
        return self.entry.to_json()
