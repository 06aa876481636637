"""`accept run`."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from accept.commands.talk import clear_errors, operator_name, say
from accept.exit import Exit, of_verdicts
from accept.tui.app import BenchApp
from accept.tui.start import Given

if TYPE_CHECKING:
    from accept.workflow.bench import Bench


@clear_errors
def run(unit: str | None, spec: str | None, records: Path | None, operator: str | None) -> Exit:
    """The guided workflow; the exit code is that of the units worked on, incomplete when one was left open."""
    app = BenchApp(_loader(spec, records), Given(operator_name(operator), unit or ""))
    app.run()
    app.close_unit()
    for serial, verdict in app.done.verdicts.items():
        say(f"{serial}: {verdict}")
    return of_verdicts(app.done.verdicts.values()) if app.done.verdicts else Exit.INCOMPLETE


def _loader(spec: str | None, records: Path | None) -> "Callable[[], Bench]":
    def load() -> "Bench":
        from accept.workflow.bench import open_bench  # loads the physics: after the first screen

        return open_bench(spec, records)

    return load
