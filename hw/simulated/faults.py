"""Faults on demand. Those of the line strike one reply; those of the instrument last until they are cleared."""

import random
from dataclasses import dataclass
from enum import StrEnum


class FaultKind(StrEnum):
    """The kinds of fault on a line."""

    UNPLUG = "unplug"  # the line is cut in the middle of a reply and is back after `seconds`
    GARBAGE = "garbage"  # bytes of a reply replaced, lost or added
    HALF_LINE = "half_line"  # the rest of a reply never comes
    SLOW = "slow"  # `seconds` between the bytes of a reply
    ECHO_LOST = "echo_lost"  # a whole reply is lost
    LATE = "late"  # a whole reply comes `seconds` late
    WRONG_UNIT = "wrong_unit"  # the unit or the mode was changed at the instrument
    OVERRANGE = "overrange"
    MENU_OPEN = "menu_open"  # it says nothing
    SWAPPED = "swapped"  # another instrument is on this line


OF_THE_LINE = {
    FaultKind.UNPLUG, FaultKind.GARBAGE, FaultKind.HALF_LINE, FaultKind.SLOW, FaultKind.ECHO_LOST, FaultKind.LATE,
}  # fmt: skip


@dataclass(frozen=True)
class LineFault:
    """after: replies before it strikes. at: position in the reply. seconds: duration, for some kinds. seed: of the
    damage."""

    kind: FaultKind
    after: int = 0
    at: int = 0
    seconds: float = 0.2
    seed: int = 0


def damaged(reply: bytes, fault: LineFault) -> bytes:
    """Return a reply with one to four bytes replaced, removed or added anywhere, also digits by digits."""
    rng = random.Random(fault.seed)
    data = bytearray(reply)
    for _ in range(rng.randint(1, 4)):
        where = rng.randrange(len(data)) if data else 0
        byte = rng.choice((rng.randrange(256), rng.choice(b"0123456789.-+ \r\n")))
        how = rng.choice(("replace", "remove", "add"))
        if how == "add" or not data:
            data.insert(where, byte)
        elif how == "remove":
            del data[where]
        else:
            data[where] = byte
    return bytes(data)
