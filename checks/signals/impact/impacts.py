"""Impacts in the force track of an instrumented hammer: their places, which must be set aside and why; a picture."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.picture import Item, Line, Panel, Text
from checks.signals.spectral.recursion import peaks

DOUBLE, OVERLOAD, CLOSE = "double hit", "overload", "too close"
LEVEL, MOVING, COHERENCE = "off level", "already moving", "low coherence"
_PLURAL = {DOUBLE: "double hits", OVERLOAD: "overloads"}

_FOUND_SIGMAS = 10.0  # noise of a million samples stays below 5 sigma
_FOUND_SHARE = 0.03  # of the largest peak: a weaker touch excites nothing and counts as noise
_RINGING_s = 0.002  # the anti-alias filter rings at least this long after a hit; a hammer rebounds later
_RINGING_SHARE = 0.25


@dataclass(frozen=True)
class ImpactRules:
    """Rules by which an impact is bad. Shares are of the impact's own peak; `level_ratio` is against the median peak.

    ringing_samples: how long the filter of the analyser rings, which depends on its sampling rate alone. window_decay:
    decay rate [1/s] of the exponential window; None for as much as ends a decay that the block cuts, 0 for none."""

    double_hit_s: float = 0.1
    double_hit_share: float = 0.03
    ringing_samples: float = 5.0
    level_ratio: float = 3.0
    block_min_s: float = 0.4
    block_max_s: float = 4.0
    moving_share: float = 0.1
    coherence_min: float = 0.9
    force_range_N: float | None = None
    window_decay: float | None = None


@dataclass(frozen=True)
class Impact:
    """Impact of the hammer: samples `start` (force leaves its noise), `peak`, `end` (back in it); `fault`: None if it
    is good."""

    start: int
    peak: int
    end: int
    force_N: float
    fault: str | None = None
    detail: str = ""

    @property
    def good(self) -> bool:
        return self.fault is None

    def aside(self, fault: str, detail: str) -> "Impact":
        """Return the same impact set aside; the first fault found is kept."""
        return self if self.fault else replace(self, fault=fault, detail=detail)


def ringing(fs: float, rules: ImpactRules) -> float:
    """Return the time for which a filter rings after a hit, in samples at fs [Hz]."""
    return max(_RINGING_s * fs, rules.ringing_samples)


def upright(force: Array) -> Array:
    """Return the force (N,) without its offset (the median), hits positive whatever the sensor's polarity."""
    centred = force - np.median(force)
    return centred if _points_up(centred) else -centred


def is_upright(force: Array) -> bool:
    """Return whether the hits in a force (N,) are positive."""
    return _points_up(force - np.median(force))


def _points_up(centred: Array) -> bool:
    return bool(centred.max() >= -centred.min())


def find_impacts(upward: Array, fs: float, rules: ImpactRules) -> tuple[Impact, ...]:
    """Return the impacts in an upright force (N,) [N] sampled at fs [Hz], in time order, each with its fault.

    Faults found here: double hit, overload (flat top, or the stated range), too close to the next impact or to an end
    of the record, off level. `hammer.analyse` finds the faults of the response."""
    sigma = float(1.4826 * np.median(np.abs(upward)))  # median absolute deviation: the hits do not count
    level = max(_FOUND_SIGMAS * sigma, _FOUND_SHARE * float(upward.max()))
    above = np.flatnonzero(upward > level)
    if above.size == 0:
        return ()
    reach = max(round(rules.double_hit_s * fs), 1)
    groups = np.split(above, np.flatnonzero(np.diff(above) > reach) + 1)
    impacts = [_impact(upward, group, sigma, reach) for group in groups]
    impacts = [_double_hit(upward, i, sigma, fs, rules) for i in impacts]
    impacts = _overloads(upward, impacts, rules)
    return tuple(off_level(_too_close(impacts, upward.size, fs, rules), rules))


def _impact(upward: Array, group: NDArray[np.intp], sigma: float, reach: int) -> Impact:
    peak = int(group[np.argmax(upward[group])])
    floor = max(3.0 * sigma, 0.01 * float(upward[peak]))
    start = _last_below(upward, int(group[0]), floor, reach)
    return Impact(start, peak, _first_below(upward, peak, floor, reach), float(upward[peak]))


def _first_below(x: Array, at: int, level: float, reach: int) -> int:
    part = x[at : at + reach]
    return at + (int(np.argmax(part < level)) if (part < level).any() else part.size)


def _last_below(x: Array, at: int, level: float, reach: int) -> int:
    part = x[max(at - reach, 0) : at][::-1]
    return at - (int(np.argmax(part < level)) + 1 if (part < level).any() else part.size)


