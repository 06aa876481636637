"""The result of one step of verification."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """In words. complete: False if it could not be done in full; the certificate is then not plainly valid. remark:
    what belongs beside the verdict, in one line. current: whether the step knows that no later attempt was judged, None
    if it did not look for one."""

    words: str
    complete: bool = True
    remark: str = ""
    current: bool | None = None
