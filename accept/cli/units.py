"""The command lines of `accept demo`, `batch`, `report` and `run`."""

from pathlib import Path
from typing import Annotated

import typer

from accept.cli.options import spread
from accept.commands.bench.run_options import RunOptions
from accept.commands.options import Operator
from accept.commands.units.options import BatchOptions, ReportOptions


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("accept-demo"), operator: Operator = None
) -> None:
    """Run the whole job on built-in data. Judge seven published APAs and a simulated strut, certify, verify."""
    from accept.commands.units import demo as command

    raise typer.Exit(command.run(out, operator))


@spread
def batch(
    units: Annotated[
        list[str], typer.Argument(help="Unit folders, folders that contain them, or their addresses (s3://...).")
    ],
    wanted: BatchOptions,
) -> None:
    """Judge unit folders. Writes results.json, results.csv, junit.xml, certificates; judges only what changed."""
    from accept.commands.units import batch as command

    raise typer.Exit(command.run(units, wanted))


@spread
def report(unit: Annotated[Path, typer.Argument(help="Unit folder.")], wanted: ReportOptions) -> None:
    """Judge one unit and write its signed certificate."""
    from accept.commands.units import report as command

    raise typer.Exit(command.run(unit, wanted))


@spread
def run_workflow(
    wanted: RunOptions,
    web: Annotated[bool, typer.Option("--web", help="Show the screens in a browser (extra `web`).")] = False,
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port for --web, on 127.0.0.1.")] = 8000,
) -> None:
    """Measure a unit step by step, up to the signed certificate."""
    from accept.commands.bench import run as command

    raise typer.Exit(command.serve(wanted, port) if web else command.run(wanted))
