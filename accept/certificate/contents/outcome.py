"""The outcome of a step of verification: what it found, or why the certificate does not hold."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from specs.errors import AcceptError

T = TypeVar("T")


class InvalidCertificate(AcceptError, ValueError):
    """A certificate that does not hold; the text is the reason, in one line."""

    def __init__(self, reason: str) -> None:
        super().__init__(one_line(reason))


def one_line(text: str, longest: int = 300) -> str:
    """Return the text without line breaks or control characters, cut to one line."""
    plain = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return plain if len(plain) <= longest else plain[: longest - 1] + "…"


_NO_PARTS = str.maketrans({";": ",", "'": "\u2019"})


def quoted(text: str, longest: int = 64) -> str:
    """Return what others wrote in quotation marks, on one line, without what parts the statements of a line."""
    return f"'{one_line(text, longest).translate(_NO_PARTS)}'"


def guarded(what: str, step: Callable[..., T], *arguments: Any, **options: Any) -> T:
    """Return what the step returns, and raise InvalidCertificate for any exception: a parser of hostile bytes can fail
    in any way, and then the certificate is not valid."""
    try:
        return step(*arguments, **options)
    except InvalidCertificate:
        raise
    except Exception as e:
        raise InvalidCertificate(f"{what} cannot be read: {type(e).__name__}: {e}") from e


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
