"""Why a certificate does not hold."""

from specs.errors import AcceptError


class InvalidCertificate(AcceptError, ValueError):
    """A certificate that does not hold; the text is the reason, in one line."""

    def __init__(self, reason: str) -> None:
        super().__init__(one_line(reason))


def one_line(text: str, longest: int = 300) -> str:
    """Text without line breaks or control characters, cut to a length that a line holds."""
    plain = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return plain if len(plain) <= longest else plain[: longest - 1] + "…"
