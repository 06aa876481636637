"""Sketches of channels: a few hundred bytes that show whether two channels hold the same samples.

A channel that is measured twice differs in its last digits; one that was stored twice does not, in any file. A sketch
keeps 64 samples spread over the channel, and of a channel of coarse steps a hash of all its levels. Two sketches are
the same samples if they agree to five digits of their span, with another sign, scale and offset too, or if one is the
other written with five digits, MATLAB's default.

A copy that was cut or shifted has other samples at those places, but the same turning points. A sketch keeps hashes of
the ratios of successive swings between them, which gain, offset, sign and place do not change: the 64 smallest of all
(a bottom-k sketch, [Broder]). Two channels that share a quarter of these hashes are one; of the recorded units and the
population here no two share more than a tenth. A fifth cut off and noise of 3e-6 of the span are recognised, noise of
1e-5 in three of four channels, and 3e-5 no more. The same is kept of every second sample, from the first on and from
the second, so that a copy at half the rate is known, without a filter. Not recognised are a copy that was filtered or
resampled in another way, and a record with few different swings, as of a slow sine: its turning points are those of
every unit."""

import base64
import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array

SAMPLES = 64
WITHIN = 1e-5  # of the span
DIGITS = 5
AGREE = 61  # of the 64: 95 percent
TELLING = 32  # different values among the samples, below which only the levels of the whole channel are compared
KEY_STEP = 1 / 8192  # of the span: all samples at this step, in keys of which a copy shares most
KEY_SAMPLES = 16
BEGINNING = 32_768  # samples of a channel that show fine steps without sorting all of it
MOST_LEVELS = 10_000  # coarser steps may be above the noise: single samples of honest repeats are then equal
SWINGS = 64  # hashes of swings that a sketch keeps
SHARED = 16  # of them: honest records of the same excitation share one or two
LEAST_SWINGS = 32  # different ones, below which they are those of the excitation
WIDTHS = (16, 256)  # samples to either side, of which a turning point is the highest or lowest
SWING = 0.1  # of the span: a smaller one is noise
RATIO = 1e-4  # step of the logarithm of a ratio: two units differ by more, a copy by less
SWING_KEYS = 12  # of an index
HALF_KEYS = 4  # of an index, of each half
FEW = 16  # different values: a channel with fewer, as a force at rest, is not evidence


Hashes = NDArray[np.uint32]  # of swings
NO_HASHES: Hashes = np.zeros(0, dtype="<u4")
_PLACES = np.array([42, 21, 0])  # of three whole numbers in one, in bits
_NONE = ("", "", "")  # parts that sketches of earlier versions do not have


