"""`accept run`."""

import os
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from accept.base import loading
from accept.base.console import say
from accept.base.exit_codes import Exit, of_verdicts
from accept.commands.bench import web as browser
from accept.commands.options import BenchPath, SpecName
from accept.tui.app import BenchApp
from accept.tui.screens.start import Given
from specs.files import UNIT_FILE

if TYPE_CHECKING:
    from accept.workflow.bench import Workbench


@dataclass(frozen=True)
class RunOptions:
    """The command line, as typed."""

    unit: Annotated[str | None, Argument(help="Serial or unit folder to continue with.")] = None
    spec: SpecName = None
    bench: BenchPath = None
    records: Annotated[Path | None, Option(help="Folder that new record files arrive in.")] = None
    operator: Annotated[
        str | None, Option(envvar="ACCEPT_OPERATOR", help="Name of the operator; default: who worked here last.")
    ] = None
    training: Annotated[bool, Option("--training", help="A simulated unit with a hidden fault.")] = False
    seed: Annotated[int | None, Option(min=0, help="Seed of the training unit; default: random.")] = None

    def arguments(self) -> list[str]:
        """Return what would be typed to get this."""
        options = {"spec": self.spec, "bench": self.bench, "records": self.records, "operator": self.operator}
        named = options | {"seed": self.seed}
        words = [word for name, value in named.items() if value is not None for word in (f"--{name}", str(value))]
        return [*([self.unit] if self.unit else []), *words, *(["--training"] if self.training else [])]

    @property
    def folder(self) -> Path | None:
        """Return the unit folder that is meant, None for a serial."""
        path = Path(self.unit or "")
        return path if self.unit and ((path / UNIT_FILE).is_file() or len(path.parts) > 1) else None


def run(
    wanted: RunOptions,
    web: Annotated[bool, Option("--web", help="Show the screens in a browser (extra `web`).")] = False,
    port: Annotated[int, Option(min=1, max=65535, help="Port for --web, on 127.0.0.1.")] = 8000,
) -> Exit:
    """Measure a unit step by step, up to the signed certificate."""
    return browser.run(wanted.arguments(), port) if web else show(wanted)


def show(wanted: RunOptions) -> Exit:
    """Show the guided workflow in this terminal; the exit code is that of the units worked on, incomplete if one was
    left open. Raises SystemExit for a fault of the program, whose traceback is above."""
    if not sys.stdin.isatty() and "TEXTUAL_DRIVER" not in os.environ:  # the latter: screens that go to a browser
        say("accept: run shows screens and needs a terminal; without one: accept run --web")
        return Exit.BAD_INPUT
    loading.done()
    app = BenchApp(partial(_open, wanted), Given(wanted.operator or "", "" if wanted.folder else wanted.unit or ""))
    try:
        app.run()
    finally:
        app.close_unit()
        if app.bench is not None:
            app.bench.close()
    for serial, word in app.done.words.items():
        say(f"{serial}: {word}")
    if app.return_code:
        say("accept: internal error; every saved entry is kept. Please report the lines above")
        raise SystemExit(app.return_code)
    return of_verdicts(app.done.verdicts.values()) if app.done.verdicts else Exit.INCOMPLETE


def _open(wanted: RunOptions) -> "Workbench":
    """Open the bench; this imports the physics, which takes longer than the first screen may."""
    if wanted.training:
        from accept.workflow.training import open_training

        return open_training(wanted.spec, wanted.seed)
    from accept.workflow.open_bench import open_bench

    return open_bench(wanted.spec, wanted.records, wanted.bench, wanted.folder)
