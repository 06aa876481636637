"""The command lines of `accept history`, `list`, `yield`, `trend`, `rr`, `golden`, `rejudge` and `match`."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

golden_app = typer.Typer(help="Golden units, for whether the bench measures as before.", no_args_is_help=True)

Json = Annotated[Path | None, typer.Option("--json", help="The rows as JSON, to this file.")]
Csv = Annotated[Path | None, typer.Option("--csv", help="The rows as CSV, to this file.")]
Since = Annotated[str | None, typer.Option(help="First day (2026-10-05) or month (2026-10), UTC.")]
Until = Annotated[str | None, typer.Option(help="Last day or month, UTC.")]
Operator = Annotated[str | None, typer.Option(envvar="ACCEPT_OPERATOR", help="Who is at the bench.")]


class Kind(StrEnum):
    """Kinds of units."""

    APA = "apa"
    STRUT = "strut"


class By(StrEnum):
    """What units are grouped by."""

    MONTH = "month"
    BENCH = "bench"
    OPERATOR = "operator"
    KIND = "kind"
    SPEC = "spec"


class TrendBy(StrEnum):
    """What a trend runs along."""

    ALL = "all"
    BENCH = "bench"
    OPERATOR = "operator"
    KIND = "kind"
    SPEC = "spec"


class Expected(StrEnum):
    """What a unit is compared with."""

    ACCEPTED = "accepted"
    REJECTED = "rejected"


OfKind = Annotated[Kind | None, typer.Option("--kind", help="Only units of this kind.")]


def history(
    serial: Annotated[str, typer.Argument(help="Serial of a unit.")], json: Json = None, csv: Csv = None
) -> None:
    """Every attempt of a unit. Its values with U, and what changed by more than the uncertainties allow."""
    from accept.commands.fleet import questions
    from accept.commands.fleet.tables import Outputs

    raise typer.Exit(questions.history(serial, Outputs(json, csv)))


def list_units(
    failed: Annotated[bool, typer.Option("--failed", help="Only units that are not accepted.")] = False,
    verdict: Annotated[str | None, typer.Option(help="Only this verdict.")] = None,
    check: Annotated[str | None, typer.Option(help="Only where this check or quantity did not pass.")] = None,
    every: Annotated[bool, typer.Option("--all-attempts", help="Every judgement, not the last of each unit.")] = False,
    since: Since = None,
    until: Until = None,
    kind: OfKind = None,
    json: Json = None,
    csv: Csv = None,
) -> None:
    """Units in the store. With their last verdict and what stopped them."""
    from accept.commands.fleet import questions
    from accept.commands.fleet.tables import Outputs

    choice = questions.Choice(since, until, kind)
    raise typer.Exit(questions.units(choice, "failed" if failed else verdict, check, every, Outputs(json, csv)))


def first_pass(
    by: Annotated[By, typer.Option(help="Groups.")] = By.MONTH,
    since: Since = None,
    until: Until = None,
    kind: OfKind = None,
    json: Json = None,
    csv: Csv = None,
) -> None:
    """First-pass yield. With its interval, and the causes that stopped the others, the most frequent first."""
    from accept.commands.fleet import questions
    from accept.commands.fleet.tables import Outputs

    raise typer.Exit(questions.first_pass(questions.Choice(since, until, kind), by.value, Outputs(json, csv)))


def trend(
    quantity: Annotated[str, typer.Argument(help="Name of a quantity, such as stroke_um.")],
    by: Annotated[TrendBy, typer.Option(help="A chart for each of these.")] = TrendBy.ALL,
    since: Since = None,
    until: Until = None,
    kind: OfKind = None,
    plot: Annotated[Path | None, typer.Option(help="Picture: .png, .pdf or .svg.")] = None,
    json: Json = None,
    csv: Csv = None,
) -> None:
    """A quantity over time. Control charts with Nelson's rules and EWMA, capability; exit 4 where an alarm rings."""
    from accept.commands.fleet import questions
    from accept.commands.fleet.tables import Outputs

    choice = questions.Choice(since, until, kind)
    raise typer.Exit(questions.trend(quantity, choice, by.value, plot, Outputs(json, csv)))


