"""Stored units under another spec: which verdicts flip, and why. Nothing is stored and no certificate is touched."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from accept import units
from accept.base.documents.results import UnitRecord
from accept.base.progress import steps
from accept.base.runner import GivenUp, Workers
from accept.judging import input_doubts, judge_unit
from accept.judging.reservations import Reservations, voids
from accept.store import Store, UnitState, fold
from accept.store.payloads import UnitJudged
from accept.units import UnitError
from checks.cause import Cause, because
from checks.quantity import Quantity
from checks.verdict import Finding, judge, unit_verdict
from specs.spec import Spec

RECORDS, VALUES = "records", "stored values"


@dataclass(frozen=True)
class JudgedAgain:
    """A stored result judged anew by another spec. was, now: verdicts of the unit; findings: quantity -> (verdict was,
    verdict now, reason now) where they differ; basis: whether its records were measured again or the stored values were
    compared with the new limits."""

    serial: str
    was: str
    now: str
    findings: Mapping[str, tuple[str, str, str]]
    basis: str

    @property
    def flipped(self) -> bool:
        return self.was != self.now

    @property
    def worse(self) -> bool:
        """Return whether the unit was accepted and would no longer be."""
        return self.flipped and self.was == "accepted"


def judged_again(
    store: Store, specs: Mapping[str, Spec], from_records: bool, cluster: Workers | None = None
) -> Iterator[JudgedAgain]:
    """Yield every unit of the store whose kind has a spec, as its last judgement has it if that is not void: by serial,
    on a cluster as they come back; they are not collected. Raises StoreError, ClusterError.

    from_records: measure unit folders again if they still hold what was judged; only this honours changed settings."""
    void = voids(store)
    last = (event for event in store.last_of_each(UnitJudged.KIND) if event.seq not in void)
    units = (unit for event in last if (unit := fold([event])) is not None)
    with_spec = ((unit, specs.get(unit.result.kind)) for unit in steps(units, "units judged again"))
    asked = ((unit, spec, from_records) for unit, spec in with_spec if spec is not None)
    if cluster is None:
        yield from map(again, asked)
        return
    for item, found in cluster.unordered(again, asked):
        # Records that no worker could judge leave the stored values, as where the records are gone.
        yield again((*item[:2], False)) if isinstance(found, GivenUp) else found


def again(asked: tuple[UnitState, Spec, bool]) -> JudgedAgain:
    """Judge one unit by one spec, from its records or its stored values; here or in a worker."""
    unit, spec, from_records = asked
    findings = _from_records(unit, spec) if from_records else None
    basis = VALUES if findings is None else RECORDS
    measured = from_values(unit.result, spec) if findings is None else findings
    reservations = Reservations.stated(unit.result)
    now = reservations.apply(replace(unit.result, findings=tuple(measured))).findings
    before = {f.quantity: str(f.verdict) for f in unit.result.findings}
    differ = {
        f.quantity: (before.get(f.quantity, "not judged"), str(f.verdict), f.reason or "")
        for f in now
        if before.get(f.quantity) != str(f.verdict)
    }
    gone = {name: (was, "not judged", "") for name, was in before.items() if name not in {f.quantity for f in now}}
    return JudgedAgain(
        unit.serial, unit.verdict, str(unit_verdict(now, bool(reservations.nonconformances))), differ | gone, basis
    )


def _from_records(unit: UnitState, spec: Spec) -> list[Finding] | None:
    """Return the findings measured again from the unit's folder, None unless the folder is as it was judged."""
    try:
        folder = units.read(Path(unit.judged.path))
        if folder.serial != unit.serial or folder.input_hashes() != dict(unit.judged.inputs):
            return None
        return list(judge_unit(folder, spec).findings)
    except (UnitError, OSError):
        return None


def from_values(result: UnitRecord, spec: Spec) -> list[Finding]:
    """Compare stored values with a spec's limits. A quantity that was not measured has no result; one by inputs that
    unit.toml alone stated is conditional at best."""
    doubts = input_doubts({f.check: f.inputs for f in result.findings})
    held = {i.quantity: i.measured() for i in result.information} | {
        f.quantity: Quantity.missing(f.quantity, f.cause or because(Cause.IN_WORDS, detail=f.reason or "no value"))
        if f.value is None
        else Quantity(f.quantity, f.value, f.U)
        for f in result.findings
    }
    judged = [
        judge(name, held.get(quantity, Quantity.missing(quantity, Cause.NOT_MEASURED)), limit, asked.required)
        for name, asked in spec.checks.items()
        for quantity, limit in asked.limits.items()
        if asked.required or quantity in held
    ]
    return [f.weakened(doubts[f.check]) if f.check in doubts else f for f in judged]
