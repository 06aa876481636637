"""Arguments of the functions that a script calls, checked against their annotations before anything is computed."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from inspect import Parameter, signature
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from specs.errors import AcceptError

P = ParamSpec("P")
R = TypeVar("R")
WORDS: dict[Any, str] = {
    float: "a number",
    int: "a whole number",
    str: "a text",
    Path: "a Path",
    NoneType: "None",
    Mapping: "a mapping",
    Sequence: "a list of texts",
    Callable: "a function",
}


class ArgumentError(AcceptError, TypeError):
    """An unusable argument; the text states the accepted ones."""


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that raises ArgumentError for an argument of another plain kind than its annotation, or NaN."""
    hints: dict[str, Any] = {}

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if not hints:
            hints.update(get_type_hints(function))
        bound = signature(function).bind(*args, **kwargs)
        for name, value in bound.arguments.items():
            kind = signature(function).parameters[name].kind
            for each in value if kind is Parameter.VAR_POSITIONAL else (value,):  # of `*records` every one
                check_argument(function.__name__, name, each, hints.get(name, Any))
        return function(*args, **kwargs)

    return call


def check_argument(function: str, name: str, value: Any, hint: Any) -> None:
    """Raise ArgumentError if a value has none of the plain types of a hint. Others are checked where used."""
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    words = [WORDS[get_origin(k) or k] for k in kinds if (get_origin(k) or k) in WORDS]
    if len(words) < len(kinds) or any(_is_of_kind(value, k) for k in kinds):
        return
    shown = repr(value) if len(repr(value)) < 60 else f"a {type(value).__name__}"
    raise ArgumentError(f"{function}: {name} = {shown}: expected {' or '.join(words)}")


def _is_of_kind(value: Any, kind: Any) -> bool:
    if kind is float:
        return isinstance(value, Real) and not isinstance(value, bool) and not math.isnan(float(value))
    if kind is int:
        return isinstance(value, Integral) and not isinstance(value, bool)
    if get_origin(kind) is Sequence:
        listed = value.tolist() if hasattr(value, "tolist") else value
        return isinstance(listed, list | tuple) and all(isinstance(each, str) for each in listed)
    if get_origin(kind) is Mapping:
        names, values = get_args(kind)
        return isinstance(value, Mapping) and all(
            _is_of_kind(k, names) and _is_of_kind(v, values) for k, v in value.items()
        )
    return isinstance(value, get_origin(kind) or kind)
