"""Errors of questions about many units."""

from collections.abc import Iterator
from contextlib import contextmanager

from specs.errors import AcceptError


class FleetError(AcceptError, ValueError):
    """A question that the stored units cannot answer; the text states what is missing."""


@contextmanager
def statistics(of: str = "") -> Iterator[None]:
    """Raise FleetError where a method of statistics refuses its values by ValueError. of: what it was asked for."""
    try:
        yield
    except ValueError as e:
        raise FleetError(f"{of}{e}") from e
