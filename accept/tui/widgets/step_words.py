"""What a step asks for, in words: its head, the instruction, instrument and drive."""

from rich.text import Text

from accept.workflow.session import Session
from accept.workflow.status import Status
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.section import missing_labels


def head(session: Session, step: WorkflowStep) -> Text:
    """Return number, state and title, which is never cut."""
    status = session.status(step)
    number = 1 + [s.name for s in session.steps].index(step.name)
    text = Text().append(f"{number}/{len(session.steps)}  ", "dim")
    text.append(f"{status.mark} {status.word}", status.style)
    text.append("  ·  ", "dim").append(step.title, "bold")
    return text if step.required else text.append("  (not required)", "dim")


def setup(step: WorkflowStep) -> Text:
    """Return with which instrument, and who starts the drive at which amplitude."""
    text = Text()
    for label, words in (("Instrument", step.asked.instrument or ""), ("Drive", step.guide.drive)):
        if words:
            text.append(f"{label}: ", "bold").append(f"{words}\n", "")
    text.rstrip()
    return text


def standing(session: Session, step: WorkflowStep) -> str:
    """Return where a step stands that is not judged: what is missing, why it is measured again."""
    status, state = session.status(step), session.state(step.name)
    if status is Status.NOT_DONE:
        return f"Measure again ({state.reasons[-1]})" if state.reasons else ""
    if session.judgement(step.name) is None or status is Status.TAKEN:
        wanted = ", ".join(missing_labels(step, state))
        refused = [f"{record.line}\n→ {record.action}" for record in state.refused.values()]
        done = (
            "Complete, not judged yet"
            if step.check.model is None
            else "Not compared yet. Enter: compare with the model"
        )
        return "\n".join([*refused, f"Missing: {wanted}" if wanted else done])
    return ""
