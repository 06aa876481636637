"""Faults of sampling, seen in a record before any model: clipped or held values, lost samples, a clock that jitters,
clocks that run apart.

Such a fault is not a linear effect of the strut or its bench, and each leads to responses that look sound but are
noisier, or have poles without a resonance. Two tests find them. The part that the drive does not explain, block by
block of the spectrum and each block over its own power, is even in time for any linear system in noise; a burst in it
marks a disturbance. And a sample can be predicted from those before it up to the noise; a much larger error marks a cut
in the series."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from weakref import WeakKeyDictionary

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from checks.arrays import Array, Complex
from checks.cause import Cause, Reason, because
from checks.record import Record
from checks.signals.clock_drift import clock_drifts
from checks.signals.record_checks import dead, overload
from checks.signals.spectral.segments import hann
from checks.signals.spectral.unexplained import SHARE, DrivePart, blocks, power
from specs.units import CHANNEL_LABELS

OUTPUTS = ("Vs", "de", "da")
# Equal samples in a row: at the turns of a signal that is coarsely quantised some follow each other, with the longest
# run of 1e5 no more than three times as long as that of each thousand.
HELD_SAMPLES, HELD_BY = 12, 5.0
STARTS_WITH = 1000  # samples
MOVING = 0.1  # of its standard deviation: the drive is not at rest
SLOT = 64  # samples over which the power shows a burst
BURST = 2.5  # times the median over all slots; 1.4 on sound records, and 3 and more for two lost samples
AHEAD = 12  # samples from which the next one is predicted
TRAINED_ON = 8000
JUMP, SURE_JUMP = 10.0, 30.0  # standard deviations of the prediction error; 5.5 on sound records
ABOUT = 8  # stretches to one side that give the local prediction error
CREST = 3  # equal samples at the extreme; two neighbours are so at the crest of any sine
TOGETHER = 4  # samples within which channels jump at once
CORRELATED = 4096  # samples of a segment in which a shift is looked for
SHIFT_STANDS_OUT = 8.0  # standard deviations of the correlation
DISTURBED = 0.5  # of a channel's standard deviation that the drive does not explain of some of its samples
SPREAD = 8 * SLOT  # samples about a burst in which it may have begun
UNEXPLAINED = 0.1  # of the power at its largest: a shift within the record leaves more
PART = 16  # samples whose motion and error are compared
ALIKE = 0.2  # of a drift: all channels that have it stand against the drive
JITTER_s = 1.5e-6  # a clock has below 0.1 us; 2 us take 2 % of a response at 2 kHz away as noise
JITTER_SURE = 10.0  # standard deviations
JITTER_SHARE = 0.1  # of the residual: below, jitter does not matter


@dataclass(frozen=True, eq=False)
class _Look:
    """Channels of a record, the drive first, the blocks of the others and the part that the drive does not explain."""

    record: Record
    drive: str
    part: DrivePart
    whole: dict[str, Complex]
    left: dict[str, Complex]
    found: dict[str, Array] = field(default_factory=dict)  # prediction errors, by channel

    @property
    def channels(self) -> tuple[str, ...]:
        return (self.drive, *self.left)

    def prediction_error(self, channel: str) -> Array:
        """Return the error of predicting each sample (N,) from those before it, in local standard deviations."""
        if channel not in self.found:
            self.found[channel] = _prediction_errors(self.record[channel])
        return self.found[channel]


_KNOWN: WeakKeyDictionary[Record, dict[str, tuple[Reason, ...]]] = WeakKeyDictionary()


def sampling_faults(record: Record, drive: str = "Va", outputs: Sequence[str] = OUTPUTS) -> tuple[Reason, ...]:
    """Return the reasons why a record must not be used for any comparison; empty if it is sound. Dead channels are not
    examined: a constant value is no fault of sampling.

    Cached by record, since several checks use the same one."""
    cached = _KNOWN.setdefault(record, {})
    there = [(c, record[c]) for c in outputs if c in record.channels]
    # the whole is sorted only if its start stands still
    moves = tuple(c for c, x in there if not (dead(c, x[:STARTS_WITH]) and dead(c, x)))
    key = " ".join((drive, *moves))
    if key not in cached:
        cached[key] = _faults(record, drive, moves) if drive in record.channels else ()
    return cached[key]


def _faults(record: Record, drive: str, outputs: Sequence[str]) -> tuple[Reason, ...]:
    clipped = [reason for c in outputs for reason in overload(c, record[c])]
    if clipped:
        return tuple(clipped)
    held = [reason for c in outputs for reason in _hold_faults(record, c, drive)]
    if held:
        return tuple(held)
    part = DrivePart.of(record[drive]) if np.ptp(record[drive]) > 0.0 else None
    moving = [c for c in outputs if np.ptp(record[c]) > 0.0]
    if part is None or not moving:
        return ()
    whole = {c: blocks(record[c], part.n) for c in moving}
    look = _Look(record, drive, part, whole, {c: part.off(X) for c, X in whole.items()})
    return _clock_faults(look) or _loss_faults(look) or _jitter(look)


def _clock_faults(look: _Look) -> tuple[Reason, ...]:
    """Return a reason for each channel whose clock drifts from the drive's; one for the drive if all drift alike."""
    u, seconds = look.record[look.drive], look.record.t.size / look.record.fs
    found = clock_drifts(u, {c: look.record[c] for c in look.left})
    if (
        len(found) > 1
        and len(found) == len(look.left)
        and np.ptp(list(found.values())) < ALIKE * max(map(abs, found.values()))
    ):
        found = {look.drive: found[next(iter(look.left))]}
    other = {look.drive: next(iter(look.left))}
    return tuple(
        because(
            Cause.CLOCKS_APART,
            channel=c,
            reference=other.get(c, look.drive),
            ppm=1e6 * abs(drift),
            grows_us=1e6 * abs(drift) * seconds,
        )
        for c, drift in found.items()
    )


