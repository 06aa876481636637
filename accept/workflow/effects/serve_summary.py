"""Facts for the dialogue at the summary of a unit."""

from accept.base.documents.results import UnitRecord
from accept.pictures.words import pretty
from accept.workflow.dialogue.summary_state import SummaryFacts
from accept.workflow.session import Session
from checks.verdict import Finding


def facts(session: Session) -> SummaryFacts:
    """Return the state of the unit."""
    attempt, result, steps = session.attempt, session.judgements.result, {s.name: s.short for s in session.steps}
    findings = () if result is None else result.findings
    refused = {f.quantity: record for f in findings if (record := session.records.refusal(f)) is not None}
    return SummaryFacts(
        session.serial,
        session.operator,
        result,
        refused,
        steps,
        {} if result is None else {f.quantity: _about(session, result, f) for f in findings},
        session.judgements.usual,
        session.judgements.earlier,
        session.judgements.nonconformances,
        str(attempt.verdict),
        attempt.certificate,
        attempt.void,
        attempt.signatures,
        session.training,
    )


def _about(session: Session, result: UnitRecord, f: Finding) -> list[str]:
    """Return where the limits of a finding come from, and with what it was measured: as the bench file states it, with
    its calibration, else as the spec names it."""
    asked = session.spec.checks.get(f.check)
    limit = None if asked is None else asked.limits.get(f.quantity)
    stated = (result.calibration or {}).get("instruments", ())
    rows = [row for row in stated if row["check"] == f.check]
    means = [
        f"{row['model'] or row['name']} no. {row['serial'] or 'not known'}, "
        + (f"calibrated until {row['due']}" if row["due"] else "its calibration is not known")
        for row in rows
    ]
    named = [] if asked is None or rows or not asked.instrument else [f"{asked.instrument}, as the spec names it"]
    return [*([] if limit is None else [pretty(f"limits: {limit.source}")]), *means, *named]
