"""An acceptance spec: limits with bounds, unit, decision rule and source, read strictly from TOML."""

import hashlib
import math
import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from specs.patterns import pattern_problem
from specs.plugins import product_named
from specs.strict import Finite, Positive, Strict, Words, file_bytes, file_named, parse_as
from specs.units import unit_of

# As strict as a serial: it is in the first line of a verification, on pages and in the names of files.
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


class Limit(Strict):
    """Bounds of a quantity. rule: the decision rule; `checks.verdict.RULES` has its words."""

    lower: Finite | None = None
    upper: Finite | None = None
    unit: Words
    rule: Literal["simple", "guarded", "shared"]
    source: Words
    U_max: Positive | None = None
    assumed: bool = False

    @model_validator(mode="after")
    def _consistent(self) -> "Limit":
        if self.lower is None and self.upper is None:
            raise ValueError("has neither lower nor upper")
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise ValueError(f"lower={self.lower:g} is not below upper={self.upper:g} {self.unit}")
        if (self.rule == "shared") != (self.U_max is not None):
            raise ValueError("U_max goes with rule 'shared' and only with it")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """(lower, upper), infinite for a bound that it does not have."""
        return -math.inf if self.lower is None else self.lower, math.inf if self.upper is None else self.upper


class StatedU(Strict):
    """Expanded uncertainty (k = 2) of a value typed without one: absolute in the value's unit, or in percent of the
    value. percent_per_C: its change with temperature, whose distance from reference_C is then in the budget."""

    U: Positive | None = None
    U_percent: Positive | None = None
    percent_per_C: Positive | None = None
    reference_C: Finite = 23.0
    source: Words

    @model_validator(mode="after")
    def _one(self) -> "StatedU":
        if (self.U is None) == (self.U_percent is None):
            raise ValueError("needs exactly one of U and U_percent")
        return self

    def at(self, value: float) -> float:
        """Return the expanded uncertainty at this value, in the value's unit."""
        return self.U if self.U is not None else abs(value) * (self.U_percent or 0.0) / 100.0


class CheckSpec(Strict):
    """The requirements of a spec on one check. reference_days: at most so many days before the measurement its
    instrument must have been compared with its reference (`accept hw check`); None: the spec does not ask for it."""

    required: bool = True
    reference_days: int | None = Field(default=None, ge=0)
    instrument: str | None = None
    limits: dict[str, Limit] = Field(default_factory=dict)
    uncertainty: dict[str, StatedU] = Field(default_factory=dict)
    settings: dict[str, Any] = Field(default_factory=dict)

    @field_validator("limits")
    @classmethod
    def _units(cls, limits: dict[str, Limit]) -> dict[str, Limit]:
        wrong = [
            f"{name}: unit is '{limit.unit}', expected '{unit_of(name)}'"
            for name, limit in limits.items()
            if limit.unit != unit_of(name)
        ]
        if wrong:
            raise ValueError("; ".join(wrong))
        return limits

    @field_validator("settings")
    @classmethod
    def _finite(cls, settings: dict[str, Any]) -> dict[str, Any]:
        """Refuse numbers that are not finite: a gate that compares with NaN lets every value pass."""
        wrong = [name for name, value in settings.items() if not _all_finite(value)]
        if wrong:
            raise ValueError(f"{', '.join(wrong)}: every number must be finite")
        return settings

    @model_validator(mode="after")
    def _judges(self) -> "CheckSpec":
        if self.required and not self.limits:
            raise ValueError("is required but limits nothing: it would pass on nothing")
        return self


def _all_finite(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return all(_all_finite(v) for v in value)
    return not isinstance(value, float) or math.isfinite(value)


class GapStart(Strict):
    """The model that responses are explained by: a built-in name or a TOML file."""

    model: Words


class LearnedBenchLimits(Strict):
    """The requirements of a spec on a learned bench: its largest age when a unit is measured [days], and the least
    number of units that it was learned from."""

    within_days: int | None = Field(default=None, ge=0)
    from_units: int | None = Field(default=None, ge=2)

    @model_validator(mode="after")
    def _asks(self) -> "LearnedBenchLimits":
        if self.within_days is None and self.from_units is None:
            raise ValueError("needs within_days, from_units or both")
        return self


class SpecDocument(Strict):
    """The TOML document of a spec. gap: the missing effect is searched if responses do not fit the model.
    learned_bench: a finding is conditional at best by a model without learned bench, or with too old a one."""

    name: Words
    kind: Words
    title: Words
    serial_pattern: Words = r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
    checks: dict[str, CheckSpec] = Field(min_length=1)
    gap: GapStart | None = None
    learned_bench: LearnedBenchLimits | None = None

    @field_validator("kind")
    @classmethod
    def _installed(cls, kind: str) -> str:
        return product_named(kind).name

    @field_validator("serial_pattern")
    @classmethod
    def _compiles(cls, pattern: str) -> str:
        if problem := pattern_problem(pattern):
            raise ValueError(problem)
        return pattern

    @model_validator(mode="after")
    def _something_required(self) -> "SpecDocument":
        if not any(check.required for check in self.checks.values()):
            raise ValueError("requires no check: every unit would be accepted")
        return self


class Spec(SpecDocument):
    """A spec together with the bytes it was read from."""

    sha256: str
    text: str

    @property
    def with_hash(self) -> str:
        """Return name@sha256, as events and results state a spec."""
        return f"{self.name}@{self.sha256}"

    @property
    def instruments(self) -> dict[str, str]:
        return {name: check.instrument for name, check in self.checks.items() if check.instrument}


def builtin() -> dict[str, Path]:
    """Return name -> file of the specs that come with the program."""
    return {p.stem: p for p in sorted(Path(str(resources.files("specs"))).glob("*.toml"))}


def listed_name(spec: str) -> str:
    """Return how lists name the spec of an event, `name@sha256`: with a remark if it bears the name of one that comes
    with the program and has other content."""
    name, _, sha256 = spec.partition("@")
    own = _builtin_hashes().get(name)
    return f"{name} (other content)" if own and sha256 and own != sha256 else name


def is_builtin(name: str, sha256: str) -> bool:
    """Return whether a spec of this name and content comes with the program."""
    return _builtin_hashes().get(name) == sha256


@cache
def _builtin_hashes() -> dict[str, str]:
    return {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in builtin().items()}


def load(name: str | Path) -> Spec:
    """Return spec by built-in name or TOML file. Raises SpecError listing every problem with its key path."""
    path = file_named(name, builtin(), "spec")
    return parse(file_bytes(path), str(path))


def parse(raw: bytes, path: str) -> Spec:
    """Return spec from the bytes of a TOML file; `path` is for messages. Raises SpecError."""
    return parse_as(Spec, SpecDocument, raw, path)


def differences(first: Spec, second: Spec) -> Iterator[tuple[str, Any, Any]]:
    """Yield every value that differs, in the order of the files: its place by dots, and both values, None if not
    stated. Comments and the order of keys do not count."""
    given = (spec.model_dump(include=set(SpecDocument.model_fields), exclude_none=True) for spec in (first, second))
    one, other = (dict(_leaves(each, "")) for each in given)
    for key in one | other:
        if one.get(key) != other.get(key):
            yield key, one.get(key), other.get(key)


def _leaves(held: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    for name, value in held.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{path}{name}.")
        else:
            yield f"{path}{name}", value
