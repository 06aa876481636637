"""The commands: thin. Each imports what it runs, and only the one that is asked for is loaded, so that it starts at
once; all of them where help or completion is asked for."""

import sys
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from typing import Annotated, Any

import typer

from accept.base import loading
from accept.base.crash_hooks import log_crashes
from accept.base.exit_codes import Exit

# Name -> where its function stands, or its group of commands; in this order they stand in the help, what most come for
# first.
COMMANDS = {
    "demo": "units.demo",
    "batch": "units.batch",
    "report": "units.report",
    "countersign": "certificates.countersign",
    "verify": "certificates.verify",
    "run": "units.run_workflow",
    "gap": "responses.gap",
    "misalign": "responses.misalign",
    "frf": "responses.frf",
    "compare": "responses.compare",
    "list": "fleet.list_units",
    "history": "fleet.history",
    "yield": "fleet.first_pass",
    "trend": "fleet.trend",
    "rejudge": "fleet.rejudge",
    "recall": "hw.recall",
    "match": "fleet.match",
    "rr": "fleet.gauge_study",
    "site": "fleet.site",
    "spec": "spec.app",
    "keys": "keys.app",
    "store": "store.app",
    "excite": "excite.app",
    "model": "model.app",
    "lookup": "responses.lookup_app",
    "simulate": "hw.simulate_app",
    "hw": "hw.app",
    "golden": "fleet.golden_app",
}


def _show_version(wanted: bool) -> None:
    if wanted:
        from accept.base.version import code_sha256, version

        print(f"accept {version()}, code {code_sha256()[:12]}")
        raise typer.Exit


def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Version and hash of the code.")
    ] = False,
) -> None:
    """The acceptance bench for piezo struts: judge units against a written spec, certify them, verify them."""


def _app_of(names: Iterable[str]) -> typer.Typer:
    """The program with these commands."""
    program = typer.Typer(
        name="accept",
        help="The acceptance bench for piezo struts: judge units against a written spec, certify them, verify them.",
        no_args_is_help=True,
        context_settings={"help_option_names": ["-h", "--help"]},
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    program.callback()(options)
    for name in names:
        module, _, attribute = COMMANDS[name].partition(".")
        command = getattr(import_module(f"accept.cli.{module}"), attribute)
        if isinstance(command, typer.Typer):
            program.add_typer(command, name=name)
        else:
            program.command(name)(command)
    return program


@cache
def _whole() -> typer.Typer:
    return _app_of(COMMANDS)


def __getattr__(name: str) -> Any:
    """`app`: the program with all its commands."""
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _whole()


def main() -> None:
    """Entry point. A pipe closed by its reader (`accept ... | head`) is no crash."""
    loading.begin()
    log_crashes()
    asked = sys.argv[1] if len(sys.argv) > 1 else ""
    try:
        (_app_of([asked]) if asked in COMMANDS else _whole())()
    except BrokenPipeError:
        raise SystemExit(Exit.BAD_INPUT) from None
