"""The result of one step of verification."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """One step in words. complete: False if it could not be done in full; the certificate is then not plainly valid.
    remark: a line to be shown beside the verdict. current: whether the step knows that no later attempt was judged,
    None if it did not look for one."""

    words: str
    complete: bool = True
    remark: str = ""
    current: bool | None = None
