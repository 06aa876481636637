"""Why a certificate does not hold."""

from collections.abc import Callable
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


def guarded(what: str, step: Callable[..., T], *arguments: Any, **options: Any) -> T:
    """Return what the step returns, and raise InvalidCertificate for any exception: a parser of hostile bytes can fail
    in any way, and then the certificate is not valid."""
    try:
        return step(*arguments, **options)
    except InvalidCertificate:
        raise
    except Exception as e:
        raise InvalidCertificate(f"{what} cannot be read: {type(e).__name__}: {e}") from e