def _hold_faults(record: Record, channel: str, drive: str) -> tuple[Reason, ...]:
    """Return a reason if a channel stays at one value while the drive moves: held, or clipped at its extreme."""
    x, u = record[channel], record[drive]
    i, n, usual = _longest_run(x)
    if n < max(HELD_SAMPLES, HELD_BY * usual) or not np.std(u[i : i + n]) > MOVING * np.std(u):
        return ()
    if x[i] in (x.max(), x.min()):
        return _clipped(channel, x, x[i])
    return (because(Cause.CHANNEL_HELD, channel=channel, count=n, at_s=_at(record, i), value=x[i], reference=drive),)


def _longest_run(x: Array) -> tuple[int, int, int]:
    """Return first sample and length of the longest run of equal values of x (N,), and the length that 999 of 1000 runs
    do not exceed."""
    first = np.concatenate([[0], np.flatnonzero(np.diff(x)) + 1])
    lengths = np.diff(np.concatenate([first, [x.size]]))
    at = int(np.argmax(lengths))
    usual = np.searchsorted(np.cumsum(np.bincount(lengths)), 0.999 * lengths.size)
    return int(first[at]), int(lengths[at]), int(usual)


def _clipped(channel: str, x: Array, value: float) -> tuple[Reason, ...]:
    end, count = "largest" if value == x.max() else "smallest", np.count_nonzero(x == value)
    return (because(Cause.CHANNEL_CLIPPED, channel=channel, count=count, end=end, value=value, where=""),)


def _at(record: Record, sample: int) -> float:
    return float(record.t[sample] - record.t[0])


def _loss_faults(look: _Look) -> tuple[Reason, ...]:
    """Return the reasons if samples are missing in all channels or in one, or if one is disturbed: the part that the
    drive does not explain bursts, or a channel jumps and is late or early from there on."""
    bursts = [sample for E in look.left.values() if (sample := _burst(look.part, E)) is not None]
    if not bursts:
        if not any(_unexplained_share(look, c) > UNEXPLAINED for c in look.left):
            return ()
        cut = {c: int(np.argmax(z)) for c in look.channels if (z := look.prediction_error(c)).max() > SURE_JUMP}
        return _slip_faults(look, cut) if cut else ()
    first, last = max(AHEAD, min(bursts) - SPREAD), max(bursts) + SLOT + SPREAD
    u = look.record[look.drive]
    i, n, _ = _longest_run(u[first:last])
    if n >= max(HELD_SAMPLES, HELD_BY * _longest_run(u)[2]):
        value, at, other = u[first + i], _at(look.record, first + i), next(iter(look.left))
        return (because(Cause.CHANNEL_HELD, channel=look.drive, count=n, at_s=at, value=value, reference=other),)
    cut = {
        c: first + int(np.argmax(z)) for c in look.channels if (z := look.prediction_error(c)[first:last]).max() > JUMP
    }
    if not cut:
        return ()  # a bench that was hit, say: it is in the noise
    return _common_loss(look, cut) or _slip_faults(look, cut) or _disturbance_faults(look, cut, slice(first, last))


