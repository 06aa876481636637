"""The declaration of a product: its kind of unit, its spec and its model."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Product:
    """One product. name: `kind` in unit.toml and in specs; title, plural: in words.

    spec: the default of `--spec`, a built-in name or a TOML file. model: the default of `--model` for its responses, a
    built-in name or file; None without a model. parts: part in unit.toml -> label, which the workflow asks for. checks:
    checks of the program for its spec, besides those that name it in their `kinds`. matched_by: default quantities of
    `accept match`. variant_of: the product that it equals but for absent parts, "" for none. absent: absent channels
    and checks -> the reason, in words."""

    name: str
    title: str
    plural: str
    spec: str | Path
    model: str | Path | None = None
    parts: Mapping[str, str] = field(default_factory=dict)
    checks: tuple[str, ...] = ()
    matched_by: tuple[str, ...] = ()
    variant_of: str = ""
    absent: Mapping[str, str] = field(default_factory=dict)

    @property
    def family(self) -> str:
        """Return the product that this is a variant of, or itself."""
        return self.variant_of or self.name
