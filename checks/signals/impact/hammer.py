"""Hammer test: from a force and a response track to an averaged FRF with the scatter between the impacts.

Force and exponential windows, and the damping that the latter adds: [EWINS00] 3.9; [BRANDT11] ch. 13. H1 from impacts:
[BP10] ch. 6.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from checks.arrays import Array, Complex
from checks.signals.impact.impacts import (
    COHERENCE,
    MOVING,
    OVERLOAD,
    Impact,
    ImpactRules,
    available,
    find_impacts,
    upright,
)

_PRE_s = 0.001  # of a block before the hit
_TAPER_s = 0.001
_BASELINE_s = 0.1  # before the hit: offset of the response, and whether it is at rest
_TAIL = 0.1  # of a block: where the decay must have ended
_CUT_SHARE = 0.005  # a decay above this share of its start at the block's end is cut
_CUT_TARGET = 0.001  # and is brought down to this share
_DRIFT_SIGMAS = 3.0
_DRIVEN = 1e-3  # of the largest power, 30 dB down: below, the hammer drives nothing


@dataclass(frozen=True, eq=False)
class ImpactFrf:
    """FRF over K good impacts. f (M,) [Hz]; F [N], Y [response unit] (K, M) windowed spectra; H (M,) = H1 of them; var
    (M,) variance of H (total complex) from the scatter between impacts; added_decay [1/s] the decay rate that the
    exponential window added to every mode (0 without such a window)."""

    f: Array
    F: Complex
    Y: Complex
    H: Complex
    var: Array
    added_decay: float

    @property
    def count(self) -> int:
        return len(self.F)

    @property
    def df(self) -> float:
        return float(self.f[1] - self.f[0])

    @property
    def driven(self) -> NDArray[np.bool_]:
        """Return the bins (M,) in which the force has power, at most 30 dB below its largest: a half sine of width T
        has none about 1.5/T."""
        power = np.sum(np.abs(self.F) ** 2, axis=0)
        return np.asarray(power >= _DRIVEN * power.max())

    @property
    def coherence(self) -> Array:
        """Return the coherence (M,) in 0..1."""
        cross = np.abs(np.sum(self.Y * self.F.conj(), axis=0)) ** 2
        power = np.sum(np.abs(self.F) ** 2, axis=0) * np.sum(np.abs(self.Y) ** 2, axis=0)
        coherence: Array = np.divide(cross, power, out=np.zeros_like(cross), where=power > 0)
        return coherence


@dataclass(frozen=True, eq=False)
class HammerTest:
    """Impacts, good or with their fault, the FRF of the good ones (None if there are fewer than two), and the force."""

    impacts: tuple[Impact, ...]
    frf: ImpactFrf | None
    force: Array  # (N,) [N] without offset, hits positive

    @property
    def good(self) -> int:
        return sum(i.good for i in self.impacts)


def analyse(
    force: Array,
    response: Array,
    fs: float,
    rules: ImpactRules | None = None,
    band_Hz: tuple[float, float] = (0.0, np.inf),
) -> HammerTest:
    """Return the averaged FRF of a hammer test.

    force (N,) [N], response (N,), sampled together at fs [Hz]; band_Hz: the band in which impacts must agree with one
    another. Raises ValueError if the tracks differ in length, are not finite, or do not move at all."""
    _usable(force, response)
    rules = rules or ImpactRules()
    upward = upright(force)
    found = find_impacts(upward, fs, rules)
    if not found:
        return HammerTest((), None, upward)
    impacts = _clipped(response, _at_rest(response, found, fs, rules))
    while True:
        chosen = [k for k, i in enumerate(impacts) if i.good]
        if len(chosen) < 2:
            return HammerTest(tuple(impacts), None, upward)
        frf = _average(*_blocks(upward, response, impacts, fs, rules), fs)
        worst, agreement = _least_agreeing(frf, band_Hz)
        if agreement >= rules.coherence_min:
            return HammerTest(tuple(impacts), frf, upward)
        k = chosen[worst]
        impacts[k] = impacts[k].aside(COHERENCE, f"{agreement:.2f} with the others, needed {rules.coherence_min:g}")


def _usable(force: Array, response: Array) -> None:
    if force.ndim != 1 or force.shape != response.shape or force.size < 2:
        raise ValueError(f"force {force.shape} and response {response.shape} must be two tracks of one length")
    for name, track in (("force", force), ("response", response)):
        bad = np.flatnonzero(~np.isfinite(track))
        if bad.size:
            raise ValueError(f"{name} is {track[bad[0]]} at sample {bad[0]} ({bad.size} such samples)")
        if np.ptp(track) == 0.0:
            raise ValueError(f"{name} is constant at {track[0]:g}")


def _at_rest(response: Array, impacts: Sequence[Impact], fs: float, rules: ImpactRules) -> list[Impact]:
    """Set aside impacts on a structure that still moves from the hit before or from its surroundings."""
    span = round(_BASELINE_s * fs)
    out = []
    for i in impacts:
        before = response[max(i.start - span, 0) : i.start]
        after = response[i.start : i.start + span]
        share = float(np.std(before) / np.std(after)) if before.size > 1 and np.ptp(after) > 0 else 0.0
        if share > rules.moving_share:
            i = i.aside(MOVING, f"{100 * share:.0f} % of the response before the hit")
        out.append(i)
    return out


def _clipped(response: Array, impacts: Sequence[Impact]) -> list[Impact]:
    """Set aside impacts whose response stands still at the track's largest or smallest value: beyond its range."""
    at_limit = (response == response.max()) | (response == response.min())
    runs = at_limit[:-2] & at_limit[1:-1] & at_limit[2:]
    ends = [*(i.start for i in impacts[1:]), response.size]
    return [
        i.aside(OVERLOAD, "the response is clipped") if runs[i.start : end].any() else i
        for i, end in zip(impacts, ends, strict=True)
    ]


