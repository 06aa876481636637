"""Options of `accept simulate unit`, declared once: names, defaults and help. Light, so that help comes at once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer


@dataclass(frozen=True)
class SimulateOptions:
    """One unit to simulate. effect, experiment, setting: None for none, as typer has lists that may be left out."""

    out: Annotated[Path, typer.Option(help="The unit folder to write.")]
    kind: Annotated[str, typer.Option(help="apa or strut.")] = "strut"
    model: Annotated[str | None, typer.Option(help="Built-in model or TOML file; default: by the kind.")] = None
    serial: Annotated[str | None, typer.Option(help="Serial; else SIM with kind and seed.")] = None
    seed: Annotated[int, typer.Option(min=0, help="Seed; equal seeds give equal bytes.")] = 0
    dx_um: Annotated[float, typer.Option("--dx-um", help="Misalignment along x [um].")] = 0.0
    dy_um: Annotated[float, typer.Option("--dy-um", help="Misalignment along y [um].")] = 0.0
    effect: Annotated[
        list[str] | None, typer.Option(help="For example bench_mode:f_Hz=110,ratio=0.03,damping_ratio=0.01")
    ] = None
    experiment: Annotated[list[str] | None, typer.Option(help="More responses, such as added_mass:mass_kg=0.5")] = None
    setting: Annotated[list[str] | None, typer.Option("--set", help="A parameter, such as joint.kz_N_per_um=80")] = None
    draw: Annotated[bool, typer.Option("--draw", help="Draw every uncertain parameter from its prior.")] = False
    fault: Annotated[str | None, typer.Option(help="What is wrong with it: see `accept simulate faults`.")] = None
    noise: Annotated[float, typer.Option(min=0.0, help="Factor on the usual noise of the sensors.")] = 1.0
    ideal: Annotated[bool, typer.Option("--ideal", help="Converters without steps and ranges.")] = False
    hold: Annotated[bool, typer.Option("--hold", help="Converter that holds each sample, without a filter.")] = False
    low_s: Annotated[float, typer.Option("--low-s", help="Length of the low record [s].")] = 20.0
    high_s: Annotated[float, typer.Option("--high-s", help="Length of the high record [s].")] = 20.0
    repeats: Annotated[bool, typer.Option("--repeats/--no-repeats", help="A second realisation of both.")] = True
