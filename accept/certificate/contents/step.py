"""What one step of verification found."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """In words; complete: False where it could not be done in full: the certificate is then not plainly valid. remark:
    what belongs beside the verdict, where that is one line."""

    words: str
    complete: bool = True
    remark: str = ""
