"""Limits and nominal models as TOML, and the only code that reads them."""

from specs.spec import CheckSpec, Limit, Spec, StatedU, builtin, load, parse
from specs.strict import SpecError
from specs.units import unit_of

__all__ = ["CheckSpec", "Limit", "Spec", "SpecError", "StatedU", "builtin", "load", "parse", "unit_of"]
