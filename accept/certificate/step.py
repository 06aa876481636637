"""What one step of verification found."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """In words; complete: False where the step could not be done in full, so that the certificate is not plainly valid."""

    words: str
    complete: bool = True