def _double_hit(upward: Array, impact: Impact, sigma: float, fs: float, rules: ImpactRules) -> Impact:
    span = round(rules.double_hit_s * fs)
    first = max(impact.peak - span, 0)
    part = upward[first : impact.peak + span]
    away = np.abs(np.arange(part.size) + first - impact.peak)
    share = np.where(away <= ringing(fs, rules), _RINGING_SHARE, rules.double_hit_share)
    height = np.maximum(share * impact.force_N, 8.0 * sigma)
    others = first + peaks(part, 0.5 * height.min(), height=height)
    lo, hi = half_height(upward, impact)
    others = others[(others < lo) | (others > hi)]
    if others.size == 0:
        return impact
    second = others[np.argmax(upward[others])]
    percent, gap_ms = 100.0 * upward[second] / impact.force_N, 1e3 * abs(second - impact.peak) / fs
    return impact.aside(DOUBLE, f"a second peak of {percent:.0f} % at {gap_ms:.1f} ms")


def half_height(upward: Array, impact: Impact) -> tuple[int, int]:
    """Return the first and the last sample of the pulse above half its peak."""
    half, reach = 0.5 * impact.force_N, impact.end - impact.start + 1
    lo = min(_last_below(upward, impact.peak, half, reach) + 1, impact.peak)
    return lo, max(_first_below(upward, impact.peak, half, reach) - 1, impact.peak)


def _overloads(upward: Array, impacts: Sequence[Impact], rules: ImpactRules) -> list[Impact]:
    """Set the fault of overloaded impacts: flat tops, peaks at the stated range, peaks of the same largest value."""
    largest = max(i.force_N for i in impacts)
    shared = sum(i.force_N == largest for i in impacts) > 1
    out = []
    for i in impacts:
        top = _flat_top(upward, i)
        if top:
            out.append(i.aside(OVERLOAD, f"{top} samples flat at {i.force_N:.4g} N"))
        elif shared and i.force_N == largest:
            out.append(i.aside(OVERLOAD, f"several peaks end at exactly {i.force_N:.4g} N"))
        elif rules.force_range_N is not None and i.force_N >= 0.98 * rules.force_range_N:
            out.append(i.aside(OVERLOAD, f"{i.force_N:.4g} N, range {rules.force_range_N:g} N"))
        else:
            out.append(i)
    return out


def _flat_top(upward: Array, impact: Impact) -> int:
    """Return the number of samples of a flat top, 0 if the pulse is round. A half sine has 10 % of its half-height
    width within 0.5 % of its peak; narrow pulses, of few samples, count as flat only when samples are exactly equal."""
    lo, hi = half_height(upward, impact)
    pulse = upward[lo : hi + 1]
    equal = int(np.sum(pulse >= impact.force_N * (1.0 - 1e-9)))
    near = int(np.sum(pulse >= 0.995 * impact.force_N))
    if near >= 3 and near >= 0.25 * pulse.size:
        return near
    return equal if equal >= 2 else 0


def available(impacts: Sequence[Impact], n: int, fs: float) -> NDArray[np.intp]:
    """Return the number of samples from each impact's start to just before the next impact, or to the record's end."""
    gap = round(_RINGING_s * fs)
    starts = np.array([i.start for i in impacts])
    lengths: NDArray[np.intp] = np.append(starts[1:] - gap, n) - starts
    return lengths


def _too_close(impacts: Sequence[Impact], n: int, fs: float, rules: ImpactRules) -> list[Impact]:
    have = available(impacts, n, fs)
    need = max(rules.block_min_s * fs, 0.5 * min(float(np.median(have)), rules.block_max_s * fs))
    out = []
    for k, (impact, samples) in enumerate(zip(impacts, have, strict=True)):
        what = "the record ends" if k == len(impacts) - 1 else "the next impact comes"
        if impact.start < _RINGING_s * fs:
            impact = impact.aside(CLOSE, "the record starts within the hit")
        if samples < need:
            impact = impact.aside(CLOSE, f"{what} after {samples / fs:.2f} s, needed {need / fs:.2f} s")
        out.append(impact)
    return out


def off_level(impacts: Sequence[Impact], rules: ImpactRules) -> list[Impact]:
    """Set aside impacts much above or below the median of the good ones."""
    good = [i.force_N for i in impacts if i.good]
    if not good:
        return list(impacts)
    typical = float(np.median(good))
    lo, hi = typical / rules.level_ratio, typical * rules.level_ratio
    return [
        i
        if lo <= i.force_N <= hi
        else i.aside(LEVEL, f"{i.force_N:.3g} N is {i.force_N / typical:.2g} times the median {typical:.3g} N")
        for i in impacts
    ]


def tally(impacts: Sequence[Impact]) -> str:
    """Return a summary as '2 of 6 impacts good: 4 double hits'."""
    faults = Counter(i.fault for i in impacts if i.fault)
    good = sum(i.good for i in impacts)
    listed = ", ".join(f"{n} {_PLURAL.get(fault, fault) if n > 1 else fault}" for fault, n in faults.most_common())
    return f"{good} of {len(impacts)} impacts good" + (f": {listed}" if listed else "")


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
