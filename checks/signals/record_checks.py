"""Checks of a record before any physics: dead channels, sample offset, polarity, channels that were exchanged.

They detect: a channel that does not move, or moves without the drive; the delay and the sign of one channel against
another if both follow one lightly damped structure; channels whose size or finest step belongs to the other. Two
channels of equal size and step that both follow the drive cannot be distinguished here; the gap workflow can."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.cause import Cause, Reason, because
from checks.distributions import chi2
from checks.signals.spectral.frf import Frf, quantile

CHANCE = 1e-3  # probability that a channel without any response is called alive, over all bins
STRUCTURE_RAD = 0.03  # phase by which damping departs from 0 or 180 degrees away from resonances
MAX_SAMPLES = 50.0  # of delay that is looked for: 5 ms at 10 kHz
FLICKER = 3  # values between which the last digit of a converter changes if nothing is connected


@dataclass(frozen=True)
class ChannelDelay:
    """Delay of a channel behind a reference. samples: positive if it comes later; sd: its standard deviation.

    polarity : +1, -1, or 0 if the sign changes within the band (a zero or a resonance of only one of the two).
    seen : False if the band holds too little common signal; then samples and sd are NaN."""

    channel: str
    reference: str
    samples: float
    sd: float
    polarity: int
    seen: bool
    words: str


@dataclass(frozen=True)
class ExpectedSignal:
    """Expected looks of a channel: largest departure from its median within lo..hi, finest step (None: unknown), in its
    unit."""

    lo: float
    hi: float
    step: float | None = None


def delay(frf: Frf, channel: str, fs: float, f_lo: float, f_hi: float) -> ChannelDelay:
    """Return a channel's delay behind the input of frf, from its phase over f_lo..f_hi [Hz], in samples of fs [Hz].

    Between two points of a lightly damped structure the response is real but for the delay: its phase is 0 or 180
    degrees. So twice the phase is fitted by a line through 0, coarsely by the best of a grid of +-50 samples, then by
    weighted least squares that give little weight to bins off the line (resonances). sd includes the noise and the
    spread about the line. A fraction of a sample may still be physics (an amplifier's pole, damping of close modes),
    which only a model can distinguish."""
    part = frf.band(f_lo, f_hi).select(channel)
    part = part.independent()
    good = part.usable & _significant(part)[:, 0]
    if np.count_nonzero(good) < 5:
        words = f"{channel} and {frf.input} have too little in common in {f_lo:g}..{f_hi:g} Hz to see a delay"
        return ChannelDelay(channel, frf.input, float("nan"), float("nan"), 0, False, words)
    f, H = part.f[good], part.H[good, 0]
    sigma = np.hypot(np.sqrt(part.var[good, 0] / 2) / np.abs(H), STRUCTURE_RAD)
    turns = f / fs
    tau = _coarse_delay(turns, H, sigma)
    tau, sd = _refine(turns, H, sigma, tau)
    polarity = _sign(H * np.exp(2j * np.pi * turns * tau), sigma)
    return ChannelDelay(
        channel, frf.input, tau, sd, polarity, True, _delay_words(channel, frf.input, tau, sd, polarity)
    )


def _significant(frf: Frf) -> np.ndarray:
    """Return whether each response (F, C) is significant: |H|^2/var follows F(2, 2 nu) if there is no response."""
    limit = quantile(1 - CHANCE / max(1, frf.f.size), frf.nu)[:, None]
    finite = np.isfinite(frf.var) & (np.abs(frf.H) > 0)
    return finite & (np.abs(frf.H) ** 2 > limit * np.where(finite, frf.var, 0.0))


def _coarse_delay(turns: Array, H: np.ndarray, sigma: Array) -> float:
    """Return the delay [samples] on a grid at which the phases agree best, whatever their sign."""
    grid = np.arange(-MAX_SAMPLES, MAX_SAMPLES, min(0.5, 0.05 / float(turns.max())))
    squared = (H / np.abs(H)) ** 2 / sigma**2
    sums = np.exp(4j * np.pi * np.outer(grid, turns)) @ squared
    return float(grid[np.argmax(np.where(sums.real > 0, np.abs(sums), 0.0))])


def _refine(turns: Array, H: np.ndarray, sigma: Array, tau: float) -> tuple[float, float]:
    """Return the delay near tau by weighted least squares of the phase, with Cauchy weights, and its standard
    deviation. The spread about the line widens sd."""
    x = -2 * np.pi * turns
    for _ in range(20):
        left = np.angle((H * np.exp(-1j * x * tau)) ** 2) / 2
        weight = 1 / sigma**2 / (1 + (left / (2.4 * sigma)) ** 2)
        tau += float(np.sum(weight * x * left) / np.sum(weight * x * x))
    spread = max(1.0, float(np.sum(weight * left**2) / max(1, x.size - 1)))
    return tau, float(np.sqrt(spread / np.sum(weight * x * x)))


def _sign(H: np.ndarray, sigma: Array) -> int:
    """Return the sign that 95 % of the weight agrees on, else 0."""
    share = float(np.sum(np.sign(H.real) / sigma**2) / np.sum(1 / sigma**2))
    return int(np.sign(share)) if abs(share) > 0.9 else 0


def _delay_words(channel: str, reference: str, tau: float, sd: float, polarity: int) -> str:
    when = "behind" if tau >= 0 else "ahead of"
    sign = {1: "same sign", -1: "opposite sign", 0: "sign changes within the band"}[polarity]
    early = "; it comes before its cause: exchanged, or stored with an offset" if tau < -max(0.5, 4 * sd) else ""
    return f"{channel} is {abs(tau):.2f} ± {max(2 * sd, 0.01):.2f} samples {when} {reference}, {sign}{early}"


def dead(channel: str, x: Array, frf: Frf | None = None) -> tuple[Reason, ...]:
    """Return the reasons why x (N,) measures nothing: it does not move by more than its finest step, or, if a response
    is given, not with the drive. Empty if the channel is alive."""
    levels = np.unique(x)
    if not np.isfinite(levels).all() or levels.size == 0:
        return (because(Cause.CHANNEL_EMPTY, channel=channel),)
    if levels.size == 1:
        return (because(Cause.CHANNEL_CONSTANT, channel=channel, value=levels[0], unit=""),)
    if levels.size <= FLICKER:
        return (because(Cause.CHANNEL_DEAD, channel=channel, levels=int(levels.size)),)
    if frf is not None and not responds(frf, channel):
        return (because(Cause.CHANNEL_NOT_DRIVEN, channel=channel, reference=frf.input),)
    return ()


def responds(frf: Frf, channel: str) -> bool:
    """Return whether a channel follows the input: clearly in one bin (Bonferroni), or a little in many (Fisher)."""
    part = frf.independent().select(channel)
    driven = part.usable & (part.var[:, 0] > 0)
    if (part.usable & (part.var[:, 0] == 0) & (np.abs(part.H[:, 0]) > 0)).any():
        return True  # a response without any noise
    ratio = np.abs(part.H[driven, 0]) ** 2 / part.var[driven, 0]
    log_p = -part.nu[driven] * np.log1p(ratio / part.nu[driven])
    if log_p.size == 0:
        return False
    single = log_p.size * np.exp(log_p.min())
    return bool(min(single, chi2.sf(-2 * log_p.sum(), 2 * log_p.size)) < CHANCE / 2)


def finest_step(x: Array) -> float | None:
    """Return the step of the grid on which all values of x (N,) lie, or None if no grid is seen."""
    steps = np.diff(np.unique(x))
    scale = float(np.max(np.abs(x), initial=0.0))
    steps = steps[steps > 1e-9 * scale]  # values that differ by rounding are one
    if steps.size < 2:
        return None
    smallest = float(steps.min())
    step = float(np.mean(steps / np.round(steps / smallest)))
    off = np.abs(steps / step - np.round(steps / step))
    return step if off.max() < 0.02 and float(np.median(steps)) < 100 * step else None


def mismatches(columns: Mapping[str, Array], expected: Mapping[str, ExpectedSignal]) -> tuple[Reason, ...]:
    """Return a reason for each channel unlike its name, and one for each pair that fits when exchanged."""
    names = [n for n in expected if n in columns]
    looks = {n: (float(np.max(np.abs(x - np.median(x)))), finest_step(x)) for n in names for x in (columns[n],)}
    wrong = [n for n in names if not _fits(looks[n], expected[n])]
    reasons: list[Reason] = []
    paired: set[str] = set()
    for a, b in combinations(wrong, 2):
        if not paired & {a, b} and _fits(looks[a], expected[b]) and _fits(looks[b], expected[a]):
            paired |= {a, b}
            evidence = f"{a} looks like {b} and {b} like {a}"
            reasons.append(because(Cause.CHANNELS_EXCHANGED, channel=a, other=b, evidence=evidence))
    return (*reasons, *(_size_reason(n, looks[n], expected[n]) for n in wrong if n not in paired))


def _fits(look: tuple[float, float | None], expected: ExpectedSignal) -> bool:
    size, step = look
    same_step = expected.step is None or step is None or abs(step / expected.step - 1) < 0.05
    return expected.lo <= size <= expected.hi and same_step


def _size_reason(channel: str, look: tuple[float, float | None], expected: ExpectedSignal) -> Reason:
    size, step = look
    if not expected.lo <= size <= expected.hi:
        return because(Cause.CHANNEL_SIZE, channel=channel, value=size, lo=expected.lo, hi=expected.hi)
    return because(Cause.CHANNEL_STEP, channel=channel, value=step, expected=expected.step)


PILED = 5.0  # times the next value: at the crest of a sine two neighbours differ by 2.4, in noise by less
PILED_SAMPLES = 50  # with fewer, equal values may be chance


def overload(channel: str, x: NDArray[np.float64]) -> tuple[Reason, ...]:
    """Return a reason if x (N,) is clipped: its largest or smallest value is far more frequent than the next one. Not
    for a channel that may rest at its extreme, such as a held triangle."""
    for end, ordered in (("largest", -x), ("smallest", x)):
        lowest = float(ordered.min())
        count = int(np.count_nonzero(ordered == lowest))
        if count < PILED_SAMPLES:
            continue
        above = ordered[ordered > lowest]
        beside = int(np.count_nonzero(above == above.min())) if above.size else 0
        if count > PILED * beside:
            at = float(-lowest if end == "largest" else lowest)
            where = f", {beside} the next one"
            return (because(Cause.CHANNEL_CLIPPED, channel=channel, count=count, end=end, value=at, where=where),)
    return ()
