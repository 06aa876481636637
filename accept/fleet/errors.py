"""What a question about many units raises."""

from specs.errors import AcceptError


class FleetError(AcceptError, ValueError):
    """A question that the stored units cannot answer; the text says what is missing."""
