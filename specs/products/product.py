"""The declaration of a product: its kind of unit, its spec and its model."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Product:
    """One product. name: `kind` in unit.toml and in specs; title, plural: in words.

    spec: the spec without `--spec`, a built-in name or a TOML file. model: what its responses are explained by without
    `--model`, as built-in name or file; None if it has no model. parts: part in unit.toml -> label, which the workflow
    asks for. checks: checks of the program that its spec may ask for, besides those that name it in their `kinds`.
    matched_by: quantities by which sets are matched, if `accept match` is asked for no other. variant_of: the product
    that it is like but for what is absent, "" if it is a product of its own. absent: channels of its records and checks
    that it does not have -> the reason, in words."""

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
        """Return the product of which it is a variant, or itself."""
        return self.variant_of or self.name