def _common_loss(look: _Look, cut: Mapping[str, int]) -> tuple[Reason, ...]:
    """Return a reason if a block is missing in every channel: drive and outputs jump at once. If the drive continues,
    the bench may have been hit."""
    at = cut.get(look.drive)
    together = () if at is None else tuple(c for c, i in cut.items() if abs(i - at) <= TOGETHER)
    if len(together) < 2 or at is None:
        return ()
    names = ", ".join(CHANNEL_LABELS.get(c, c) for c in together)
    return (because(Cause.SAMPLES_LOST, channels=names, at_s=_at(look.record, at)),)


def _slip_faults(look: _Look, cut: Mapping[str, int]) -> tuple[Reason, ...]:
    """Return a reason for each channel that comes earlier or later after a jump."""
    shifts = [(c, at, _shift(look, c, at)) for c, at in cut.items()]
    return tuple(
        because(
            Cause.CHANNEL_SLIPPED, channel=c, samples=abs(n), ms=1e3 * abs(n) / look.record.fs, at_s=_at(look.record, i)
        )
        for c, i, n in shifts
        if n
    )


def _disturbance_faults(look: _Look, cut: Mapping[str, int], near: slice) -> tuple[Reason, ...]:
    """Return a reason if one channel jumps on its own, by much."""
    if len(cut) != 1:
        return ()
    ((channel, at),) = cut.items()
    x = look.record[channel]
    for extreme in (x.max(), x.min()):
        if np.count_nonzero(x[near] == extreme) >= CREST:
            return _clipped(channel, x, extreme)
    reference = next(iter(look.left)) if channel == look.drive else look.drive
    if channel in look.left and not np.ptp(look.part.in_time(look.left[channel])[near]) > DISTURBED * np.std(x):
        return ()
    return (because(Cause.CHANNEL_DISTURBED, channel=channel, reference=reference, at_s=_at(look.record, at)),)


def _unexplained_share(look: _Look, channel: str) -> float:
    """Return the share of a channel's power that the drive does not explain, over half of the blocks with power."""
    size = power(look.whole[channel])
    strong = size >= np.quantile(size, 0.8)
    return float(np.median(power(look.left[channel])[strong] / size[strong])) * SHARE


def _burst(part: DrivePart, E: Complex) -> int | None:
    """Return the first sample of the slot with the largest unexplained part, each block over its own power; None if it
    is even in time."""
    left = part.in_time(E / np.sqrt(power(E))[:, None])
    whole = left.size // SLOT * SLOT
    size = np.sqrt(np.mean(left[:whole].reshape(-1, SLOT) ** 2, axis=1))
    top = int(np.argmax(size))
    return top * SLOT if size[top] > BURST * float(np.median(size)) else None


def _prediction_errors(x: Array) -> Array:
    """Return the errors (N,) of linear prediction over their local standard deviation; 0 for the first AHEAD samples.
    The local one is never taken below that of the record; if no error jumps over this, all are given over this."""
    centred = (x - x.mean()) / (np.std(x) or 1.0)
    at = np.unique(np.linspace(AHEAD, x.size - 1, min(x.size, TRAINED_ON)).astype(np.intp))
    before = np.stack([centred[at - k] for k in range(1, AHEAD + 1)], axis=1)
    squares = before.T @ before
    weights = np.linalg.solve(squares + 1e-13 * np.trace(squares) * np.eye(AHEAD), before.T @ centred[at])
    error = np.abs(np.convolve(centred, np.concatenate([[1.0], -weights]))[: x.size])
    error[:AHEAD] = 0.0
    middle = max(float(np.median(error)), 1e-12)
    if 0.6745 * error.max() <= JUMP * middle:
        return np.asarray(0.6745 * error / middle)
    width = 4 * SLOT
    whole = error.size // width * width
    if not whole:
        return np.zeros_like(error)
    median = np.median(error[:whole].reshape(-1, width), axis=1)
    # A drive that begins raises the error from there on, which is not a jump: so the side with the larger error counts.
    padded = np.pad(median, ABOUT - 1, mode="edge")
    sides = np.median(sliding_window_view(padded, ABOUT), axis=1)
    scale = np.maximum(np.maximum(sides[: median.size], sides[-median.size :]), middle)
    out = np.zeros_like(error)
    out[:whole] = 0.6745 * error[:whole] / np.repeat(scale, width)
    return out


