"""Picture of the impacts in a force track, good or set aside."""

from collections.abc import Sequence

import numpy as np

from checks.arrays import Array
from checks.picture import Item, Line, Panel, Text
from checks.signals.impact.impacts import Impact, tally

_POINTS = 2000  # of a curve on a picture: more than its pixels


def impacts_panel(title: str, t: Array, force: Array, impacts: Sequence[Impact], unit: str = "N") -> Panel:
    """Return the force (N,) over time (N,) [s], each impact marked good or bad, the bad ones with the reason."""
    items: list[Item] = [Line(*envelope(t, force), label="force", role="quiet")]
    for label, role in (("good", "good"), ("set aside", "bad")):
        which = [i for i in impacts if i.good == (role == "good")]
        if which:
            peaks = np.array([i.force_N for i in which])
            items.append(Line(t[[i.peak for i in which]], peaks, label, "points", role))
    items += [Text(float(t[i.peak]), i.force_N, i.fault or "", "bad") for i in impacts if not i.good]
    return Panel(f"{title}: {tally(impacts)}", "time [s]", f"force [{unit}]", tuple(items))


def envelope(t: Array, force: Array) -> tuple[Array, Array]:
    """Return the largest force in each of at most 2000 stretches: thinning must not lose a peak of three samples."""
    step = -(-force.size // _POINTS)
    starts = np.arange(0, force.size, step)
    return t[starts], np.maximum.reduceat(force, starts)
