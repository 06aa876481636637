"""`accept model`: thin."""

from pathlib import Path
from typing import Annotated

import typer

from accept.cli.options import spread
from accept.commands.options import ModelName, StartModelName
from accept.commands.physics.model_options import (
    FitOptions,
    FitOutputs,
    FrfOptions,
    ModesOptions,
    ParameterSweepOptions,
)

app = typer.Typer(help="The simulated strut: modes, responses, fit.", no_args_is_help=True)


@app.command("list")
def list_() -> None:
    """The models that come with the program, and what each is."""
    import textwrap

    from specs.model import builtin_models

    for name, path in builtin_models().items():
        about = path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
        print(*textwrap.wrap(f"{name:<14}  {about}", 80, subsequent_indent=" " * 16), sep="\n")


@app.command()
def effects() -> None:
    """Effects that `accept gap` can name as missing. Where each shows, and the measurement that shows it alone."""
    from accept.commands.physics import effects as command

    raise typer.Exit(command.run())


@app.command()
def show(model: ModelName = "strut") -> None:
    """Every parameter with its value, unit and prior."""
    from accept.commands.physics import model as command

    raise typer.Exit(command.show(model))


@app.command()
@spread
def modes(wanted: ModesOptions) -> None:
    """Poles, and the zeros of Vs, de and da, with their damping."""
    from accept.commands.physics import model as command

    raise typer.Exit(command.modes(wanted))


@app.command()
@spread
def frf(wanted: FrfOptions) -> None:
    """Responses of Vs, de and da to Va. JSON on stdout where no file is named."""
    from accept.commands.physics import model as command

    raise typer.Exit(command.frf(wanted))


@app.command()
@spread
def fit(
    unit: Annotated[Path, typer.Argument(help="Unit folder with a section [frf].")],
    wanted: FitOptions,
    outputs: FitOutputs,
) -> None:
    """Fit uncertain parameters to a unit's responses."""
    from accept.commands.physics import model_fit as command

    raise typer.Exit(command.run(unit, wanted, outputs))


@app.command()
def learn(
    units: Annotated[list[Path], typer.Argument(help="Unit folders of one batch, three or more.")],
    out: Annotated[Path, typer.Option(help="Folder for population.toml, population.pdf and population.json.")],
    model: StartModelName = None,
) -> None:
    """Learn a model from a batch. Its mean, its scatter, and which units do not belong."""
    from accept.commands.physics import model_learn as command

    raise typer.Exit(command.run(units, model, out))


@app.command()
@spread
def sweep(
    what: Annotated[str, typer.Argument(help="dy, dx, dz, kz, kR, cR, or a parameter's name.")],
    wanted: ParameterSweepOptions,
) -> None:
    """Poles and zeros over a row of values. Without --value the published ones."""
    from accept.commands.physics import model as command

    raise typer.Exit(command.run_sweep(what, wanted))
