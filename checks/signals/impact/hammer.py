"""Hammer test: from force and response tracks to averaged FRFs with the scatter between the impacts.

Force and exponential windows, and the damping of the latter: [EWINS00] 3.9; [BRANDT11] ch. 13. H1 from impacts: [BP10]
ch. 6; H2 and Hv, and the effect of noise on either side: [ROCKLIN85]."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

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
    off_level,
    tally,
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
    """FRF over K good impacts. f (M,) [Hz]; F [N], Y [response unit] (K, M) windowed spectra; H (M,) = their H1; var
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
        """Return the bins (M,) with a force within 30 dB of the largest: a half sine of width T has none at 1.5/T."""
        power = np.sum(np.abs(self.F) ** 2, axis=0)
        return np.asarray(power >= _DRIVEN * power.max())

    @property
    def coherence(self) -> Array:
        """Return the coherence (M,) in 0..1."""
        cross = np.abs(np.sum(self.Y * self.F.conj(), axis=0)) ** 2
        power = np.sum(np.abs(self.F) ** 2, axis=0) * np.sum(np.abs(self.Y) ** 2, axis=0)
        coherence: Array = np.divide(cross, power, out=np.zeros_like(cross), where=power > 0)
        return coherence

    def estimate(self, estimator: str) -> tuple[Complex, Complex]:
        """Return the response H (M,) by "h1", "h2" or "hv" [response per N], and the contribution of each impact to its
        error (K, M), zero in sum.

        Noise on the force biases H1 low, noise on the response H2 high; Hv is their geometric mean with the phase of
        the cross spectrum, biased by the difference of both ([ROCKLIN85])."""
        F, Y, tiny = self.F, self.Y, np.finfo(float).tiny
        Sff, Syy = (np.maximum(np.sum(np.abs(x) ** 2, axis=0), tiny) for x in (F, Y))
        if estimator == "h1":
            return self.H, (Y - self.H * F) * F.conj() / Sff
        Syf = np.sum(Y * F.conj(), axis=0)
        inverse = Syf.conj() / np.maximum(np.abs(Syf) ** 2, tiny)
        if estimator == "h2":
            H2: Complex = Syy * inverse.conj()
            return H2, (Y - H2 * F) * Y.conj() * inverse.conj()
        Hv: Complex = np.sqrt(Syy / Sff) * np.exp(1j * np.angle(Syf))
        size = 0.5 * (np.abs(Y) ** 2 / Syy - np.abs(F) ** 2 / Sff)
        return Hv, Hv * (size + 1j * (Y * F.conj() * inverse).imag)


@dataclass(frozen=True, eq=False)
class HammerTest:
    """Impacts, good or with their fault, the FRF of the good ones (None if there are fewer than two), and the force."""

    impacts: tuple[Impact, ...]
    frf: ImpactFrf | None
    force: Array  # (N,) [N] without offset, hits positive

    @property
    def good(self) -> int:
        return sum(i.good for i in self.impacts)


@dataclass(frozen=True, eq=False)
class HammerTests:
    """Impacts of each record, good or with their fault; the FRF of each response over all good ones, none for fewer
    than two; the force of each record as of `HammerTest`."""

    impacts: tuple[tuple[Impact, ...], ...]
    frfs: tuple[ImpactFrf, ...]
    forces: tuple[Array, ...]

    @property
    def tally(self) -> str:
        """Return how many impacts of all records were good, in words."""
        return tally(self.all_impacts)

    @property
    def all_impacts(self) -> tuple[Impact, ...]:
        return tuple(chain.from_iterable(self.impacts))

    @property
    def good(self) -> int:
        return sum(i.good for i in self.all_impacts)


def analyse(
    force: Array,
    response: Array,
    fs: float,
    rules: ImpactRules | None = None,
    band_Hz: tuple[float, float] = (0.0, np.inf),
) -> HammerTest:
    """Return the averaged FRF of a hammer test with one record and one response.

    force (N,) [N], response (N,), sampled together at fs [Hz]; band_Hz: the band in which impacts must agree with one
    another. Raises ValueError if the tracks differ in length, are not finite, or do not move at all."""
    found = analyse_records([(force, (response,))], fs, rules, band_Hz)
    return HammerTest(found.impacts[0], found.frfs[0] if found.frfs else None, found.forces[0])


