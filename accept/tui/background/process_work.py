"""Work of a screen in the other process: with a clock, its progress, and Escape to stop it."""

from collections.abc import Callable
from typing import Any

from accept.tui.background.busy_screen import Then, Working
from accept.workflow.bench import Workbench
from accept.workflow.ports import Computation
from accept.workflow.session import Session


def send_to_worker(
    screen: Working[Any],
    bench: Workbench,
    session: Session,
    work: Callable[[Computation], Any],
    then: Then,
    doing: str,
    failed: Then,
) -> None:
    """Send work on a unit as `Working.send` does; until it has ended, `screen.stop` stops it."""
    computation = bench.services.computation(session, lambda words: setattr(screen, "progress", words))
    screen.stop = computation.cancel

    def ended(go_on: Then) -> Then:
        def end(what: Any) -> None:
            screen.stop = None
            go_on(what)

        return end

    screen.send(lambda: work(computation), ended(then), doing, ended(failed))
