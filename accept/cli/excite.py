"""`accept excite`: thin."""

import typer

from accept.cli.options import spread
from accept.commands.physics.excite_options import (
    MultisineOptions,
    NoiseOptions,
    Playing,
    Shaping,
    SineOptions,
    SweepOptions,
)

app = typer.Typer(help="Excitation signals for the rig, as .mat or .csv.", no_args_is_help=True)


@app.command()
@spread
def sweep(wanted: SweepOptions, shaping: Shaping, playing: Playing) -> None:
    """A sine of rising frequency."""
    from accept.commands.physics import excite as command

    raise typer.Exit(command.sweep(wanted, shaping, playing))


@app.command()
@spread
def noise(wanted: NoiseOptions, shaping: Shaping, playing: Playing) -> None:
    """Noise in a band."""
    from accept.commands.physics import excite as command

    raise typer.Exit(command.noise(wanted, shaping, playing))


@app.command()
@spread
def sine(wanted: SineOptions, playing: Playing) -> None:
    """Slow sines of growing amplitude, for the hysteresis."""
    from accept.commands.physics import excite as command

    raise typer.Exit(command.sine(wanted, playing))


@app.command()
@spread
def multisine(wanted: MultisineOptions, shaping: Shaping, playing: Playing) -> None:
    """A random-phase multisine. Periodic, so without leakage: the best of the four."""
    from accept.commands.physics import excite as command

    raise typer.Exit(command.multisine(wanted, shaping, playing))