@dataclass(frozen=True, eq=False)
class Sketch:
    """Sketch of a channel. values: (64,) samples, float32, empty if they are not distinctive; levels: hash of the
    channel's own levels, "" if its steps are fine; swings: (64,) or fewer hashes of the swings between turning points;
    halves: the same of every second sample, from the first on and from the second. Sketches of earlier versions have
    neither."""

    values: Array
    levels: str
    swings: Hashes = field(default_factory=lambda: NO_HASHES)
    halves: tuple[Hashes, Hashes] = (NO_HASHES, NO_HASHES)

    def __str__(self) -> str:
        parts = [base64.b64encode(self.values.astype("<f4").tobytes()).decode(), self.levels]
        hashed = [base64.b64encode(one.tobytes()).decode() for one in (self.swings, *self.halves)]
        while hashed and not hashed[-1]:
            hashed.pop()
        return ":".join([*parts, *hashed])

    @classmethod
    def parse(cls, text: str) -> "Sketch":
        """Return the sketch that `str` wrote. Raises ValueError if the text is not a sketch."""
        packed, *rest = text.split(":")
        levels, *hashed = rest or [""]
        try:
            values = np.frombuffer(base64.b64decode(packed, validate=True), "<f4").astype(float)
            swings, even, odd, *more = (
                np.frombuffer(base64.b64decode(s, validate=True), "<u4") for s in [*hashed, *_NONE]
            )
        except ValueError as e:
            raise ValueError(f"{text[:40]!r} is no sketch of samples") from e
        whole = all(one.size <= SWINGS for one in (swings, even, odd)) and np.isfinite(values).all()
        if not rest or any(one.size for one in more) or values.size not in (0, SAMPLES) or not whole:
            raise ValueError(f"{text[:40]!r} is no sketch of samples")
        return cls(values, levels, swings, (even, odd))

    def keys(self) -> list[int]:
        """Return its index keys, 63 bits each: sketches of the same samples share one, others practically never."""
        found = [f"levels {self.levels}".encode()] if self.levels else []
        if self.values.size:
            steps = np.round(self.normal / KEY_STEP).astype("<i4").reshape(-1, KEY_SAMPLES)
            steps *= np.where(steps[:, :1] < 0, -1, 1)  # for either sign
            found += [b"%d " % n + row.tobytes() for n, row in enumerate(steps)]
        found += [b"swing %d" % one for one in self.swings[:SWING_KEYS]]
        found += [b"swing %d" % one for half in self.halves for one in half[:HALF_KEYS]]
        return [key_of(one) for one in found]

    def same(self, other: "Sketch") -> bool:
        """Return whether both have the same samples, or one channel is a part of the other, or its every second
        sample."""
        pairs = [(self, (other.swing_set, *other.half_sets)), (other, self.half_sets)]
        same_swings = any(_share(one.swing_set, theirs) for one, sets in pairs for theirs in sets)
        return same_swings or self._same_samples(other)

    def _same_samples(self, other: "Sketch") -> bool:
        if self.levels and other.levels:
            return self.levels == other.levels
        if not (self.values.size and other.values.size):
            return False
        one, two = self.normal, other.normal
        return (
            _agree(np.abs(one - two) <= WITHIN)
            or _agree(np.abs(one + two) <= WITHIN)
            or self.rounds_to(other)
            or other.rounds_to(self)
        )

    def rounds_to(self, written: "Sketch") -> bool:
        """Return whether the samples of `written` are these rounded to five digits, also in single precision."""
        digit, on_grid = written.decimal_grid
        with np.errstate(invalid="ignore"):
            near = np.abs(self.values - written.values) <= 0.52 * digit
        return _agree(on_grid & near | (self.values == written.values))

    @cached_property
    def normal(self) -> Array:
        """Return the values less their median, over their span: independent of unit, gain and offset."""
        return np.asarray((self.values - np.median(self.values)) / np.ptp(self.values))

    @cached_property
    def decimal_grid(self) -> tuple[Array, NDArray[np.bool_]]:
        """Return the unit of the fifth digit of each value, and whether the value is a multiple of it."""
        with np.errstate(divide="ignore", invalid="ignore"):
            digit = 10.0 ** (np.floor(np.log10(np.abs(self.values))) - DIGITS + 1)
            return digit, np.abs(self.values / digit - np.round(self.values / digit)) <= 0.02

    @cached_property
    def swing_set(self) -> frozenset[int]:
        """Return the hashes of its swings."""
        return frozenset(self.swings.tolist())

    @cached_property
    def half_sets(self) -> tuple[frozenset[int], ...]:
        """Return the hashes of the swings of every second sample, from the first on and from the second."""
        return tuple(frozenset(half.tolist()) for half in self.halves)


def key_of(content: bytes) -> int:
    """Return the key of a text for an index: 63 bits of its SHA-256."""
    return int.from_bytes(hashlib.sha256(content).digest()[:8], "big") >> 1


def sketch(x: Array) -> Sketch | None:
    """Return the sketch of a channel (N,), None if it is not distinctive: a constant, or one of a few levels."""
    if x.size < SAMPLES or (np.unique(x[: 20 * SAMPLES]).size < 2 and np.unique(x).size < FEW):
        return None
    picked = x[np.linspace(0, x.size - 1, SAMPLES).astype(int)]
    values = picked if np.unique(picked).size >= TELLING else np.zeros(0)
    levels, swings = _levels(x), _swings(x)
    halves = (_swings(x[::2]), _swings(x[1::2]))
    return Sketch(values, levels, swings, halves) if values.size or levels or swings.size else None


def _share(one: frozenset[int], other: frozenset[int]) -> bool:
    """Return whether two sets of hashes of swings are of one channel."""
    both = one & other
    if min(len(one), len(other)) < LEAST_SWINGS or len(both) < SHARED:
        return False
    smallest = sorted(one | other)[:SWINGS]  # of both together
    return len(both.intersection(smallest)) >= SHARED


