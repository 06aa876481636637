"""A command's options as one dataclass: it is one parameter of the function, and typer sees its fields."""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from inspect import Parameter, signature
from typing import Any

import typer


def command_of(function: Callable[..., int]) -> Callable[..., None]:
    """Return a function as typer is to see it: its exit code ends the program, and every parameter that is a dataclass
    is replaced by its fields, in place.

    Annotations of the function and of the dataclasses are types, not strings."""
    asked = signature(function).parameters.values()
    groups: dict[str, Any] = {p.name: p.annotation for p in asked if is_dataclass(p.annotation)}
    seen = [part for p in asked for part in (_parts(p.annotation) if p.name in groups else (p,))]
    seen = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in seen]  # so that one without a default may follow another

    @wraps(function)
    def run(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{f.name: given.pop(f.name) for f in fields(group)})
        raise typer.Exit(function(**given))

    del run.__dict__["__wrapped__"]
    run.__dict__["__signature__"] = signature(function).replace(parameters=seen, return_annotation=None)
    run.__annotations__ = {p.name: p.annotation for p in seen}
    return run


def _parts(group: type) -> list[Parameter]:
    return list(signature(group).parameters.values())
