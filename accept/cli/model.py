"""`accept model`: thin."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="The simulated strut: modes, responses, fit.", no_args_is_help=True)

ModelOption = Annotated[str, typer.Option("--model", help="Built-in model or TOML file.")]
Json = Annotated[Path | None, typer.Option("--json", help="JSON file to write.")]
Plot = Annotated[Path | None, typer.Option("--plot", help="Picture to write: .pdf, .png or .svg.")]


@app.command("list")
def list_() -> None:
    """The models that come with the program."""
    from specs.model import builtin_models

    for name in builtin_models():
        print(name)


@app.command()
def show(model: ModelOption = "strut") -> None:
    """Every parameter with its value, unit and prior."""
    from accept.commands.physics import model as command

    raise typer.Exit(command.show(model))


@app.command()
def modes(
    model: ModelOption = "strut",
    f_max: Annotated[float, typer.Option("--f-max", help="Highest frequency listed [Hz].")] = 2000.0,
    clamped: Annotated[bool, typer.Option("--clamped", help="With the payload held: the spurious modes.")] = False,
    json: Json = None,
) -> None:
    """Poles, and the zeros of Vs, de and da, with their damping."""
    from accept.commands.physics import model as command

    raise typer.Exit(command.modes(model, f_max, clamped, json))


@app.command()
def frf(
    model: ModelOption = "strut",
    f_lo: Annotated[float, typer.Option("--f-lo", help="First frequency [Hz].")] = 10.0,
    f_hi: Annotated[float, typer.Option("--f-hi", help="Last frequency [Hz].")] = 2000.0,
    points: Annotated[int, typer.Option(help="Frequencies, evenly over log f.")] = 1000,
    json: Json = None,
    csv: Annotated[Path | None, typer.Option("--csv", help="CSV file to write.")] = None,
    plot: Plot = None,
) -> None:
    """Responses of Vs, de and da to Va. JSON on stdout where no file is named."""
    from accept.commands.physics import model as command

    raise typer.Exit(command.frf(model, f_lo, f_hi, points, json, csv, plot))


@app.command()
def fit(
    unit: Annotated[Path, typer.Argument(help="Unit folder with a section [frf].")],
    model: Annotated[str | None, typer.Option("--model", help="Model to start from; else the kind picks.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for model.toml, fit.pdf and fit.json.")] = None,
    write: Annotated[Path | None, typer.Option(help="The fitted model as a file.")] = None,
    plot: Plot = None,
    json: Json = None,
    f_lo: Annotated[float, typer.Option("--f-lo", help="First frequency fitted [Hz].")] = 10.0,
    f_hi: Annotated[float, typer.Option("--f-hi", help="Last frequency fitted [Hz].")] = 2000.0,
    starts: Annotated[int, typer.Option(min=1, help="Starts of the search.")] = 3,
) -> None:
    """Fit uncertain parameters to a unit's responses."""
    from accept.commands.physics import model_fit as command

    raise typer.Exit(command.run(unit, model, f_lo, f_hi, starts, command.FitOutputs(write, plot, json, out)))


@app.command()
def learn(
    units: Annotated[list[Path], typer.Argument(help="Unit folders of one batch, three or more.")],
    out: Annotated[Path, typer.Option(help="Folder for population.toml, population.pdf and population.json.")],
    model: Annotated[str | None, typer.Option("--model", help="Model to start from; else the kind picks.")] = None,
) -> None:
    """Learn a model from a batch. Its mean, its scatter, and which units do not belong."""
    from accept.commands.physics import model_learn as command

    raise typer.Exit(command.run(units, model, out))


@app.command()
def sweep(
    what: Annotated[str, typer.Argument(help="dy, dx, dz, kz, kR, cR, or a parameter's name.")],
    values: Annotated[list[float] | None, typer.Option("--value", help="A value; repeat for more.")] = None,
    channel: Annotated[str, typer.Option(help="Vs, de or da.")] = "de",
    model: ModelOption = "strut",
    f_hi: Annotated[float, typer.Option("--f-hi", help="Last frequency [Hz].")] = 800.0,
    json: Json = None,
    plot: Plot = None,
) -> None:
    """Poles and zeros over a row of values. Without --value the published ones."""
    from accept.commands.physics import model as command

    raise typer.Exit(command.run_sweep(model, what, values or (), channel, f_hi, json, plot))
