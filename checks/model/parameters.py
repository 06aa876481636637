"""Parameters by flat name: their bounds, what depends on them, and their values in SI."""

import math
from collections.abc import Iterable, Mapping
from functools import lru_cache

from checks.errors import ModelError
from checks.model.structure.attached import ELEMENT, TILT
from specs.models.parameters import PARAMETERS, Acts, ModelParameter
from specs.units import unit_of

RELATIVE_STEP = 1e-4  # truncation 1e-8 and round-off 1e-11 / 1e-4 of a central difference are both small
MODE_STIFFNESS, MODE_DAMPING = "apa.mode_stiffness_", "apa.mode_damping_"  # and the number of the mode, from 1
DAMPING_RATIO = "apa.damping_ratio"
_BY_KEY = {key: p for p in PARAMETERS for key in p.keys}
_BY_NAME = {f"{p.section}.{key}": p for p in PARAMETERS for key in p.keys}
_UNLISTED = ModelParameter("", "", open=True)
_SEEN_ONLY = ("constants.", "delay.", "amplifier.", "sensor.", "unidentified.")
_TO_SI = {"N_per_um": 1e6, "um": 1e-6, "mm": 1e-3, "us": 1e-6}


@lru_cache(maxsize=4096)
def rule(name: str) -> ModelParameter:
    """Return the declaration of a parameter by the last part of its flat name; unlisted ones must be positive."""
    return _BY_KEY.get(last(name), _UNLISTED)


@lru_cache(maxsize=4096)
def last(name: str) -> str:
    """Return the last part of a flat name: `kz_N_per_um` of `joint.bottom.kz_N_per_um`."""
    return name.rpartition(".")[2]


def matters(changes: Mapping[str, float]) -> dict[str, float]:
    """Return the changed values, sorted by name, that derivatives of the matrices may depend on. A factor on a mode of
    the APA changes one entry of its own, so of these only damping matters: for the damping of all."""
    found = [n for n in changes if is_mechanical(n) and not n.startswith(MODE_STIFFNESS)]
    return {n: changes[n] for n in sorted(found)}


def depends_on(name: str, mattering: Mapping[str, float], tied: bool) -> tuple[tuple[str, float], ...]:
    """Return those of the changed values that the derivative of the matrices by a mechanical parameter depends on.
    tied: there are rigid directions, and the coordinates turn with the offset."""
    own, no_matter = rule(name).acts, Acts.IN_MECHANICS
    if Acts.IN_PROPORTION in own:
        no_matter = Acts.IN_PROPORTION if tied or Acts.ON_THE_AXIS in own else Acts.IN_PROPORTION | Acts.OFFSET
    of_all = name == DAMPING_RATIO
    beside = {n for n in mattering if n.startswith(ELEMENT) and not n.startswith(TILT)}  # add their own matrices
    return tuple(
        (n, value)
        for n, value in mattering.items()
        if (of_all or not is_mode_factor(n)) and not (no_matter and (rule(n).acts & no_matter or n in beside))
    )


def turns_ties(name: str) -> bool:
    """Return whether a rigid direction runs elsewhere with another value."""
    return Acts.TURNS_TIES in rule(name).acts


@lru_cache(maxsize=4096)
def is_of_body(name: str) -> bool:
    """Return whether a mechanical parameter changes the APA's own matrices, not only those of parts fastened to it."""
    return name.startswith("apa.") and Acts.OFFSET not in rule(name).acts and not last(name).endswith("_stiffening")


@lru_cache(maxsize=4096)
def is_mode_factor(name: str) -> bool:
    """Return whether a parameter is a factor on a free mode of the APA: it changes one entry of the matrices."""
    return name.startswith((MODE_STIFFNESS, MODE_DAMPING))


def si(values: Mapping[str, float], name: str) -> float:
    """Return the value of a parameter in SI units, from the unit at the end of its name."""
    for suffix, factor in _TO_SI.items():
        if name.endswith("_" + suffix):
            return values[name] * factor
    return values[name]


def known(names: Iterable[str], allowed: Iterable[str]) -> None:
    """Raise ModelError naming the first parameter that a model does not have."""
    have = allowed if isinstance(allowed, Mapping) else set(allowed)
    for name in names:
        if name not in have:
            raise ModelError(f"no parameter '{name}' (has: {', '.join(sorted(have))})")


@lru_cache(maxsize=4096)
def is_mechanical(name: str) -> bool:
    """Return whether a parameter changes the modes, and not only their measurement."""
    seen = _BY_NAME.get(name, _UNLISTED).acts & Acts.ON_MEASUREMENT
    return not seen and not name.startswith(_SEEN_ONLY)


def in_range(values: Mapping[str, float]) -> None:
    """Raise ModelError naming the first value that is not a number or out of its bounds."""
    for name, value in values.items():
        r = rule(name)
        if r.lo < value < r.hi and math.isfinite(value):
            continue
        infinite_is_off = _BY_NAME.get(name, _UNLISTED).off == value == math.inf
        below = value <= r.lo if r.open else value < r.lo
        if not infinite_is_off and (not math.isfinite(value) or below or value > r.hi):
            least = f"above {r.lo:g}" if r.open else f"{r.lo:g} or more"
            most = "" if math.isinf(r.hi) else f", at most {r.hi:g}"
            raise ModelError(f"{name} is {value:g} {unit_of(name)}; expected a number {least}{most}")


def derivative_step(name: str, value: float) -> float:
    """Return the step of a central difference in the parameter's unit. Raises ModelError for an effect that is off."""
    if not math.isfinite(value):
        raise ModelError(f"{name} is {value:g}: the effect is off and has no derivative; give it a value")
    r = rule(name)
    return r.step if r.step is not None else RELATIVE_STEP * abs(value) if value else RELATIVE_STEP


def is_declared(name: str) -> bool:
    """Return whether a section of a model file can hold a parameter of this flat name."""
    section, _, key = name.rpartition(".")
    kinds = {"apa": ("apa", "apa of modes", "2dof")}.get(section, (section.partition(".")[0],))
    return is_mode_factor(name) or any(f"{kind}.{key}" in _BY_NAME for kind in kinds)
