"""What is said at the bench of an instrument that gave no reading: the cause and what to do, in a line. What came over
its wire is stored with the reading that failed."""

import re

from hw.errors import Garbled, InstrumentError, NoReply, OverRange, Unplugged

_AGAIN = "F3: again"
_CAUSES = (
    (OverRange, f"over its range, or no probe. Set it up, {_AGAIN}"),
    (NoReply, f"no whole answer in time. On? Cable in? {_AGAIN}"),
    (Unplugged, f"its port is gone. Cable in? {_AGAIN}"),
    (Garbled, f"its answer came damaged. Cable firm? {_AGAIN}"),
)
_REMEDY = re.compile(r"(?:came unasked; |has |holds )[^;:]*(?:[;:] .*)?$")  # that a driver knows better
_BYTES = re.compile(r"\s*\(+(?:b(['\"]).*?\1,? ?)+\)+|\bb(['\"]).*?\2(?:\.\.\.)?")


def fault_words(error: InstrumentError) -> str:
    """Return the cause and the remedy. Where the driver knows more of it than the kind of fault, these are its own."""
    text = str(error)
    plain = _BYTES.sub(lambda found: "" if found[0].lstrip().startswith("(") else "its answer", text)
    if isinstance(error, Garbled) and (known := _REMEDY.search(plain)) and "expected" not in known[0]:
        return f"its answer {known[0].removeprefix('its answer ')}"
    return next((words for kind, words in _CAUSES if isinstance(error, kind)), plain)
