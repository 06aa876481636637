"""Errors of the store, in the operator's words."""

from specs.errors import AcceptError


class StoreError(AcceptError, RuntimeError):
    """The store cannot be used; the text states its name, the reason and the remedy."""


class Overtaken(StoreError):
    """Another program stored an event about the unit since the writer read them: nothing was stored. Read again."""
