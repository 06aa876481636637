"""Training: what is put right at the bench, after which the records are made anew."""

from collections.abc import Callable

from accept.tui.background.busy_screen import Working
from accept.tui.screens.ask import Choice
from accept.workflow.bench import Workbench
from accept.workflow.session import Session

_WORDS = "What do you do at the bench? The simulated rig then records that step again."


def ask_remedy(screen: Working[bool], bench: Workbench, session: Session, then: Callable[[str], None]) -> None:
    """Ask what is put right and do it; then is called with the name of the step that is measured again."""
    unit = bench.training
    if unit is None:
        return
    remedies = unit.remedies(session)

    def do(place: int | None) -> None:
        if place is not None:
            remedy = remedies[place]
            screen.hold(lambda: unit.put_right(session, remedy), lambda _: then(remedy.step), "recording again")

    screen.app.push_screen(Choice("Put something right", _WORDS, [remedy.words for remedy in remedies]), do)
