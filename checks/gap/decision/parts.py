"""Calibrated values that leave what the parts of a strut may have: a stack whose force is gone in part, a joint that is
stiffer, a mass that was left on. Such a fit agrees with the data, and is no agreement of this strut with its model."""

from collections.abc import Iterator

import numpy as np

from checks import distributions as stats
from checks.gap.decision.result import Nameless
from checks.gap.modelling.unmodelled_modes import ALL
from checks.gap.search.candidate import Candidate
from checks.gap.statistics.projected_residual import TOLD
from checks.rounding import with_U
from specs.units import model_label, with_unit

# What is made, bought or weighed as one; its values are compared together. Dampings have no range.
PARTS = ("joint.", "encoder.", "bench.payload_kg", "constants.ga_", "constants.gs_")
CHANCE = 0.01  # over all parts of a sound strut


def values_beyond_parts(full: Candidate) -> Iterator[Nameless]:
    """Yield what the values of each part say if chance does not bring them so far from their priors: of the file, of a
    batch or as measured on this unit. The shift of a value under its prior has the variance that the data took away."""
    seen, free = full.seen, {p.name: p for p in full.response.free()}
    for part in PARTS:
        rows = [i for i, n in enumerate(seen.pulled) if n.startswith(part) and free[n].logarithmic]
        last = seen.r.size - len(seen.pulled) + np.array(rows, dtype=int)
        room, axes = np.linalg.eigh(np.eye(len(rows)) - seen.Q[last] @ seen.Q[last].T)
        told = room > TOLD
        pulls = (axes.T @ seen.left[last])[told] / np.sqrt(room[told])
        if told.any() and len(PARTS) * stats.chi2.sf(pulls @ pulls, int(told.sum())) < CHANCE:
            own = [free[seen.pulled[i]] for i in rows]
            far = max(own, key=lambda p: abs(full.at[p.name] - p.prior) / p.sd)
            value, allowed = f"{full.at[far.name]:.4g}", with_unit(with_U(far.prior, 2.0 * far.sd), far.name)
            words = (
                f"every channel agrees, but only with {model_label(far.name)} at {value} where {allowed} is expected"
            )
            yield Nameless(ALL, (), (), False, f"{words}: measure the part, or look for what acts like it")
