"""Words from elsewhere as a terminal, a log or a table may show them: the one escaping for all output."""


def one_line(text: str) -> str:
    """Return text on one line, without anything that moves the cursor or writes from right to left; what cannot be
    shown is escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def as_utf8(text: str) -> str:
    """Return text that every document and store can hold: each byte of a file's name that is no UTF-8, for which Python
    writes half of a surrogate pair, is escaped."""
    return text.encode("utf-8", "backslashreplace").decode()


def lines(text: str) -> str:
    """Return the same of several lines."""
    return "\n".join(one_line(line) for line in text.split("\n"))