def gauge_study(
    table: Annotated[Path | None, typer.Argument(help="CSV file with columns part, operator, value.")] = None,
    quantity: Annotated[str | None, typer.Option(help="Instead: repeated judgements of this quantity.")] = None,
    tolerance: Annotated[float | None, typer.Option(min=0.0, help="Distance between the limits.")] = None,
    since: Since = None,
    until: Until = None,
    kind: OfKind = None,
    json: Json = None,
    csv: Csv = None,
) -> None:
    """Gauge repeatability and reproducibility. Crossed study by analysis of variance; states the U for a spec."""
    from accept.commands.fleet import bench_health
    from accept.commands.fleet.questions import Choice
    from accept.commands.fleet.tables import Outputs

    choice = Choice(since, until, kind)
    raise typer.Exit(bench_health.gauge_study(table, quantity, choice, tolerance, Outputs(json, csv)))


@golden_app.command("name")
def golden_name(
    serial: Annotated[str, typer.Argument(help="Serial of a judged unit.")],
    expect: Annotated[Expected, typer.Option(help="What it must always be.")] = Expected.ACCEPTED,
    operator: Operator = None,
) -> None:
    """Make a judged unit a golden one."""
    from accept.commands.fleet import bench_health

    raise typer.Exit(bench_health.golden_name(serial, expect.value, operator))


@golden_app.command("check")
def golden_check(
    hours: Annotated[float, typer.Option(min=0.1, help="How long ago the shift began [h].")] = 12.0,
    operator: Operator = None,
) -> None:
    """Compare golden units with their history. Exit 3 where one is missed: the bench then judges nothing."""
    from accept.commands.fleet import bench_health

    raise typer.Exit(bench_health.golden_check(hours, operator))


@golden_app.command("resolve")
def golden_resolve(
    reason: Annotated[str, typer.Option(help="What was wrong and what was done.")], operator: Operator = None
) -> None:
    """Let a stopped bench judge again."""
    from accept.commands.fleet import bench_health

    raise typer.Exit(bench_health.golden_resolve(reason, operator))


def rejudge(
    spec: Annotated[list[str], typer.Option("--spec", help="Built-in spec or TOML file; one of each kind.")],
    records: Annotated[bool, typer.Option("--records", help="Measure unit folders again where unchanged.")] = False,
    json: Json = None,
    csv: Csv = None,
) -> None:
    """The whole store under another spec. Which verdicts flip and why; nothing is stored, no certificate is touched."""
    from accept.commands.fleet import selection
    from accept.commands.fleet.tables import Outputs

    raise typer.Exit(selection.rejudge(spec, records, Outputs(json, csv)))


def match(
    n: Annotated[int, typer.Option("--n", min=2, help="Units of a set.")] = 6,
    sets: Annotated[int, typer.Option(min=1, help="Disjoint sets.")] = 1,
    kind: Annotated[Kind, typer.Option(help="Kind of unit.")] = Kind.STRUT,
    by: Annotated[list[str] | None, typer.Option(help="Quantities that should agree; repeat the option.")] = None,
    json: Json = None,
    csv: Csv = None,
) -> None:
    """Units that fit together. Sets whose quantities lie closest, in units of their uncertainty; proven best."""
    from accept.commands.fleet import selection
    from accept.commands.fleet.tables import Outputs

    raise typer.Exit(selection.match(kind.value, n, sets, by or (), Outputs(json, csv)))


def site(
    out: Annotated[Path, typer.Option(help="Folder for the page.")],
    units: Annotated[list[Path] | None, typer.Option(help="Unit folders whose curves are shown; repeat.")] = None,
) -> None:
    """A page of the fleet. Yield, causes, trends, curves and every unit's findings; opens from a file, offline."""
    from accept.commands.fleet import site as command

    raise typer.Exit(command.run(out, units or ()))
