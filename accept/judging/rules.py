"""The rules that change a judged record: each from record to record, in the order of `JUDGING` and then `RESERVING`.

Those of `JUDGING` weigh what unit folder, spec and bench hold; those of `RESERVING` what the store knows against the
unit, as the record states it. Each reads the findings as the rules before it leave them and makes none better: a pass
becomes conditional, or a value no result. A reason is added to those that a finding has already, so the order is that
in which its reasons are read.

A learned bench has an age and a number of units: an amplifier is exchanged, a screw of the guide works loose, and what
was learned before makes a misalignment out of it. All that is compared is on the certificate.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import date
from functools import reduce
from typing import Any

from accept.base.documents.results import ALIKE, CONFIRMED, NAME, UnitRecord
from accept.judging import calibration
from accept.judging.advice import concluded
from accept.judging.bench_errors import without_bench_errors
from accept.judging.inputs import input_doubts, inputs_of
from accept.judging.samples import section_read_by
from accept.models.evidence import Models, model_of
from accept.units import LoadedUnit
from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because
from checks.consistency import check_consistency
from checks.errors import ModelError
from checks.quantity import Quantity
from checks.verdict import Finding, Verdict
from specs.model_sections import LearnedBenchRecord
from specs.spec import LearnedBenchLimits, Spec
from specs.strict import SpecError


def learned_bench_doubts(spec: Spec, models: Models, measured: Mapping[str, str]) -> dict[str, Reason]:
    """Return check -> why the learned bench of its model does not meet the spec. measured: check -> day, ISO."""
    if spec.learned_bench is None:
        return {}
    found = {}
    for check, asked in spec.checks.items():
        name = model_of(check, asked)
        if name is None:
            continue
        try:
            record = models.learned_bench(name)
        except (SpecError, ModelError, OSError):
            continue  # the check has no result for that reason
        if problem := learned_bench_problem(spec.learned_bench, record, measured.get(check)):
            found[check] = because(Cause.LEARNED_BENCH, model=name, detail=problem)
    return found


def learned_bench_problem(
    asked: LearnedBenchLimits, record: LearnedBenchRecord | None, measured: str | None
) -> str | None:
    """Return why a learned bench does not meet the limits, None if it does. measured: the unit's day, ISO, or None."""
    if record is None:
        return "it has no learned bench, and the spec asks for one"
    if asked.from_units is not None and len(record.units) < asked.from_units:
        return f"its bench was learned from {len(record.units)} units, the spec asks for {asked.from_units}"
    if asked.within_days is None:
        return None
    if measured is None:
        return "the age of its learned bench is unknown, because [measured] of unit.toml does not state the day"
    try:
        days = (date.fromisoformat(measured) - date.fromisoformat(record.learned_on or "")).days
    except ValueError:
        return f"learned_on = '{record.learned_on or ''}' is no day, so the age of its learned bench is unknown"
    if days > asked.within_days:
        return f"its bench was learned {days} days before the unit was measured, the spec allows {asked.within_days}"
    return None


NAMED = 3  # copies that a reason names; with more it says how many


@dataclass(frozen=True)
class Case:
    """A unit with all that its judgement depends on. known: the measured quantities, by name."""

    unit: LoadedUnit
    spec: Spec
    models: Models
    known: Mapping[str, Quantity]


def _doubted(record: UnitRecord, doubts: Mapping[str, Reason]) -> UnitRecord:
    found = (f.weakened(doubts[f.check]) if f.check in doubts else f for f in record.findings)
    return replace(record, findings=tuple(found))


def _all_doubted(record: UnitRecord, doubt: Reason) -> UnitRecord:
    return _doubted(record, {f.check: doubt for f in record.findings})


def contradict(record: UnitRecord, case: Case) -> UnitRecord:
    """Withhold measurements that contradict each other."""
    return replace(record, findings=tuple(check_consistency(record.findings, case.known)))


def state_inputs(record: UnitRecord, case: Case) -> UnitRecord:
    """State the inputs behind each finding."""
    inputs = inputs_of(case.unit, case.spec, record.calibration)
    return replace(record, findings=tuple(replace(f, inputs=inputs.get(f.check, ())) for f in record.findings))


def doubt_learned_bench(record: UnitRecord, case: Case) -> UnitRecord:
    """Doubt results by a model whose learned bench is not what the spec asks for."""
    return _doubted(record, learned_bench_doubts(case.spec, case.models, record.measured))


def doubt_channels(record: UnitRecord, case: Case) -> UnitRecord:
    """Doubt results of records with a channel that units of the product do not have."""
    found = {name: case.unit.unexpected_channel(CHECKS[name].reads) for name in case.spec.checks}
    return _doubted(record, {name: reason for name, reason in found.items() if reason is not None})


def doubt_inputs(record: UnitRecord, _: Case) -> UnitRecord:
    """Doubt results by inputs that neither spec nor bench file state as they were used."""
    return _doubted(record, input_doubts({f.check: f.inputs for f in record.findings}))


