"""Errors of questions about many units."""

from specs.errors import AcceptError


class FleetError(AcceptError, ValueError):
    """A question that the stored units cannot answer; the text states what is missing."""