def _swings(x: Array) -> NDArray[np.uint32]:
    """Return the smallest hashes of three successive ratios of swings between a channel's turning points.

    The turning points have the width that gives most hashes, whatever the length of the record."""
    if not np.isfinite(x).all():
        return np.zeros(0, dtype="<u4")
    wide = [width for width in WIDTHS if width * LEAST_SWINGS < x.size]
    triples = max((_triples(x, width) for width in wide), key=len, default=np.zeros((0, 3)))
    # One number of three times 21 bits is sorted faster than a row; a ratio of swings between a tenth of the span and
    # all of it is 23,000 steps, 34,000 where parabolas reach beyond the samples.
    packed = np.unique((triples.astype(np.int64) + (1 << 20)) @ (1 << _PLACES))
    if packed.size < LEAST_SWINGS:
        return np.zeros(0, dtype="<u4")
    rows = ((packed[:, None] >> _PLACES) % (1 << 21) - (1 << 20)).astype("<i4").tobytes()
    hashes = b"".join(hashlib.sha256(rows[n : n + 12]).digest() for n in range(0, len(rows), 12))
    return np.unique(np.frombuffer(hashes, dtype="<u4")[::8])[:SWINGS]


def _triples(x: Array, width: int) -> Array:
    """Return ratios (n, 3) of successive large swings between points that are extreme within `width` samples to either
    side."""
    turning = (x == _running(np.maximum, x, width)) | (x == _running(np.minimum, x, width))
    at = np.flatnonzero(turning[1:-1]) + 1
    swing = np.diff(_vertex(x[at - 1], x[at], x[at + 1]))
    if swing.size < 4:
        return np.zeros((0, 3))
    large = np.abs(swing) >= SWING * np.ptp(x)
    good = large[:-3] & large[1:-2] & large[2:-1] & large[3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.round(np.log(np.abs(swing[1:] / swing[:-1])) / RATIO)
    return np.asarray(np.stack([ratios[n : n + good.size] for n in range(3)], axis=1)[good])


def _running(extreme: np.ufunc, x: Array, width: int) -> Array:
    """Return the extreme of `width` samples to either side of each sample (N,), by windows that double: three times as
    fast as a filter along the samples."""
    window, size = np.pad(x, width, mode="edge"), 1
    free = np.empty_like(window)
    while 2 * size <= 2 * width + 1:
        n = window.size - size
        extreme(window[:n], window[size:], out=free[:n])
        window, free, size = free[:n], window, 2 * size
    rest = 2 * width + 1 - size
    return np.asarray(extreme(window[: window.size - rest], window[rest:]))


def _vertex(before: Array, at: Array, after: Array) -> Array:
    """Return the height of the parabola through three samples about a turning point, independent of the sampling."""
    curvature = before - 2.0 * at + after
    with np.errstate(divide="ignore", invalid="ignore"):
        height = at - (after - before) ** 2 / (8.0 * curvature)
    return np.where(np.abs(height - at) <= np.maximum(np.abs(before - at), np.abs(after - at)), height, at)


def _levels(x: Array) -> str:
    """Return the hash of the sequence of levels of a channel of coarse steps, in its own steps, up or down."""
    rounding = 1e-6 * np.ptp(x)  # smaller gaps are rounding of one level
    if np.count_nonzero(np.diff(np.sort(x[:BEGINNING])) > rounding) > 1.5 * MOST_LEVELS:
        return ""
    there = np.unique(x)
    gaps = np.diff(there)
    apart = gaps > rounding
    if np.count_nonzero(apart) + 1 < FEW:
        return ""
    smallest = gaps[apart].min()
    step = np.median(gaps[apart & (gaps < 1.5 * smallest)])
    steps = np.where(apart, gaps / step, 0.0)
    if np.abs(steps - np.round(steps)).max() > 0.25 or steps.sum() > MOST_LEVELS:
        return ""
    counts = _counts(x, there, np.concatenate([[0], np.cumsum(np.round(steps))]).astype("<i4"), step)
    return min(_hash(counts.tobytes()), _hash((counts.max() - counts).tobytes()))


def _counts(x: Array, there: Array, counts: NDArray[np.int32], step: float) -> NDArray[np.int32]:
    """Return the entry of `counts` for each of x, whose level is found in `there` by its number of steps from the
    first: faster than a search. If two levels lie within one step, it is searched."""
    slots, found = (np.rint((v - there[0]) / step).astype(np.intp) for v in (there, x))
    by_slot = np.zeros(slots[-1] + 1, dtype=counts.dtype)
    by_slot[slots] = counts
    return by_slot[found] if np.array_equal(by_slot[slots], counts) else counts[np.searchsorted(there, x)]


def _agree(same: NDArray[np.bool_]) -> bool:
    return int(np.count_nonzero(same)) >= AGREE


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]
