"""The result of one unit: what judging decides, and what the store, the certificate and results.json hold."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from checks.cause import Cause, Reason, because
from checks.picture import Panel
from checks.quantity import Contribution, Quantity
from checks.rounding import rounded, with_U
from checks.verdict import Finding, UnitVerdict, Verdict

GAP_PICTURES = "gap/"  # how the names of the gap workflow's pictures begin, among those of a unit


@dataclass(frozen=True, eq=False)
class UnitResult:
    """One judged unit.

    findings : judged quantities. information : measured quantities that the spec does not limit.
    not_judged : sections of `unit.toml` that the spec does not ask about, with what is in them.
    inputs : file name (relative to the unit folder, `unit.toml` included) -> sha256.
    panels : pictures as data by name, for the certificate; not part of the JSON.
    calibration : a `calibration.Statement` where the unit was judged with a bench file; in the JSON only then.
    models : model file that the spec names -> its files -> sha256; in the JSON only where there is one.
    samples : sketches of its records (`accept.units.samples`); in the JSON only where there are records.
    copies : its recordings that stand elsewhere too (`accept.judging.copies`); in the JSON only where any does.
    nonconformances : what was found wrong with the part and holds it (`accept.judging.nonconformance`); likewise.
    part_doubts : what speaks against its parts (`accept.judging.parts`); in the JSON only where anything does.
    gap : what `accept.gap.attach_to_result` found missing from the model; in the JSON only where that was asked for.
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

    @property
    def spec(self) -> str:
        """As events name it."""
        return f"{self.spec_name}@{self.spec_sha256}"

    def __repr__(self) -> str:
        """A line for the unit and one for each finding: what a notebook shows."""
        lines = [f"{self.serial} ({self.kind}): {self.verdict} by spec {self.spec_name}"]
        for f in self.findings:
            value = "" if f.value is None else f" {with_U(f.value, f.U) if f.U else rounded(f.value, None)}"
            why = "" if f.reason is None else f", {f.reason}"
            lines.append(f"  {f.quantity}{value}: {f.verdict.replace('_', ' ')}{why}")
        return "\n".join(lines)

    def to_json(self) -> dict[str, Any]:
        """The unit's entry in results.json, without its certificate; NaN never appears, a missing number is null."""
        entry = {
            "serial": self.serial,
            "kind": self.kind,
            "verdict": str(self.verdict),
            "findings": [finding_json(f) for f in self.findings],
            "information": [information_json(check, q) for check, q in self.information],
            "not_judged": list(self.not_judged),
            "notes": list(self.notes),
            "parts": dict(self.parts),
            "inputs": dict(sorted(self.inputs.items())),
        }
        more = {
            "calibration": self.calibration, "gap": self.gap, "models": self.models or None,
            "samples": self.samples or None,
        }  # fmt: skip
        if self.copies:
            entry["copies"] = [dict(copy) for copy in self.copies]
        if self.part_doubts:
            entry["part_doubts"] = list(self.part_doubts)
        if self.nonconformances:
            entry["nonconformances"] = list(self.nonconformances)
        return entry | {key: dict(value) for key, value in more.items() if value is not None}


def finding_json(finding: Finding) -> dict[str, Any]:
    """A finding as results.json has it ([DESIGN] 4)."""
    plain = {"verdict": str(finding.verdict), "budget": [asdict(c) for c in finding.budget]}
    return asdict(finding) | plain | {"cause": None if finding.cause is None else finding.cause.to_json()}


def finding_from_json(entry: Mapping[str, Any]) -> Finding:
    """Inverse of `finding_json`. Raises KeyError, TypeError or ValueError for what is not a finding."""
    known = {f.name for f in fields(Finding)}
    typed = {
        "verdict": Verdict(entry["verdict"]),
        "budget": tuple(Contribution(**c) for c in entry.get("budget", ())),
        "cause": Reason.from_json(entry["cause"]) if entry.get("cause") else None,
    }
    return Finding(**({k: v for k, v in entry.items() if k in known} | typed))


def information_from_json(entry: Mapping[str, Any]) -> Quantity:
    """The quantity that `information_json` wrote; raises as `finding_from_json`."""
    reason = because(Cause.IN_WORDS, detail=entry["reason"]) if entry.get("reason") else None
    value = math.nan if entry["value"] is None else float(entry["value"])
    budget = tuple(Contribution(**c) for c in entry.get("budget", ()))
    return Quantity(entry["quantity"], value, entry["U"], budget, reason, entry.get("note"))


def information_json(check: str, quantity: Quantity) -> dict[str, Any]:
    """A quantity without a limit, as results.json has it."""
    known = math.isfinite(quantity.value)
    return {
        "check": check,
        "quantity": quantity.name,
        "value": quantity.value if known else None,
        "unit": quantity.unit,
        "U": quantity.U if quantity.U is not None and math.isfinite(quantity.U) else None,
        "reason": _reason_words(quantity, known),
        "note": quantity.note,
        "budget": [asdict(c) for c in quantity.budget],
    }


def _reason_words(quantity: Quantity, known: bool) -> str | None:
    if quantity.reason is not None:
        return str(quantity.reason)
    return None if known else "no value"
