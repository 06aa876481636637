"""A channel that runs into the end of its range, wherever that is: its extreme value piles up."""

import numpy as np
from numpy.typing import NDArray

PILED = 5.0  # times the next value: at the crest of a sine two neighbours differ by 2.4, in noise by less
PILED_SAMPLES = 50  # below that a pile may be chance


def overload(name: str, x: NDArray[np.float64]) -> str | None:
    """What says that x (N,) is clipped: its largest or smallest value comes far more often than the next one. None
    where neither does. Not for a channel that may wait at its extreme, as a triangle that is held does."""
    for end, ordered in (("largest", -x), ("smallest", x)):
        lowest = float(ordered.min())
        count = int(np.count_nonzero(ordered == lowest))
        above = ordered[ordered > lowest]
        beside = int(np.count_nonzero(above == above.min())) if above.size else 0
        if count >= PILED_SAMPLES and count > PILED * beside:
            return f"{name} is clipped: {count} samples hold its {end} value {abs(lowest):.4g}, {beside} the next one"
    return None
