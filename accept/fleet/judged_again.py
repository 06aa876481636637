"""Stored units under another spec: which verdicts flip, and why. Nothing is stored and no certificate is touched."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accept.base.cluster.work import Cluster, GivenUp
from accept.base.progress import steps
from accept.judging.judge_unit import judge_unit
from accept.store import Store, UnitState, fold
from accept.units import unit_folder
from accept.units.unit_folder import UnitError
from checks.cause import Cause, Reason, because
from checks.quantity import Quantity
from checks.verdict import Finding, judge, unit_verdict
from specs.spec import Spec

RECORDS, VALUES = "records", "stored values"


@dataclass(frozen=True)
class JudgedAgain:
    """was, now: verdicts of the unit; findings: quantity -> (verdict was, verdict now, reason now) where they differ;
    basis: whether its records were measured again or the stored values were compared with the new limits."""

    serial: str
    was: str
    now: str
    findings: Mapping[str, tuple[str, str, str]]
    basis: str

    @property
    def flipped(self) -> bool:
        return self.was != self.now


def judged_again(
    store: Store, specs: Mapping[str, Spec], from_records: bool, cluster: Cluster | None = None
) -> list[JudgedAgain]:
    """Every unit of the store whose kind has a spec, by serial. Raises StoreError, ClusterError.

    from_records: measure unit folders again where they hold what was judged; it alone honours changed settings.
    """
    state = fold(store.events(what="unit_judged"))
    asked = [(u, specs[u.result["kind"]], from_records) for u in state.units.values() if u.result["kind"] in specs]
    if cluster is None:
        return sorted(map(again, steps(asked, "units judged again")), key=lambda one: one.serial)
    # Records that no worker could judge leave the stored values, as where the records are gone.
    back = (
        again((*item[:2], False)) if isinstance(found, GivenUp) else found
        for item, found in steps(cluster.unordered(again, asked), "units judged again", len(asked))
    )
    return sorted(back, key=lambda one: one.serial)


def again(asked: tuple[UnitState, Spec, bool]) -> JudgedAgain:
    """One unit under one spec, from its records or its stored values; here or in a worker."""
    unit, spec, from_records = asked
    findings = _from_records(unit, spec) if from_records else None
    basis = VALUES if findings is None else RECORDS
    now = from_values(unit.result, spec) if findings is None else findings
    before = {f["quantity"]: f["verdict"] for f in unit.result["findings"]}
    differ = {
        f.quantity: (before.get(f.quantity, "not judged"), str(f.verdict), f.reason or "")
        for f in now
        if before.get(f.quantity) != str(f.verdict)
    }
    gone = {name: (was, "not judged", "") for name, was in before.items() if name not in {f.quantity for f in now}}
    return JudgedAgain(unit.serial, unit.verdict, str(unit_verdict(now)), differ | gone, basis)


def _from_records(unit: UnitState, spec: Spec) -> list[Finding] | None:
    """Findings from the unit's folder where it is as it was judged, else None."""
    try:
        folder = unit_folder.read(Path(unit.path))
        if folder.serial != unit.serial or folder.input_hashes() != dict(unit.inputs):
            return None
        return list(judge_unit(folder, spec).findings)
    except (UnitError, OSError):
        return None


def from_values(result: Mapping[str, Any], spec: Spec) -> list[Finding]:
    """Stored values against a spec's limits. A quantity that was not measured has no result."""
    held = {
        row["quantity"]: Quantity(
            row["quantity"],
            float("nan") if row["value"] is None else float(row["value"]),
            row["U"],
            reason=_reason(row) if row["value"] is None else None,
        )
        for row in (*result["information"], *result["findings"])
    }
    return [
        judge(name, held.get(quantity, Quantity.missing(quantity, Cause.NOT_MEASURED)), limit, asked.required)
        for name, asked in spec.checks.items()
        for quantity, limit in asked.limits.items()
        if asked.required or quantity in held
    ]


def _reason(row: Mapping[str, Any]) -> Reason:
    if row.get("cause"):
        return Reason.from_json(row["cause"])
    return because(Cause.IN_WORDS, detail=row.get("reason") or "no value")


def as_json(units: list[JudgedAgain]) -> bytes:
    """The table for scripts."""
    document = [
        {"serial": u.serial, "was": u.was, "now": u.now, "basis": u.basis}
        | {"findings": {name: dict(zip(("was", "now", "reason"), v, strict=True)) for name, v in u.findings.items()}}
        for u in units
    ]
    return json.dumps({"units": document}, indent=1, ensure_ascii=False).encode() + b"\n"


def worse(units: list[JudgedAgain]) -> list[JudgedAgain]:
    """Accepted units that would no longer be."""
    return [u for u in units if u.was == "accepted" and u.now != "accepted"]
