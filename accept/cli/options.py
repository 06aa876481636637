"""A command's options as one dataclass: it stands as one parameter of the command, and typer sees its fields."""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from inspect import Parameter, signature
from typing import Any


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """The command as typer is to see it: every parameter that is such a dataclass replaced by its fields, in place.

    Annotations of the command and of the dataclasses are types, not strings."""
    asked = signature(command).parameters.values()
    groups: dict[str, Any] = {p.name: p.annotation for p in asked if is_dataclass(p.annotation)}
    seen = [part for p in asked for part in (_parts(p.annotation) if p.name in groups else (p,))]
    seen = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in seen]  # so that one without a default may follow another

    @wraps(command)
    def run(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{f.name: given.pop(f.name) for f in fields(group)})
        command(**given)

    run.__dict__["__signature__"] = signature(command).replace(parameters=seen)
    run.__annotations__ = {p.name: p.annotation for p in seen}
    return run


def _parts(group: type) -> list[Parameter]:
    return list(signature(group).parameters.values())
