"""Work of a screen in the other process: with a clock, its progress, and Escape to stop it."""

from collections.abc import Callable
from typing import Any

from accept.tui.background.busy_screen import Then, Working
from accept.workflow.worker.judging import Elsewhere
from accept.workflow.worker.process import WorkerProcess


def send_to_worker(
    screen: Working[Any], worker: WorkerProcess, work: Callable[[Elsewhere], Any], then: Then, doing: str, failed: Then
) -> None:
    """Send work as `Working.send` does; until it has ended, `screen.stop` stops it."""
    elsewhere = Elsewhere(worker, lambda words: setattr(screen, "progress", words))
    screen.stop = elsewhere.cancel

    def ended(go_on: Then) -> Then:
        def end(what: Any) -> None:
            screen.stop = None
            go_on(what)

        return end

    screen.send(lambda: work(elsewhere), ended(then), doing, ended(failed))
