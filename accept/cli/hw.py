"""`accept hw`, `accept recall` and `accept simulate`: thin."""

import datetime
from pathlib import Path
from typing import Annotated

import typer

from accept.cli.options import spread
from accept.commands.bench.simulate_options import SimulateOptions

app = typer.Typer(help="Instruments on the bench.", no_args_is_help=True)
simulate_app = typer.Typer(help="Simulated units and a simulated bench.", no_args_is_help=True)

Bench = Annotated[Path | None, typer.Option("--bench", help="Bench file; default: bench.toml in ACCEPT_HOME.")]
Operator = Annotated[str | None, typer.Option(envvar="ACCEPT_OPERATOR", help="Who measures.")]


@app.command("list")
def hw_list(bench: Bench = None) -> None:
    """Instruments of the bench file. With port and calibration, and the serial ports that are there."""
    from accept.commands.bench import hw as command

    raise typer.Exit(command.show_list(bench))


@app.command("scan")
def hw_scan(
    resource: Annotated[list[str] | None, typer.Option(help="VISA name of an instrument to ask, too.")] = None,
) -> None:
    """Which ports and VISA instruments are there. Proposes a bench file; serial ports are only listened to."""
    from accept.commands.bench import scan as command

    raise typer.Exit(command.scan(resource or ()))


@app.command("test")
def hw_test(
    names: Annotated[list[str] | None, typer.Argument(help="Names of instruments; default: all.")] = None,
    bench: Bench = None,
) -> None:
    """Ask every instrument for one reading. Exit 5 with the reason where one does not answer as it should."""
    from accept.commands.bench import hw as command

    raise typer.Exit(command.test(bench, names or []))


@app.command("commission")
def hw_commission(
    name: Annotated[str, typer.Argument(help="The instrument's name in the bench file.")],
    bench: Bench = None,
    operator: Operator = None,
) -> None:
    """First run at a real instrument. Asks for changes at its panel, writes a signed record beside the bench file."""
    from accept.commands.bench import commission as command

    raise typer.Exit(command.commission(bench, name, operator))


@app.command("measure")
def hw_measure(
    unit: Annotated[Path, typer.Argument(help="Unit folder.")],
    section: Annotated[str, typer.Argument(help="flatness, capacitance, stroke or stiffness.")],
    bench: Bench = None,
    begin: Annotated[str | None, typer.Option(help="Serial of a new APA: makes its folder.")] = None,
    dwell: Annotated[
        float | None, typer.Option(min=0.1, help="Time per step if the rig drives the voltage [s].")
    ] = None,
    operator: Operator = None,
) -> None:
    """Measure a section of a unit with its instrument."""
    from accept.commands.bench import hw as command

    raise typer.Exit(command.measure(unit, section, bench, begin, dwell, operator))


@app.command("pickup")
def hw_pickup(
    watched: Annotated[Path, typer.Argument(help="Folder into which the rig writes its records.")],
    unit: Annotated[Path, typer.Argument(help="Unit folder.")],
    section: Annotated[str, typer.Argument(help="Section of unit.toml, such as frf.")],
    name: Annotated[str, typer.Argument(help="The record's name there, such as low.")],
    wait: Annotated[float, typer.Option(min=0.0, help="How long to wait for it [s].")] = 600.0,
    old: Annotated[bool, typer.Option("--old", help="Also take a record that is there already.")] = False,
    operator: Operator = None,
) -> None:
    """Copy the rig's next record into a unit folder. Once it is complete; the original stays untouched."""
    from accept.commands.bench import hw as command

    raise typer.Exit(command.pickup(watched, unit, section, name, wait, old, operator))


@simulate_app.command("bench")
def simulate_bench(
    unit: Annotated[Path, typer.Option(help="Unit folder whose values the instruments measure.")],
    out: Annotated[Path | None, typer.Option(help="Folder for ports and bench.toml; else a temporary one.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the noise.")] = 0,
    seconds: Annotated[float | None, typer.Option(min=0.0, help="End by itself after so long [s].")] = None,
    fault: Annotated[
        list[str] | None, typer.Option(help="As gauge:menu_open, lcr:half_line:3 (replies later), gauge:swapped:probe.")
    ] = None,
) -> None:
    """Simulated instruments on pseudo-terminals. Prints the ports and a ready bench.toml, runs until stopped."""
    from accept.commands.bench import simulate_bench as command

    raise typer.Exit(command.run(unit, out, seed, seconds, fault or ()))


def recall(
    instrument: Annotated[str, typer.Option(help="Serial number of the instrument.")],
    since: Annotated[
        datetime.datetime, typer.Option(formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="First day, UTC.")
    ],
) -> None:
    """List the units measured with an instrument. From the event store."""
    from accept.commands.trust import recall as command

    raise typer.Exit(command.run(instrument, since.date()))


@simulate_app.command()
@spread
def unit(wanted: SimulateOptions) -> None:
    """A whole unit folder from a model. With the truth beside it in truth.json."""
    from accept.commands.bench import simulate as command

    raise typer.Exit(command.unit(wanted))


@simulate_app.command()
def faults() -> None:
    """What can be wrong with a simulated unit. And what the bench then says."""
    from accept.commands.bench import simulate as command

    raise typer.Exit(command.faults())