def _shift(look: _Look, channel: str, at: int) -> int:
    """Return by how many samples a channel comes earlier after a cut than before; 0 if it does not, or if a part is
    short."""
    u = look.record[look.drive]
    y = look.record[channel]
    if channel == look.drive:
        u, y = look.record[next(iter(look.left))], u
    both = [_cross_spectrum(u[part], y[part]) for part in (slice(0, at), slice(at, None))]
    if any(S is None for S in both):
        return 0
    before, after = (S for S in both if S is not None)
    product = after * before.conj()
    size = np.abs(product)
    driven = size > 1e-6 * size.max()
    along = np.fft.irfft(np.where(driven, product / np.maximum(size, 1e-300), 0.0))
    lag = int(np.argmax(along))
    if not along[lag] > SHIFT_STANDS_OUT * np.std(along):
        return 0
    lag = lag if lag < CORRELATED // 2 else lag - CORRELATED
    return -lag


def _cross_spectrum(u: Array, y: Array) -> Complex | None:
    count = u.size // (CORRELATED // 2) - 1
    if count < 2:
        return None
    window = hann(CORRELATED)
    total = np.zeros(CORRELATED // 2 + 1, dtype=complex)
    for i in range(count):
        part = slice(i * CORRELATED // 2, i * CORRELATED // 2 + CORRELATED)
        U, Y = (np.fft.rfft(window * (x[part] - x[part].mean())) for x in (u, y))
        total += U.conj() * Y
    return total


def _jitter(look: _Look) -> tuple[Reason, ...]:
    """Return a reason if the sampling times scatter: the error of a sample is its velocity times the error of its time,
    so it grows with the velocity. Two channels must show this, since the interpolation error of an encoder looks the
    same."""
    found, others = list[float](), len(look.left)
    for c, E in look.left.items():
        others -= 1
        if (s := _time_error(look, c, E)) > JITTER_s:
            found.append(s)
        if len(found) + others < 2:
            return ()
    return (because(Cause.SAMPLING_JITTER, jitter_us=1e6 * max(found)),) if len(found) > 1 else ()


def _time_error(look: _Look, channel: str, E: Complex) -> float:
    """Return the standard deviation [s] of the sampling times; 0 if the error does not grow with the velocity."""
    y = look.record[channel][: look.part.n]
    velocity = np.gradient(y) * look.record.fs
    rough = np.diff(look.part.in_time(E), 2)  # differs from sample to sample, unlike drift or creep
    whole = rough.size // PART * PART
    error = np.mean((rough[:whole] ** 2 / 6.0).reshape(-1, PART), axis=1)
    motion = np.mean((velocity[1 : whole + 1] ** 2).reshape(-1, PART), axis=1)
    mean = float(np.mean(motion))
    if error.size < 10 * PART or mean == 0.0:
        return 0.0
    error = np.minimum(error, np.quantile(error, 0.999))
    # A response that depends on the level errs with higher powers of the motion.
    place = np.mean(((y - y.mean())[1 : whole + 1] ** 2).reshape(-1, PART), axis=1)
    place /= max(float(np.mean(place)), 1e-300)
    A = np.column_stack([np.ones_like(motion), motion / mean, (motion / mean) ** 2, place])
    found = np.linalg.lstsq(A, error, rcond=None)[0]
    rest, share = float(found[0]), float(found[1])
    left = error - A @ found
    sd = float(np.sqrt(np.var(left) * np.linalg.pinv(A.T @ A)[1, 1]))
    if share < max(JITTER_SURE * sd, JITTER_SHARE * abs(rest)):
        return 0.0
    return float(np.sqrt(SHARE * share / mean))
