"""Consistency of the records of frequency responses; contradictions give no result.

One structure, measured twice and by three instruments: its bands meet, its pole is in every channel, no two channels
hold the same samples, and a volt moves it as far as two sound stacks do."""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from checks.acceptance.common.piezo_lag import ALIKE
from checks.acceptance.responses.rules import OUTPUTS, ResponseSettings
from checks.arrays import Array
from checks.cause import Cause, NoResult
from checks.quantity import Quantity
from checks.record import MOTIONS, Record
from checks.signals.spectral.frf import Frf
from specs.bench import STATIC_HZ

UM = 1e-6
ABOUT_MERGE = np.sqrt(2.0)  # half an octave to either side, where both bands are driven
COHERENT = 0.9  # of both: below, noise makes the difference
MIN_BINS = 5  # for a median that one bin does not decide
AT_POLE = 0.03  # of the resonance, to either side
BEYOND_POLE = 1.3, 1.5  # times the resonance
# One mode of a damping ratio of 5 percent, five times what any strut has, is ten times larger at its pole than at 1.4
# times its frequency; a channel that does not follow the structure is as large at both.
STANDS_OUT = 3.0


def vet_copies(records: Mapping[str, Record]) -> None:
    """Raise NoResult if one channel is another one multiplied by a number: each has its own noise and steps."""
    for key, record in records.items():
        there = [c for c in ("Va", *OUTPUTS) if c in record.channels]
        centred = np.array([record[c] - record[c].mean() for c in there])
        products = centred @ centred.T
        for a, b in combinations(range(len(there)), 2):
            # Most pairs show by their products alone that they are not proportional within a hundredth.
            near = products[a, b] ** 2 >= 0.99 * products[a, a] * products[b, b]
            if near and _proportional(centred[a], centred[b]):
                raise NoResult(Cause.CHANNEL_COPIED, record=key, file=record.name, channel=there[a], other=there[b])


def _proportional(x: Array, y: Array) -> bool:
    """Return whether one channel is the other one multiplied by a number; both without their mean."""
    size_x, size_y = float(x @ x), float(y @ y)
    if size_x == 0.0 or size_y == 0.0:
        return False
    left = y - (float(x @ y) / size_x) * x
    return float(left @ left) <= ALIKE**2 * size_y


def check_against_gain(resonance: Quantity, frf: Frf, rules: ResponseSettings) -> Quantity:
    """Return the resonance, of unknown uncertainty if de or da moves by another amount per volt than two stacks behind
    the amplifier make it move, so that it cannot pass: a frequency does not show a stack that is dead or not connected,
    or an amplifier of another gain. A resonance outside its limits fails as before: a soft shell moves more."""
    low = frf.band(*STATIC_HZ)
    lo, hi = rules.gain_um_per_V
    for c in (motion for motion in MOTIONS if motion in frf.channels):
        usable = low.usable
        gain = float(np.median(np.abs(low.H[usable, low.index(c)]))) / UM if usable.any() else np.nan
        if not lo <= gain <= hi:
            return resonance.doubted(Cause.WRONG_GAIN, channel=c, gain=gain, lo=lo, hi=hi)
    return resonance


def vet_bands(low: Frf, high: Frf, merge_Hz: float, rules: ResponseSettings) -> None:
    """Raise NoResult if the two bands, both coherent about the frequency at which they are merged, contradict each
    other there: records of two units, two payloads, two gains or two time bases."""
    span = merge_Hz / ABOUT_MERGE, merge_Hz * ABOUT_MERGE
    _vet_ratio(low.band(*span), high.band(*span), "the high record", f"the low one about {merge_Hz:g} Hz", rules)


def vet_repeat(key: str, first: Frf, again: Frf, rules: ResponseSettings) -> None:
    """Raise NoResult if a second realisation contradicts the first one."""
    _vet_ratio(first, again, key, "the first realisation", rules)


def _vet_ratio(a: Frf, b: Frf, this: str, that: str, rules: ResponseSettings) -> None:
    """Raise NoResult if two responses differ by a factor in the bins that both have."""
    n = min(a.f.size, b.f.size)
    same_bins = np.abs(a.f[:n] - b.f[:n]) <= 1e-3 * a.f[1] if n > 1 else np.zeros(n, dtype=bool)
    for i, c in enumerate(a.channels):
        both = (a.coherence[:n, i] >= COHERENT) & (b.coherence[:n, i] >= COHERENT) & same_bins
        if np.count_nonzero(both) < MIN_BINS:
            continue
        ratio = float(np.median(np.abs(b.H[:n, i][both] / a.H[:n, i][both])))
        if not 1 / (1 + rules.bands_within) <= ratio <= 1 + rules.bands_within:
            raise NoResult(Cause.RECORDS_DISAGREE, channel=c, ratio=ratio, this=this, that=that)


def vet_pole(frf: Frf, resonance_Hz: float) -> None:
    """Raise NoResult if a channel does not show the resonance of the others: it is not of this structure."""
    pole = frf.band((1 - AT_POLE) * resonance_Hz, (1 + AT_POLE) * resonance_Hz)
    beyond = frf.band(BEYOND_POLE[0] * resonance_Hz, BEYOND_POLE[1] * resonance_Hz)
    for c in frf.channels:
        at, by = (np.abs(part.H[part.usable, part.index(c)]) for part in (pole, beyond))
        if at.size and by.size and not float(at.max()) >= STANDS_OUT * float(np.median(by)):
            ratio = float(at.max() / np.median(by))
            raise NoResult(Cause.CHANNEL_FOREIGN, channel=c, f_Hz=resonance_Hz, ratio=ratio)
