"""`accept simulate`: thin."""

import typer

from accept.cli.options import spread
from accept.commands.bench.simulate_options import SimulateOptions

app = typer.Typer(help="Simulated units and a simulated bench.", no_args_is_help=True)


@app.command()
@spread
def unit(wanted: SimulateOptions) -> None:
    """A whole unit folder from a model. With the truth beside it in truth.json."""
    from accept.commands.bench import simulate as command

    raise typer.Exit(command.unit(wanted))


@app.command()
def faults() -> None:
    """What can be wrong with a simulated unit. And what the bench then says."""
    from accept.commands.bench import simulate as command

    raise typer.Exit(command.faults())
