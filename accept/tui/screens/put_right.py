"""Training: what is put right at the bench, after which the records are made anew."""

from collections.abc import Callable, Collection
from typing import Any

from accept.simulate.faults import Remedy
from accept.tui.background.busy_screen import Working
from accept.tui.screens.ask import Choice
from accept.workflow.bench import Workbench
from accept.workflow.session import Session
from accept.workflow.status import Status
from accept.workflow.training import record_stems

_WORDS = "What do you do at the bench? The simulated rig then records that step again."


def _repeats(session: Session, without: Collection[str]) -> list[Remedy]:
    """Return for each failed step that was recorded what its check advises, after which its records are made again."""
    failed = [s for s in session.steps if not s.derived and s.check.failed and session.status(s) is Status.FAIL]
    records = {s.name: record_stems(session.state(s.name).entries) for s in failed}
    return [
        Remedy(step.check.failed, step.name, records[step.name])
        for step in failed
        if records[step.name] and step.name not in without
    ]


def ask_remedy(screen: Working[bool], bench: Workbench, session: Session, then: Callable[[str], None]) -> None:
    """Ask what is put right and do it; then is called with the name of the step that is measured again."""
    unit = bench.training
    if unit is None:
        return
    steps = {step.name for step in session.steps}
    remedies = [remedy for remedy in unit.remedies if remedy.step in steps]
    remedies += _repeats(session, without={remedy.step for remedy in remedies})

    def do(place: int | None) -> None:
        if place is not None:
            remedy = remedies[place]

            def done(_: Any) -> None:
                then(remedy.step)

            screen.hold(lambda: unit.put_right(session, remedy), done, "recording again")

    screen.app.push_screen(Choice("Put something right", _WORDS, [remedy.words for remedy in remedies]), do)
