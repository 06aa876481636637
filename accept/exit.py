"""Exit codes. 1 is a crash and 2 typer's usage error, so no verdict uses them."""

from enum import IntEnum


class Exit(IntEnum):
    ACCEPTED = 0
    REJECTED = 3
    INCOMPLETE = 4  # incomplete or conditional
    INSTRUMENT = 5
    BAD_INPUT = 6  # nothing could be judged
