"""Options of the questions about many units, declared once. Light, so that help comes at once."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

from typer import Option

from accept.commands.options import Csv, Json, installed

ListedVerdict = StrEnum("ListedVerdict", "ACCEPTED CONDITIONAL REJECTED INCOMPLETE VOIDED")
ExpectedGolden = StrEnum("ExpectedGolden", "ACCEPTED REJECTED")
By = StrEnum("By", "MONTH WEEK DAY BENCH OPERATOR LOT SUPPLIER ORDER SHIFT KIND SPEC")  # the groups of units
TrendBy = StrEnum("TrendBy", "ALL BENCH OPERATOR LOT SUPPLIER ORDER SHIFT KIND SPEC")


@dataclass(frozen=True)
class JudgementFilter:
    """Which judgements are asked about."""

    since: Annotated[str | None, Option(help="First day (2026-10-05) or month (2026-10), UTC.")] = None
    until: Annotated[str | None, Option(help="Last day or month, UTC.")] = None
    kind: Annotated[str | None, Option("--kind", help="Only units of this product.", callback=installed)] = None


@dataclass(frozen=True)
class Outputs:
    """Files to write, with the rows that are printed."""

    json: Json = None
    csv: Csv = None


@dataclass(frozen=True)
class ListOptions:
    """Which of the chosen judgements are listed."""

    failed: Annotated[bool, Option("--failed", help="Only units that are not accepted.")] = False
    verdict: Annotated[ListedVerdict | None, Option(help="Only this verdict.")] = None
    check: Annotated[str | None, Option(help="Only where this check or quantity did not pass.")] = None
    all_attempts: Annotated[bool, Option("--all-attempts", help="Every judgement, not the last of each unit.")] = False


@dataclass(frozen=True)
class GaugeOptions:
    """The data of a gauge study, and the tolerance that it is compared with."""

    quantity: Annotated[str | None, Option(help="Instead: repeated judgements of this quantity.")] = None
    tolerance: Annotated[float | None, Option(min=0.0, help="Distance between the limits.")] = None
    study: Annotated[str | None, Option(help="With --quantity: only judgements of this [origin] study.")] = None


@dataclass(frozen=True)
class MatchOptions:
    """Which sets are looked for."""

    n: Annotated[int, Option("--n", min=2, help="Units of a set.")] = 6
    sets: Annotated[int, Option(min=1, help="Disjoint sets.")] = 1
    kind: Annotated[str, Option(help="Product (accept product list).", callback=installed)] = "strut"
    by: Annotated[list[str] | None, Option(help="Quantities that should agree; repeat the option.")] = None
    units: Annotated[Path | None, Option("--units", help="Only these units: file with a serial on each line.")] = None
    without: Annotated[Path | None, Option(help="Not these units, shipped ones say: file as of --units.")] = None
    lot: Annotated[str | None, Option(help="Only units of this lot.")] = None
    since: Annotated[str | None, Option(help="Only units measured from this day or month on, UTC.")] = None
    until: Annotated[str | None, Option(help="Only units measured until this day or month, UTC.")] = None