def weigh_calibration(record: UnitRecord, case: Case) -> UnitRecord:
    """Doubt results by instruments without a valid calibration, or without the comparison that the spec asks for."""
    stated, checks = record.calibration, case.spec.checks
    if stated is not None:
        stated = calibration.checked_calibration(stated, case.unit.folder.measured)
        record = replace(record, calibration=stated, notes=(*record.notes, *calibration.notes(stated)))
        record = _doubted(record, calibration.problems(stated, checks))
    return _doubted(record, calibration.without_reference(stated, checks))


def withhold_bench_errors(record: UnitRecord, _: Case) -> UnitRecord:
    """Withhold a resonance that a wrong payload moved out of its limits."""
    return without_bench_errors(record)


def withhold_copies(record: UnitRecord) -> UnitRecord:
    """Withhold what recordings give that are filed elsewhere too."""
    of_section = {copy["sample"].partition("/")[0]: copy for copy in reversed(record.copies) if copy["withheld"]}
    information = tuple(i for i in record.information if section_read_by(i.check) not in of_section)
    findings = (_without(f, of_section.get(section_read_by(f.check))) for f in record.findings)
    return replace(record, findings=tuple(findings), information=information)


def _without(finding: Finding, copy: Mapping[str, Any] | None) -> Finding:
    if copy is None:
        return finding
    named, more = copy["with"][:NAMED], len(copy["with"]) - NAMED
    others = ", ".join(f"{w['sample']} of {w['serial']}" for w in named) + (f" and of {more} more" if more > 0 else "")
    cause = because(Cause.SAMPLES_COPIED, record=copy["sample"].partition("/")[2], others=others)
    return finding.withheld(cause)


def weaken_reread(record: UnitRecord) -> UnitRecord:
    """Doubt results of recordings that were read otherwise before and did not pass then; note it of those that did."""
    return replace(record, findings=tuple(_reread(f, record.rereadings.get(f.quantity)) for f in record.findings))


def _reread(finding: Finding, reading: Mapping[str, str] | None) -> Finding:
    if reading is None:
        return finding
    cause = because(Cause.READ_OTHERWISE, detail=reading["words"])
    if reading["was"] == Verdict.PASS:
        return replace(finding, note="; ".join(n for n in (finding.note, str(cause)) if n))
    return finding.weakened(cause)


def doubt_parts(record: UnitRecord) -> UnitRecord:
    """Doubt every result of a unit with a part in doubt."""
    words = "; ".join(record.part_doubts)
    return _all_doubted(record, because(Cause.PART_DOUBTED, detail=words)) if words else record


def weaken_superseded(record: UnitRecord) -> UnitRecord:
    """Doubt results against whose evidence an earlier attempt holds something."""
    return _doubted(record, {c: because(Cause.SUPERSEDED, detail=words) for c, words in record.superseded.items()})


def hold_findings(record: UnitRecord) -> UnitRecord:
    """Doubt every result of a unit with a nonconformance, as earlier programs did."""
    words = "; ".join(record.nonconformances)
    return _all_doubted(record, because(Cause.NONCONFORMANCE, detail=words)) if words else record


def doubt_folder(record: UnitRecord) -> UnitRecord:
    """Doubt every result if the folder has the name of another unit and no person confirmed the serial."""
    name = None if CONFIRMED in record.folder else record.folder.get(NAME)
    return record if name is None else _all_doubted(record, because(Cause.FOLDER_NAME, name=name))


def doubt_serial(record: UnitRecord) -> UnitRecord:
    """Doubt every result if the serial looks like one that the store had before."""
    name = record.folder.get(ALIKE)
    return record if name is None else _all_doubted(record, because(Cause.SERIAL_ALIKE, name=name))


JUDGING: tuple[Callable[[UnitRecord, Case], UnitRecord], ...] = (
    contradict,  # first: it compares values, whatever is doubted of them later
    state_inputs,  # `doubt_inputs` reads them
    doubt_learned_bench,
    doubt_channels,
    doubt_inputs,
    weigh_calibration,
    withhold_bench_errors,  # it asks whether anything else contradicts the responses
)
LATER = (doubt_inputs, withhold_bench_errors)  # earlier programs did not weigh these
RESERVING: tuple[Callable[[UnitRecord], UnitRecord], ...] = (
    withhold_copies,  # first: what has no result is not weakened further
    weaken_reread,
    doubt_parts,
    weaken_superseded,
    hold_findings,
    doubt_folder,
    doubt_serial,
)


def judged(record: UnitRecord, case: Case, own: bool = True) -> UnitRecord:
    """Return the record as the rules of `JUDGING` leave it. own: False for the record of an earlier program."""
    rules = (rule for rule in JUDGING if own or rule not in LATER)
    return concluded(reduce(lambda each, rule: rule(each, case), rules, record))


def reserved(record: UnitRecord, holds_findings: bool = False) -> UnitRecord:
    """Return the record as the rules of `RESERVING` leave it. holds_findings: an earlier program judged it."""
    rules = (rule for rule in RESERVING if holds_findings or rule is not hold_findings)
    return concluded(reduce(lambda each, rule: rule(each), rules, record))
