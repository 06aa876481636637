"""Words from elsewhere as a terminal, a log or a table may show them: the one escaping for all output, and the one
place that takes secrets out of addresses."""

import re
from collections.abc import Sequence

_ADDRESS = re.compile(r"([A-Za-z][\w+.-]*://)((?:(?!::[A-Za-z])\S)*)")  # each link of a chain, zip://a::https://b
_STATED = re.compile(r"(?i)\b(\w*(?:passw(?:or)?d|passphrase|secret|token|signature|sig|credential)=)[^\s&;'\"]+")


def one_line(text: str) -> str:
    """Return text on one line. Control characters and right-to-left marks are escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def as_utf8(text: str) -> str:
    """Return text that every document and store accepts: bytes that are not UTF-8 (half surrogates) are escaped."""
    return text.encode("utf-8", "backslashreplace").decode()


def lines(text: str) -> str:
    """Return the same of several lines."""
    return "\n".join(one_line(line) for line in text.split("\n"))


def listed(words: Sequence[str], most: int = 3, between: str = ", ") -> str:
    """Return the first few words and the number of the others: `a, b, c and 4 more`."""
    return between.join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")


def without_secrets(text: str) -> str:
    """Return text with addresses stripped of user, password, query and fragment: a presigned address is a key too."""
    return _STATED.sub(r"\1***", _ADDRESS.sub(_bare, text))


def _bare(found: re.Match[str]) -> str:
    scheme, rest = found.groups()
    place, *more = re.split(r"[?#;]", rest, maxsplit=1)
    if more and "@" in more[0]:  # perhaps of a password that is not escaped
        return f"{scheme}***"
    return scheme + place.rpartition("@")[2]
