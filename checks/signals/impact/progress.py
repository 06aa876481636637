"""A hammer test while it runs: which hits are good so far, and how many more are needed."""

import math
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array
from checks.signals.impact.hammer import ImpactFrf, analyse
from checks.signals.impact.impacts import CLOSE, Impact, ImpactRules, find_impacts, upright

_SEEN_AFTER_s = 0.2  # a rebound shows within, so a hit is not judged sooner


@dataclass(frozen=True)
class HitsSoFar:
    """The hits of a running hammer test. hits: those that can be judged, in order; coming: whether one is still too
    young; coherence: median over the band that the good ones drive, NaN for fewer than two; frf: of these, None for
    fewer; band_Hz: that is looked at."""

    hits: tuple[Impact, ...]
    coming: bool
    needed: int
    coherence: float
    frf: ImpactFrf | None = None
    band_Hz: tuple[float, float] = (0.0, math.inf)

    @property
    def good(self) -> int:
        return sum(hit.good for hit in self.hits)

    @property
    def more(self) -> int:
        """Return the number of good hits that are still needed."""
        return max(self.needed - self.good, 0)

    @property
    def words(self) -> str:
        """Return the last hit and the hits still needed: `hit 3: double hit (...). 2 good; two more hits`."""
        return self.words_after(len(self.hits) - 1)

    def words_after(self, known: int) -> str:
        """Return the hits after the first `known` ones, and the number of hits still needed."""
        fates = (
            f"good, {hit.force_N:.3g} N" if hit.good else f"{hit.fault} ({hit.detail})" for hit in self.hits[known:]
        )
        hits = "".join(f"hit {k}: {fate}. " for k, fate in enumerate(fates, known + 1))
        agreement = f", coherence {self.coherence:.3f}" if np.isfinite(self.coherence) else ""
        more = f"{self.more} more hit{'s' * (self.more > 1)}" if self.more else "enough"
        return f"{hits}{self.good} good{agreement}; {more}"


def hits_so_far(
    force: Array, response: Array, fs: float, rules: ImpactRules, needed: int, band_Hz: tuple[float, float]
) -> HitsSoFar:
    """Return the state of a hammer test from its record so far: force (N,) [N], response (N,), sampled at fs [Hz].

    The last hit is judged as bad as soon as a fault shows, as good once its decay has been recorded."""
    if force.size < 2 or np.ptp(force) == 0.0 or np.ptp(response) == 0.0:
        return HitsSoFar((), False, needed, float("nan"))
    impacts = find_impacts(upright(force), fs, rules)
    if not impacts:
        return HitsSoFar((), False, needed, float("nan"))
    test = analyse(force, response, fs, rules, band_Hz)
    last = test.impacts[-1]
    coming = (force.size - last.peak) / fs < _SEEN_AFTER_s or last.fault == CLOSE
    hits = test.impacts[:-1] if coming else test.impacts
    coherence = float("nan")
    if test.frf is not None:
        inside = test.frf.driven & (band_Hz[0] <= test.frf.f) & (test.frf.f <= band_Hz[1])
        coherence = float(np.median(test.frf.coherence[inside])) if inside.any() else float("nan")
    return HitsSoFar(hits, coming, needed, coherence, test.frf, band_Hz)
