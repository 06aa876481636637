"""Options of `accept run`, declared once: names, defaults and help. Light, so that the first screen comes at once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from accept.commands.options import BenchPath, Operator, SpecName

UNIT_FILE = "unit.toml"  # as in accept.units.unit_folder, which takes longer to import than the first screen may


@dataclass(frozen=True)
class RunOptions:
    """The command line, as typed."""

    unit: Annotated[str | None, typer.Argument(help="Serial or unit folder to continue with.")] = None
    spec: SpecName = None
    bench: BenchPath = None
    records: Annotated[Path | None, typer.Option(help="Folder that new record files arrive in.")] = None
    operator: Operator = None
    training: Annotated[bool, typer.Option("--training", help="A simulated unit with a hidden fault.")] = False
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the training unit; default: random.")] = None

    def arguments(self) -> list[str]:
        """Return what would be typed to get this."""
        options = {"spec": self.spec, "bench": self.bench, "records": self.records, "operator": self.operator}
        named = options | {"seed": self.seed}
        words = [word for name, value in named.items() if value is not None for word in (f"--{name}", str(value))]
        return [*([self.unit] if self.unit else []), *words, *(["--training"] if self.training else [])]

    @property
    def folder(self) -> Path | None:
        """Return the unit folder that is meant, None for a serial."""
        path = Path(self.unit or "")
        return path if self.unit and ((path / UNIT_FILE).is_file() or len(path.parts) > 1) else None
