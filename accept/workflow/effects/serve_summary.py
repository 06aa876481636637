"""Facts for the dialogue at the summary of a unit."""

from accept.workflow.dialogue.summary_state import SummaryFacts
from accept.workflow.session import Session


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
        session.judgements.nonconformances,
        str(attempt.verdict),
        attempt.certificate,
        attempt.void,
        attempt.signatures,
        session.training,
    )
