"""A channel that runs into the end of its range, wherever that is: its extreme value piles up."""

import numpy as np
from numpy.typing import NDArray

from checks.cause import Cause, Reason, because

PILED = 5.0  # times the next value: at the crest of a sine two neighbours differ by 2.4, in noise by less
PILED_SAMPLES = 50  # below that a pile may be chance


def overload(channel: str, x: NDArray[np.float64]) -> tuple[Reason, ...]:
    """What says that x (N,) is clipped: its largest or smallest value comes far more often than the next one; empty
    where neither does. Not for a channel that may wait at its extreme, as a triangle that is held does."""
    for end, ordered in (("largest", -x), ("smallest", x)):
        lowest = float(ordered.min())
        count = int(np.count_nonzero(ordered == lowest))
        above = ordered[ordered > lowest]
        beside = int(np.count_nonzero(above == above.min())) if above.size else 0
        if count >= PILED_SAMPLES and count > PILED * beside:
            at = float(-lowest if end == "largest" else lowest)
            where = f", {beside} the next one"
            return (because(Cause.CHANNEL_CLIPPED, channel=channel, count=count, end=end, value=at, where=where),)
    return ()
