"""Training: what is put right at the bench, after which the records are made anew."""

from collections.abc import Callable

from accept.tui.background.scanning import Scanning
from accept.tui.screens.ask import Choice

_WORDS = "What do you do at the bench? The simulated rig then records that step again."


def ask_remedy(screen: Scanning, then: Callable[[str], None]) -> None:
    """Ask what is put right and do it; then is called with the name of the step that is measured again."""
    unit, session = screen.bench.training, screen.session
    if unit is None:
        return
    remedies = unit.remedies(session)

    def do(place: int | None) -> None:
        if place is not None:
            remedy = remedies[place]
            screen.hold(lambda: unit.put_right(session, remedy), lambda _: then(remedy.step), "recording again")

    screen.app.push_screen(Choice("Repair (training)", _WORDS, [remedy.words for remedy in remedies]), do)
