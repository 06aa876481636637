"""The result of a step of verification."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """One step in words. complete: False if it could not be done in full; the certificate is then not plainly valid.
    remark: a line to be shown beside the verdict. current: whether the step knows that no later attempt was judged,
    None if it did not look for one. looked_up: fields of the provenance that a store or a list has as they are stated,
    and of the result."""

    words: str
    complete: bool = True
    remark: str = ""
    current: bool | None = None
    looked_up: tuple[str, ...] = ()
