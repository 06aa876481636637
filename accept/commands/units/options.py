"""Options of `accept batch` and `accept report`, declared once. Light, so that help comes at once."""

from dataclasses import dataclass
from typing import Annotated

from typer import Option

from accept.commands.options import BenchPath, Operator, TimeStamping


@dataclass(frozen=True)
class JudgingOptions:
    """Options of judging and signing units."""

    operator: Operator = None
    bench: BenchPath = None
    model: Annotated[str | None, Option(help="Compare responses with this model, not the spec's.")] = None
    tsa: TimeStamping = None
    reason: Annotated[str | None, Option(help="Why a unit is judged again, or its certificate is replaced.")] = None
