"""Errors in the data or the model that a check is given."""

from checks.cause import Cause, Reason, because
from specs.errors import AcceptError


class RecordError(AcceptError, ValueError):
    """Error for a record that must not be used; the text names the file, the channel, the value and the expected one.

    Made from a reason, or from plain words if no advice depends on the cause."""

    def __init__(self, reason: Reason | str) -> None:
        self.reason = because(Cause.IN_WORDS, detail=reason) if isinstance(reason, str) else reason
        super().__init__(reason)


class ModelError(AcceptError, ValueError):
    """Error for a model that cannot be built or evaluated; the text names the value and what was expected."""


class NotHeld(ModelError):
    """Error for values with which the assembly falls over: wrong in a file, or reached by a search on records that no
    strut can have given."""

    def __init__(self, lowest: float) -> None:
        held = f"the assembly is not held: lowest eigenvalue of its stiffness {lowest:.4g}"
        super().__init__(f"with such values nothing stands ({held})")
