"""Import of an existing unit folder into the workflow: its values and records become entries like any other."""

import numpy as np

from accept import units
from accept.units import FileEntry, UnitFolder, UnitSection
from accept.workflow.session import Session
from accept.workflow.steps.plan import WorkflowStep
from accept.workflow.steps.section import OF_FOLDER
from checks.declare import Check, Measured
from checks.errors import RecordError


def adopt(session: Session, taken: UnitFolder) -> list[str]:
    """Store every value and record of a folder that the attempt does not have yet, with the folder's day of measuring;
    return messages on those that could not be taken. Entries that were undone or are being measured anew do not come
    back. Raises StoreError, OSError."""
    problems = []
    for step in session.steps:
        part = taken.sections.get(step.check.reads)
        if not step.derived and part is not None:
            problems += _section(session, taken, step, part)
    if taken.experiments:
        names = ", ".join(taken.experiments)
        problems.append(f"experiments ({names}) are not part of the workflow: `accept gap` reads them in {taken.path}")
    return problems


def _section(session: Session, taken: UnitFolder, step: WorkflowStep, part: UnitSection[Check]) -> list[str]:
    if part.problem:
        return [f"{step.name}: {part.problem}"]
    day = taken.measured.get(step.check.reads)
    said = None if day is None else day.isoformat()
    problems: list[str] = []
    given = session.entries.ever_given()
    for (name, index), entry in _single(part).items():
        if (step.name, name, index) in given:
            continue
        if isinstance(entry, FileEntry):
            problems += _link(session, taken, step, entry, said)
        else:
            text = str(taken.path)
            session.entries.take(
                step.name, step.check.inputs[name], entry, index=index, source=OF_FOLDER, text=text, day=said
            )
    return problems


def _single(part: UnitSection[Check]) -> dict[tuple[str, int | None], Measured | FileEntry]:
    found: dict[tuple[str, int | None], Measured | FileEntry] = {}
    for name, entry in part.entries.items():
        if isinstance(entry, np.ndarray):
            found |= {(name, index): Measured(float(value)) for index, value in enumerate(entry)}
        else:
            found[name, None] = entry
    return found


def _link(session: Session, taken: UnitFolder, step: WorkflowStep, entry: FileEntry, day: str | None) -> list[str]:
    try:
        session.records.link(step.name, entry.declared, units.inside(taken.path, entry.name), day)
    except RecordError as e:
        return [f"{step.name}: {e}"]
    return []
