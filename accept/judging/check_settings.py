"""Validation of a spec's settings of a check: a pydantic model made from what the check declares."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationError, create_model

from checks.declare import Check
from specs.strict import Finite, Positive, Strict, problem_line


def settings_problems(check: Check, given: Mapping[str, Any]) -> list[str]:
    """Return the errors in the settings that a spec gives a check, a line each with key path and value. A setting that
    the check does not declare is ignored."""
    declared: dict[str, Any] = {
        s.name: (_type(s.default, Positive if s.positive else Finite), ...) for s in check.settings if s.name in given
    }
    try:
        create_model("Settings", __base__=Strict, **declared).model_validate({name: given[name] for name in declared})
    except ValidationError as e:
        return [problem_line({**p, "loc": ("checks", check.name, "settings", *p["loc"])}) for p in e.errors()]
    return []


def _type(default: Any, number: Any) -> Any:
    """Return the type of a setting, derived from its default: a number, not negative if the default is not; a text; a
    pair, from and to; so many numbers or points; or, if the default is empty, any list of numbers. number: type of
    each."""
    if isinstance(default, str):
        return str
    if not isinstance(default, list | tuple):
        return Annotated[number, Field(ge=0)] if default >= 0 else number
    if not default:
        return list[number]
    if isinstance(default[0], list | tuple):
        return _so_many(_so_many(number, len(default[0])), len(default))
    numbers = _so_many(number, len(default))
    return Annotated[numbers, AfterValidator(_rising)] if len(default) == 2 and default[0] < default[1] else numbers


def _so_many(item: Any, count: int) -> Any:
    return Annotated[list[item], Field(min_length=count, max_length=count)]


def _rising(ends: list[float]) -> list[float]:
    if not ends[0] < ends[1]:
        raise ValueError(f"{ends[0]:g} to {ends[1]:g} is not a range; expected from < to")
    return ends
