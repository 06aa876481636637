"""What is said at the bench of an instrument that gave no reading: the cause and what to do, in a line. What came over
its wire is stored with the reading that failed."""

import re

from hw.errors import InstrumentError

_REMEDY = re.compile(r"its answer (?:came unasked|has|holds)\b(?!.*expected).*")  # that a driver knows better
_BYTES = re.compile(r"\s*\(+(?:b(['\"]).*?\1,? ?)+\)+|\bb(['\"]).*?\2(?:\.\.\.)?")


def fault_words(error: InstrumentError) -> str:
    """Return the cause and the remedy. Where the driver knows more of it than the kind of fault, these are its own."""
    plain = _BYTES.sub(lambda found: "" if found[0].lstrip().startswith("(") else "its answer", str(error))
    if not error.cause:
        return plain
    known = _REMEDY.search(plain)
    return known[0] if known else f"{error.cause} F3: again"
