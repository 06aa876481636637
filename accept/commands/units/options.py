"""Options of `accept batch` and `accept report`, declared once. Light, so that help comes at once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from accept.commands.options import BenchPath, ClusterAt, Operator, SpecName, TimeStamping

ExplainBy = Annotated[str | None, Option("--model", help="Compare responses with this model, not the spec's.")]

JudgedAgainFor = Annotated[
    str | None, Option("--reason", help="Why a unit is judged again, or its certificate is replaced.")
]


@dataclass(frozen=True, kw_only=True)
class BatchOptions:
    """Options of a batch: how units are judged, and where the results are written."""

    out: Annotated[Path, Option(help="Folder for the results.")]
    spec: SpecName = None
    no_certificates: Annotated[bool, Option("--no-certificates", help="Judge only; write no certificates.")] = False
    workers: Annotated[int | None, Option(min=1, help="Number of processes; default: by the amount of work.")] = None
    cluster: ClusterAt = None
    operator: Operator = None
    bench: BenchPath = None
    model: ExplainBy = None
    tsa: TimeStamping = None
    reason: JudgedAgainFor = None


@dataclass(frozen=True, kw_only=True)
class ReportOptions:
    """How one unit is judged. out: the certificate."""

    out: Annotated[Path, Option(help="The certificate to write.")]
    spec: SpecName = None
    operator: Operator = None
    bench: BenchPath = None
    model: ExplainBy = None
    tsa: TimeStamping = None
    reason: JudgedAgainFor = None
