"""Exit codes. 1 is a crash and 2 typer's usage error, so no verdict uses them."""

from collections.abc import Iterable
from enum import IntEnum


class Exit(IntEnum):
    """The meaning of a command's exit code ([DESIGN] 4)."""

    ACCEPTED = 0
    REJECTED = 3
    INCOMPLETE = 4  # incomplete or conditional
    INSTRUMENT = 5
    BAD_INPUT = 6  # nothing could be judged
    STOPPED = 130  # with Ctrl-C, as in a shell: 128 and the signal's number


def of_verdicts(verdicts: Iterable[str], refused: int = 0) -> Exit:
    """Return the exit code of the worst verdict. A refused unit counts as not accepted, no unit at all as bad input."""
    found = set(verdicts)
    if not found:
        return Exit.BAD_INPUT
    if "rejected" in found:
        return Exit.REJECTED
    return Exit.ACCEPTED if found == {"accepted"} and not refused else Exit.INCOMPLETE