def analyse_records(
    records: Sequence[tuple[Array, Sequence[Array]]],
    fs: float,
    rules: ImpactRules | None = None,
    band_Hz: tuple[float, float] = (0.0, np.inf),
) -> HammerTests:
    """Return the averaged FRFs of a hammer test in one or several records.

    records: force (N,) [N] and the responses (N,) of each, the same responses in every record, all sampled at fs [Hz].
    An impact that is bad in one response is set aside in all. Raises ValueError as `analyse`."""
    rules = rules or ImpactRules()
    for force, responses in records:
        for response in responses:
            _check_tracks(force, response)
    records = [(upright(force), responses) for force, responses in records]
    impacts = [_impacts_of(force, responses, fs, rules) for force, responses in records]
    if len(records) > 1:  # off the level of the hits of all records
        levelled = iter(off_level(list(chain.from_iterable(impacts)), rules))
        impacts = [[next(levelled) for _ in found] for found in impacts]
    while True:
        good = [(r, k) for r, found in enumerate(impacts) for k, i in enumerate(found) if i.good]
        frfs = _averages(records, impacts, fs, rules) if len(good) > 1 else ()
        worst, agreement = _least_agreeing(frfs, band_Hz, rules) if frfs else (0, 1.0)
        if agreement >= rules.coherence_min or not frfs:
            return HammerTests(tuple(map(tuple, impacts)), frfs, tuple(force for force, _ in records))
        r, k = good[worst]
        words = f"{agreement:.2f} with the others, needed {rules.coherence_min:g}"
        impacts[r][k] = impacts[r][k].aside(COHERENCE, words)


def _impacts_of(force: Array, responses: Sequence[Array], fs: float, rules: ImpactRules) -> list[Impact]:
    """Return the impacts of a record, force upright, with the faults that its force and its responses show."""
    impacts = list(find_impacts(force, fs, rules))
    if not impacts:
        return []
    impacts = _set_aside_moving(responses, impacts, fs, rules)
    for response in responses:
        impacts = _set_aside_clipped(response, impacts)
    return impacts


def _check_tracks(force: Array, response: Array) -> None:
    if force.ndim != 1 or force.shape != response.shape or force.size < 2:
        raise ValueError(f"force {force.shape} and response {response.shape} must be two tracks of one length")
    for name, track in (("force", force), ("response", response)):
        bad = np.flatnonzero(~np.isfinite(track))
        if bad.size:
            raise ValueError(f"{name} is {track[bad[0]]} at sample {bad[0]} ({bad.size} such samples)")
        if np.ptp(track) == 0.0:
            raise ValueError(f"{name} is constant at {track[0]:g}")


def _set_aside_moving(
    responses: Sequence[Array], impacts: Sequence[Impact], fs: float, rules: ImpactRules
) -> list[Impact]:
    """Set aside impacts on a structure that still moves, from the hit before or from its surroundings. The response
    that moves least before the hit decides: one that the hits do not excite is always noise."""
    span = round(_BASELINE_s * fs)
    out = []
    for i in impacts:
        shares = []
        for response in responses:
            before, after = response[max(i.start - span, 0) : i.start], response[i.start : i.start + span]
            shares.append(float(np.std(before) / np.std(after)) if before.size > 1 and np.ptp(after) > 0 else 0.0)
        if min(shares) > rules.moving_share:
            i = i.aside(MOVING, f"{100 * min(shares):.0f} % of the response before the hit")
        out.append(i)
    return out


