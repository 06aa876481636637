"""A computation without an answer."""

from specs.errors import AcceptError

STOPPED = "stopped"  # the words of one that was cancelled


class NotDone(AcceptError, RuntimeError):
    """A computation without an answer; the text says why: stopped, killed, or refused by the computation."""
