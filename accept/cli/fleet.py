"""The command lines of `accept history`, `list`, `yield`, `trend`, `rr`, `golden`, `rejudge` and `match`."""

from pathlib import Path
from typing import Annotated

import typer

from accept.cli.options import spread
from accept.commands.fleet.options import (
    By,
    Choice,
    ExpectedGolden,
    GaugeOptions,
    ListOptions,
    MatchOptions,
    Outputs,
    TrendBy,
)
from accept.commands.options import ClusterAt, Plot

golden_app = typer.Typer(help="Golden units: does the bench measure as before?", no_args_is_help=True)

AtTheBench = Annotated[str | None, typer.Option(envvar="ACCEPT_OPERATOR", help="Who is at the bench.")]


@spread
def history(
    serial: Annotated[str, typer.Argument(help="Serial of a unit.")], *, plot: Plot = None, outputs: Outputs
) -> None:
    """Show every attempt of a unit. Its values with U, and what changed by more than the uncertainties allow."""
    from accept.commands.fleet import questions

    raise typer.Exit(questions.history(serial, plot, outputs))


@spread
def list_units(wanted: ListOptions, choice: Choice, outputs: Outputs) -> None:
    """List the units in the store. With their last verdict and what stopped them."""
    from accept.commands.fleet import questions

    raise typer.Exit(questions.units(wanted, choice, outputs))


@spread
def first_pass(
    *,
    by: Annotated[By, typer.Option(help="Groups.")] = By.MONTH,
    choice: Choice,
    plot: Plot = None,
    outputs: Outputs,
) -> None:
    """Show the first-pass yield. With its interval, and the causes that stopped the others, the most frequent first."""
    from accept.commands.fleet import questions

    raise typer.Exit(questions.first_pass(by, plot, choice, outputs))


@spread
def trend(
    quantity: Annotated[str, typer.Argument(help="Name of a quantity, such as stroke_um.")],
    *,
    by: Annotated[TrendBy, typer.Option(help="A chart for each of these.")] = TrendBy.ALL,
    choice: Choice,
    plot: Plot = None,
    outputs: Outputs,
) -> None:
    """Show a quantity over time. Control charts with Nelson's rules and EWMA, capability; exit 4 at an alarm."""
    from accept.commands.fleet import questions

    raise typer.Exit(questions.trend(quantity, by, plot, choice, outputs))


@spread
def gauge_study(
    wanted: GaugeOptions,
    choice: Choice,
    outputs: Outputs,
    table: Annotated[Path | None, typer.Argument(help="CSV file with columns part, operator, value.")] = None,
) -> None:
    """Evaluate a gauge study. Repeatability and reproducibility by analysis of variance; states the U for a spec."""
    from accept.commands.fleet import bench_health

    raise typer.Exit(bench_health.gauge_study(table, wanted, choice, outputs))


@golden_app.command("name")
def golden_name(
    serial: Annotated[str, typer.Argument(help="Serial of a judged unit.")],
    expect: Annotated[ExpectedGolden, typer.Option(help="What it must always be.")] = ExpectedGolden.ACCEPTED,
    operator: AtTheBench = None,
) -> None:
    """Make a judged unit a golden one."""
    from accept.commands.fleet import bench_health

    raise typer.Exit(bench_health.golden_name(serial, expect.value, operator))


@golden_app.command("check")
def golden_check(
    hours: Annotated[float, typer.Option(min=0.1, help="How long ago the shift began [h].")] = 12.0,
    operator: AtTheBench = None,
) -> None:
    """Compare golden units with their history. Exit 3 where one is missed: the bench then judges nothing."""
    from accept.commands.fleet import bench_health

    raise typer.Exit(bench_health.golden_check(hours, operator))


@golden_app.command("resolve")
def golden_resolve(
    reason: Annotated[str, typer.Option(help="What was wrong and what was done.")], operator: AtTheBench = None
) -> None:
    """Let a stopped bench judge again."""
    from accept.commands.fleet import bench_health

    raise typer.Exit(bench_health.golden_resolve(reason, operator))


@spread
def rejudge(
    spec: Annotated[list[str], typer.Option("--spec", help="Built-in spec or TOML file; one of each kind.")],
    *,
    records: Annotated[bool, typer.Option("--records", help="Measure unit folders again where unchanged.")] = False,
    cluster: ClusterAt = None,
    outputs: Outputs,
) -> None:
    """Judge the whole store by another spec. Which verdicts flip and why; stores nothing, touches no certificate."""
    from accept.commands.fleet import selection

    raise typer.Exit(selection.rejudge(spec, records, outputs, cluster))


@spread
def match(wanted: MatchOptions, outputs: Outputs) -> None:
    """Find units that fit together. Sets whose quantities lie closest, in units of their uncertainty; proven best."""
    from accept.commands.fleet import selection

    raise typer.Exit(selection.match(wanted, outputs))


def site(
    out: Annotated[Path, typer.Option(help="Folder for the page.")],
    units: Annotated[list[Path] | None, typer.Option(help="Unit folders whose curves are shown; repeat.")] = None,
) -> None:
    """Write a page of the fleet. Yield, causes, trends, curves and every unit's findings; opens offline."""
    from accept.commands.fleet import site as command

    raise typer.Exit(command.run(out, units or ()))
