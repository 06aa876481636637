"""Facts for the dialogue at the summary of a unit."""

from accept.workflow.dialogue.summary_state import SummaryFacts
from accept.workflow.session import Session
from accept.workflow.steps.section import note_lines


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
        {f"{name}: {line}" for name in steps for line in note_lines(session.state(name))},
        session.judgements.nonconformances,
        str(attempt.verdict),
        attempt.certificate,
        attempt.void,
        attempt.signatures,
        session.training,
    )