def _set_aside_clipped(response: Array, impacts: Sequence[Impact]) -> list[Impact]:
    """Set aside impacts whose response stays at the track's largest or smallest value: beyond its range."""
    at_limit = (response == response.max()) | (response == response.min())
    runs = at_limit[:-2] & at_limit[1:-1] & at_limit[2:]
    ends = [*(i.start for i in impacts[1:]), response.size]
    return [
        i.aside(OVERLOAD, "the response is clipped") if runs[i.start : end].any() else i
        for i, end in zip(impacts, ends, strict=True)
    ]


def _averages(
    records: Sequence[tuple[Array, Sequence[Array]]],
    impacts: Sequence[Sequence[Impact]],
    fs: float,
    rules: ImpactRules,
) -> tuple[ImpactFrf, ...]:
    """Return the FRF of each response over the good impacts of all records, by windowed blocks of one length.

    The slowest decay determines the exponential window of all responses."""
    pre, span = round(_PRE_s * fs), round(_BASELINE_s * fs)
    lengths = [
        int(have)
        for (force, _), found in zip(records, impacts, strict=True)
        if found
        for i, have in zip(found, available(found, force.size, fs), strict=True)
        if i.good
    ]
    n = min(round(rules.block_max_s * fs), *lengths)
    good = [(record, i) for record, found in zip(records, impacts, strict=True) for i in found if i.good]
    starts = [max(i.start - pre, 0) for _, i in good]
    blocks = np.stack(
        [force[s : s + n] * _force_window(i, s, n, fs, rules) for ((force, _), i), s in zip(good, starts, strict=True)]
    )
    responses, decays = [], []
    for c in range(len(records[0][1])):
        tracks = [track[c] for (_, track), _ in good]
        before = [x[max(i.start - span, 0) : i.start] for x, (_, i) in zip(tracks, good, strict=True)]
        Y = np.stack([x[s : s + n] - np.mean(b) for x, s, b in zip(tracks, starts, before, strict=True)])
        # The quietest of them: before the others the decay of the last hit may still be there.
        decays.append(exponential_decay(Y, min(float(np.std(b)) for b in before), fs))
        responses.append(Y)
    decay = max(decays) if rules.window_decay is None else rules.window_decay
    window = np.exp(-decay * np.arange(n) / fs)
    return tuple(_average(blocks * window, Y * window, decay, fs) for Y in responses)


def _force_window(impact: Impact, start: int, n: int, fs: float, rules: ImpactRules) -> Array:
    """Return the force window: one over the hit and its filter's ringing, then a cosine to zero: noise is not force."""
    rings = max(round(2 * _TAPER_s * fs), round(2 * rules.ringing_samples))
    hold = impact.end - start + max(2 * (impact.end - impact.start), rings)
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


def _least_agreeing(frfs: Sequence[ImpactFrf], band_Hz: tuple[float, float], rules: ImpactRules) -> tuple[int, float]:
    """Return the index and agreement of the impact that the others' FRF predicts worst, over all responses.

    A response in which most impacts disagree is not excited by them. It sets none aside, unless it is the only one."""
    agreements = np.array([_agreement(frf, band_Hz) for frf in frfs])
    excited = np.median(agreements, axis=1) >= rules.coherence_min
    lowest = np.min(agreements[excited] if excited.any() else agreements, axis=0)
    worst = int(np.argmin(lowest))
    return worst, float(lowest[worst])


def _agreement(frf: ImpactFrf, band_Hz: tuple[float, float]) -> Array:
    """Return the agreement (K,) of each impact with the FRF of the others: the coherence over the band's energy."""
    inside = (band_Hz[0] <= frf.f) & (frf.f <= band_Hz[1])
    F, Y = frf.F[:, inside], frf.Y[:, inside]
    cross, power = Y * F.conj(), np.abs(F) ** 2
    others = (cross.sum(axis=0) - cross) / (power.sum(axis=0) - power)
    predicted = others * F
    overlap = np.abs(np.sum(Y * predicted.conj(), axis=1)) ** 2
    energy = np.sum(np.abs(Y) ** 2, axis=1) * np.sum(np.abs(predicted) ** 2, axis=1)
    agreement: Array = np.divide(overlap, energy, out=np.zeros_like(overlap), where=energy > 0)
    return agreement
