"""Differences between two specs, or two revisions of one."""

from collections.abc import Iterator, Mapping
from typing import Any

from specs.spec import Spec, SpecDocument


def differences(first: Spec, second: Spec) -> Iterator[tuple[str, Any, Any]]:
    """Yield every value that differs, in the order of the files: its place by dots, and both values, None where it is
    not stated. Comments and the order of keys do not count."""
    one, other = _values(first), _values(second)
    for key in one | other:
        if one.get(key) != other.get(key):
            yield key, one.get(key), other.get(key)


def _values(spec: Spec) -> dict[str, Any]:
    return dict(_leaves(spec.model_dump(include=set(SpecDocument.model_fields), exclude_none=True), ""))


def _leaves(held: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    for name, value in held.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{path}{name}.")
        else:
            yield f"{path}{name}", value
