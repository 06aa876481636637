"""`accept simulate`: thin."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="Simulated units and a simulated bench.", no_args_is_help=True)


@app.command()
def unit(
    out: Annotated[Path, typer.Option(help="The unit folder to write.")],
    kind: Annotated[str, typer.Option(help="apa or strut.")] = "strut",
    model: Annotated[str | None, typer.Option(help="Built-in model or TOML file; else the kind picks.")] = None,
    serial: Annotated[str | None, typer.Option(help="Serial; else SIM with kind and seed.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of all that is random; equal seeds give equal bytes.")] = 0,
    dx_um: Annotated[float, typer.Option("--dx-um", help="Misalignment along x [um].")] = 0.0,
    dy_um: Annotated[float, typer.Option("--dy-um", help="Misalignment along y [um].")] = 0.0,
    effect: Annotated[
        list[str] | None, typer.Option(help="As bench_mode:f_Hz=110,ratio=0.03,damping_ratio=0.01")
    ] = None,
    setting: Annotated[list[str] | None, typer.Option("--set", help="A parameter, as joint.kz_N_per_um=80")] = None,
    draw: Annotated[bool, typer.Option("--draw", help="Draw every uncertain parameter from its prior.")] = False,
    fault: Annotated[str | None, typer.Option(help="What is wrong with it: see `accept simulate faults`.")] = None,
    noise: Annotated[float, typer.Option(min=0.0, help="Times the usual noise of the sensors.")] = 1.0,
    ideal: Annotated[bool, typer.Option("--ideal", help="Converters without steps and ranges.")] = False,
    hold: Annotated[bool, typer.Option("--hold", help="Converter that holds each sample, without a filter.")] = False,
    low_s: Annotated[float, typer.Option("--low-s", help="Length of the low record [s].")] = 20.0,
    high_s: Annotated[float, typer.Option("--high-s", help="Length of the high record [s].")] = 20.0,
    repeats: Annotated[bool, typer.Option("--repeats/--no-repeats", help="A second realisation of both.")] = True,
) -> None:
    """A whole unit folder from a model. With the truth beside it in truth.json."""
    from accept.commands.bench import simulate as command

    wanted = command.SimulateOptions(
        kind=kind, model=model, serial=serial, seed=seed, dx_um=dx_um, dy_um=dy_um, effects=tuple(effect or ()),
        settings=tuple(setting or ()), draw=draw, fault=fault, noise=noise, ideal=ideal, hold=hold, low_s=low_s,
        high_s=high_s, repeats=repeats,
    )  # fmt: skip
    raise typer.Exit(command.unit(wanted, out))


@app.command()
def faults() -> None:
    """What can be wrong with a simulated unit. And what the bench then says."""
    from accept.commands.bench import simulate as command

    raise typer.Exit(command.faults())