def _blocks(
    upward: Array, response: Array, impacts: Sequence[Impact], fs: float, rules: ImpactRules
) -> tuple[Array, Array, float]:
    """Return the windowed blocks of the good impacts: force, response (K, n), and the decay [1/s] of the exponential
    window."""
    pre, span = round(_PRE_s * fs), round(_BASELINE_s * fs)
    have = available(impacts, upward.size, fs)
    n = min(round(rules.block_max_s * fs), *(int(have[k]) for k, i in enumerate(impacts) if i.good))
    good = [i for i in impacts if i.good]
    starts = [max(i.start - pre, 0) for i in good]
    rest = [float(np.mean(response[max(i.start - span, 0) : i.start])) for i in good]
    F = np.stack([upward[s : s + n] * _force_window(i, s, n, fs) for i, s in zip(good, starts, strict=True)])
    Y = np.stack([response[s : s + n] - offset for s, offset in zip(starts, rest, strict=True)])
    # The quietest of them: before the others the decay of the last hit may still be there.
    noise = min(float(np.std(response[max(i.start - span, 0) : i.start])) for i in good)
    decay = exponential_decay(Y, noise, fs)
    window = np.exp(-decay * np.arange(n) / fs)
    return F * window, Y * window, decay


def _force_window(impact: Impact, start: int, n: int, fs: float) -> Array:
    """Return the force window: one over the hit and the ringing of the anti-alias filter after it, then a cosine to
    zero: the noise of the force sensor is not force."""
    hold = impact.end - start + max(2 * (impact.end - impact.start), round(2 * _TAPER_s * fs))
    fall = max(round(_TAPER_s * fs), 1)
    k = np.arange(n)
    return np.where(k < hold, 1.0, 0.5 + 0.5 * np.cos(np.pi * np.clip((k - hold) / fall, 0.0, 1.0)))


def exponential_decay(Y: Array, noise: float, fs: float) -> float:
    """Return the decay rate [1/s] of the exponential window that ends a cut decay; 0 if the decay ends by itself.

    Y (K, n) responses without offset; noise: standard deviation of the response at rest."""
    n = Y.shape[1]
    part = max(round(_TAIL * n), 1)
    first, last = (float(np.sqrt(np.mean(Y[:, s] ** 2))) for s in (slice(0, part), slice(n - part, n)))
    if first == 0.0 or last < _CUT_SHARE * first or last < _DRIFT_SIGMAS * noise:
        return 0.0
    return float(np.log(last / first / _CUT_TARGET) * fs / n)


def _average(force: Array, response: Array, decay: float, fs: float) -> ImpactFrf:
    F, Y = fft.rfft(force), fft.rfft(response)
    S = np.maximum(np.sum(np.abs(F) ** 2, axis=0), np.finfo(float).tiny)
    H = np.sum(Y * F.conj(), axis=0) / S
    scatter = np.sum(np.abs(Y - H * F) ** 2, axis=0) / (F.shape[0] - 1)
    return ImpactFrf(fft.rfftfreq(force.shape[1], 1 / fs), F, Y, H, scatter / S, decay)


def _least_agreeing(frf: ImpactFrf, band_Hz: tuple[float, float]) -> tuple[int, float]:
    """Return the index and agreement (coherence over the band's energy) of the impact that the others' FRF predicts
    worst."""
    inside = (band_Hz[0] <= frf.f) & (frf.f <= band_Hz[1])
    F, Y = frf.F[:, inside], frf.Y[:, inside]
    cross, power = Y * F.conj(), np.abs(F) ** 2
    others = (cross.sum(axis=0) - cross) / (power.sum(axis=0) - power)
    predicted = others * F
    overlap = np.abs(np.sum(Y * predicted.conj(), axis=1)) ** 2
    energy = np.sum(np.abs(Y) ** 2, axis=1) * np.sum(np.abs(predicted) ** 2, axis=1)
    agreement = np.divide(overlap, energy, out=np.zeros_like(overlap), where=energy > 0)
    worst = int(np.argmin(agreement))
    return worst, float(agreement[worst])
