"""Sketches of channels: a few hundred bytes that show whether two channels hold the same samples.

A channel that is measured twice differs in its last digits; one that was stored twice does not, in any file. A sketch
keeps 64 samples spread over the channel, and of a channel of coarse steps a hash of all its levels. Two sketches are
the same samples if they agree to five digits of their span, with another sign, scale and offset too, or if one is the
other written with five digits, MATLAB's default.

A copy that was cut has other samples at those places, but the same turning points. A sketch keeps hashes of the ratios
of successive swings between them, which gain, offset, sign and place do not change: the 64 smallest of all (a bottom-k
sketch, [Broder]). Channels that share a quarter are one; of the recorded units and the population no two share more
than a tenth. A fifth cut off and noise of 3e-6 of the span are recognised, 3e-5 no more. The same is kept of every
second sample, from the first on and from the second.

A slow record has the turning points of every unit; its noise is its own. A sketch keeps hashes of the signs of the
noise about its peaks: what a local cubic leaves, if it is above the rounding of the channel's steps and not smooth. The
64 smallest are kept of all samples, and of every second and third one of a channel without swings. Eight common ones
tell a copy, also backwards; records that were measured apart share three at most. Not recognised are a copy with noise
of a third of its own added, rounded as coarsely, filtered, interpolated or thinned further."""

import base64
import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from weakref import WeakKeyDictionary

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
ROUNDED = 1e-6  # of the span: smaller gaps between samples are rounding of one level
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
RESIDUAL = (2, -3, -6, 14, -6, -3, 2)  # what a cubic through seven samples leaves at the middle one, times 21
ROUNDING = 5.0  # steps: mean residual; rounding to them alone leaves 4.1, noise of a quarter of a step this
LOUDER = 1.2  # residual at a stride over that of all samples, above which it is not noise alone
MOST_COUNTED = 10_000  # residuals of noise are some tens of steps
NEAR = 8  # samples to either side of a peak of the noise
WINDOW = 16  # samples to either side whose signs are hashed
STRIDES = (1, 2, 3)
COMMON_NOISE = 8
PROBES = 8  # of the 64 samples that are compared first
PROBED = PROBES - (SAMPLES - AGREE)  # of them agree if 61 of all do

Hashes = NDArray[np.uint32]  # of swings
NO_HASHES: Hashes = np.zeros(0, dtype="<u4")
_HALF = np.uint64(32)
_PLACES = np.array([42, 21, 0])  # of three whole numbers in one, in bits
_NONE = ("",) * (3 + len(STRIDES))  # parts that sketches of earlier versions do not have


@dataclass(frozen=True, eq=False)
class Sketch:
    """Sketch of a channel. values: (64,) samples, float32, empty if they are not distinctive; levels: hash of the
    channel's own levels, "" if its steps are fine; swings: (64,) or fewer hashes of the swings between turning points;
    halves: the same of every second sample, from the first on and from the second; noise: of the noise, by stride.
    Sketches of earlier versions lack some."""

    values: Array
    levels: str
    swings: Hashes = field(default_factory=lambda: NO_HASHES)
    halves: tuple[Hashes, Hashes] = (NO_HASHES, NO_HASHES)
    noise: tuple[Hashes, ...] = (NO_HASHES,) * len(STRIDES)

    def __str__(self) -> str:
        parts = [base64.b64encode(self.values.astype("<f4").tobytes()).decode(), self.levels]
        hashed = [base64.b64encode(one.tobytes()).decode() for one in (self.swings, *self.halves, *self.noise)]
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
            parts = [np.frombuffer(base64.b64decode(s, validate=True), "<u4") for s in [*hashed, *_NONE]]
        except ValueError as e:
            raise ValueError(f"{text[:40]!r} is no sketch of samples") from e
        whole = all(one.size <= SWINGS for one in parts) and np.isfinite(values).all()
        if not rest or len(hashed) > len(_NONE) or values.size not in (0, SAMPLES) or not whole:
            raise ValueError(f"{text[:40]!r} is no sketch of samples")
        swings, even, odd, *noise = parts[: len(_NONE)]
        return cls(values, levels, swings, (even, odd), tuple(noise))

    @classmethod
    def parse_all(cls, texts: Sequence[str]) -> "Sketches":
        """Return the sketches that `str` wrote, to compare all of them at once. Raises ValueError."""
        return Sketches([*map(cls.parse, texts)])

    @classmethod
    def of(cls, x: Array) -> "Sketch | None":
        """Return the sketch of a channel (N,), None if it is not distinctive: a constant, or one of a few levels."""
        if x.size < SAMPLES or (np.unique(x[: 20 * SAMPLES]).size < 2 and np.unique(x).size < FEW):
            return None
        picked = x[np.linspace(0, x.size - 1, SAMPLES).astype(int)]
        values = picked if np.unique(picked).size >= TELLING else np.zeros(0)
        gaps = np.diff(np.sort(x[:BEGINNING]))
        gaps = gaps[gaps > ROUNDED * np.ptp(x)]  # with NaN none is left
        levels, swings = _levels(x, gaps), _swings(x)
        halves = (_swings(x[::2]), _swings(x[1::2]))
        noise = _noise(x, gaps, () if swings.size else STRIDES[1:])
        kept = values.size or levels or swings.size or noise[0].size
        return cls(values, levels, swings, halves, noise) if kept else None

    def keys(self) -> list[int]:
        """Return its index keys, 63 bits each: sketches of the same samples share one, others practically never."""
        found = [f"levels {self.levels}".encode()] if self.levels else []
        if self.values.size:
            steps = np.round(self.normal / KEY_STEP).astype("<i4").reshape(-1, KEY_SAMPLES)
            steps *= np.where(steps[:, :1] < 0, -1, 1)  # for either sign
            found += [b"%d " % n + row.tobytes() for n, row in enumerate(steps)]
        found += [b"swing %d" % one for one in self.swings[:SWING_KEYS]]
        found += [b"swing %d" % one for half in self.halves for one in half[:HALF_KEYS]]
        found += [b"noise %d" % one for noise in self.noise for one in noise[:COMMON_NOISE]]
        return [self.key(one) for one in found]

    @staticmethod
    def key(content: bytes) -> int:
        """Return the key of a text for an index: 63 bits of its SHA-256."""
        return int.from_bytes(hashlib.sha256(content).digest()[:8], "big") >> 1

    def same(self, other: "Sketch") -> bool:
        """Return whether both have the same samples, or one is a part of the other, or its every second sample."""
        (one, *ours), (two, *theirs) = self.hash_sets[:3], other.hash_sets[:3]
        pairs = [(one, two), *((one, half) for half in theirs), *((two, half) for half in ours)]
        return any(_share(*pair) for pair in pairs) or self._same_noise(other) or self._same_samples(other)

    def _same_noise(self, other: "Sketch") -> bool:
        """Return whether both have the same noise. The response to a fast drive, which is the same for every unit, may
        look like noise: where both have swings these decide alone."""
        least = (COMMON_NOISE, SHARED, SWINGS + 1)[bool(self.swings.size) + bool(other.swings.size)]
        return any(len(ours & theirs) >= least for ours in self.hash_sets[3:] for theirs in other.hash_sets[3:])

    def _same_samples(self, other: "Sketch") -> bool:
        if self.levels and other.levels:
            return self.levels == other.levels
        if not (self.values.size and other.values.size):
            return False
        one, two = self.normal, other.normal
        within = max(np.count_nonzero(np.abs(one - two) <= WITHIN), np.count_nonzero(np.abs(one + two) <= WITHIN))
        return bool(within >= AGREE) or self.rounds_to(other) or other.rounds_to(self)

    def rounds_to(self, written: "Sketch") -> bool:
        """Return whether the samples of `written` are these rounded to five digits, also in single precision."""
        digit, on_grid = written.decimal_grid
        with np.errstate(invalid="ignore"):
            near = np.abs(self.values - written.values) <= 0.52 * digit
        return bool(np.count_nonzero(on_grid & near | (self.values == written.values)) >= AGREE)

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
    def hash_sets(self) -> tuple[frozenset[int], ...]:
        """Return the hashes of its swings, of those of either half, and of its noise by stride."""
        return tuple(frozenset(one.tolist()) for one in (self.swings, *self.halves, *self.noise))


class Sketches:
    """The sketches of a unit, to compare with many others: what tells most pairs apart is computed for all at once."""

    def __init__(self, sketches: Sequence[Sketch]) -> None:
        self.all = sketches
        hashed = [np.concatenate([s.swings, *s.halves, *s.noise]) for s in sketches] or [NO_HASHES]
        order = np.argsort(hashes := np.concatenate(hashed))
        self.hashes, self.owner = hashes[order], np.repeat(np.arange(len(hashed)), [*map(len, hashed)])[order]
        self.known: WeakKeyDictionary[Sketches, list[tuple[int, int]]] = WeakKeyDictionary()
        at = np.linspace(0, SAMPLES - 1, PROBES).astype(int)
        none = np.full(PROBES, np.nan)
        self.values = np.array([s.values[at] if s.values.size else none for s in sketches]).reshape(-1, PROBES)
        with np.errstate(invalid="ignore"):  # equal values, as no program writes them
            self.normal = np.abs([s.normal[at] if s.values.size else none for s in sketches]).reshape(-1, PROBES)

    def same(self, others: "Sketches") -> list[tuple[int, int]]:
        """Return the places of all pairs that are the same as `Sketch.same` says."""
        if others not in self.known:
            pairs = {*self._of_common_hashes(others), *self._of_near_samples(others)}
            self.known[others] = sorted((n, m) for n, m in pairs if self.all[n].same(others.all[m]))
        return self.known[others]

    def _of_common_hashes(self, others: "Sketches") -> Iterator[tuple[int, int]]:
        """Yield the pairs with so many hashes in common that swings or noise may be the same."""
        first = np.searchsorted(self.hashes, others.hashes)
        times = np.searchsorted(self.hashes, others.hashes, "right") - first  # that each hash is one of ours
        before = np.cumsum(times) - times
        ours = self.owner[np.arange(times.sum()) + np.repeat(first - before, times)]
        count = np.bincount(ours * len(others.all) + np.repeat(others.owner, times))
        yield from (divmod(int(pair), len(others.all)) for pair in np.flatnonzero(count >= COMMON_NOISE))

    def _of_near_samples(self, others: "Sketches") -> Iterator[tuple[int, int]]:
        """Yield the pairs with the same levels, or samples so near, with either sign, that they may be the same."""
        one, two = self.values[:, None], others.values
        near = np.abs(one - two) <= 10.0 ** (1 - DIGITS) * np.maximum(np.abs(one), np.abs(two))
        near |= np.abs(self.normal[:, None] - others.normal) <= WITHIN
        levels = {s.levels for s in self.all if s.levels} & {s.levels for s in others.all}
        alike = ([s.levels in levels for s in each.all] for each in (self, others))
        found = (np.count_nonzero(near, axis=2) >= PROBED) | np.logical_and.outer(*alike)
        yield from ((int(n), int(m)) for n, m in zip(*np.nonzero(found), strict=True))


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
    triples = max((_triples(x, at) for at in _turning(x, wide)), key=len, default=np.zeros((0, 3)))
    # One number of three times 21 bits is sorted faster than a row; a ratio of swings between a tenth of the span and
    # all of it is 23,000 steps, 34,000 where parabolas reach beyond the samples.
    packed = np.unique((triples.astype(np.int64) + (1 << 20)) @ (1 << _PLACES))
    if packed.size < LEAST_SWINGS:
        return np.zeros(0, dtype="<u4")
    rows = ((packed[:, None] >> _PLACES) % (1 << 21) - (1 << 20)).astype("<i4").tobytes()
    hashes = b"".join([hashlib.sha256(row).digest() for row in np.frombuffer(rows, "V12").tolist()])
    return np.unique(np.frombuffer(hashes, dtype="<u4")[::8])[:SWINGS]


def _noise(x: Array, gaps: Array, strides: tuple[int, ...]) -> tuple[Hashes, ...]:
    """Return the hashes of the noise of a channel, at stride 1 and at these: the smallest that occur once, in order;
    none if what local cubics leave of it is not noise."""
    level, found = np.inf, [NO_HASHES] * len(STRIDES)
    for n, step in enumerate((1, *strides) if gaps.size else ()):
        residuals = [np.rint(np.convolve(x[k::step] / gaps.min(), RESIDUAL, "valid")) for k in range(step)]
        levels = [np.minimum(size := np.abs(r), 3.0 * _median(size)).mean() for r in residuals]
        patterns = [_patterns(r) for r, size in zip(residuals, levels, strict=True) if ROUNDING <= size < level]
        found[n] = _hashes(np.concatenate([np.zeros(0, np.uint64), *patterns]))
        if not found[0].size:
            break
        level = min(level, LOUDER * levels[0])
    return tuple(found)


def _median(counts: Array) -> float:
    """Return the median of whole numbers (N,), none negative: counted unless most are large, in a tenth of a sort."""
    if counts.size:
        below = np.cumsum(np.bincount(np.minimum(counts, MOST_COUNTED).astype(np.intp)))
        middle = np.searchsorted(below, [(counts.size - 1) // 2, counts.size // 2], side="right")
        if middle[1] < MOST_COUNTED:
            return float(middle.mean())
    return float(np.median(counts))


def _patterns(residual: Array) -> NDArray[np.uint64]:
    """Return the signs about the peaks of a residual, 32 of two bits each, one number for either sign and order; none
    if most do not alternate as those of noise."""
    if residual.size <= 2 * WINDOW:
        return np.zeros(0, np.uint64)
    size = np.abs(residual)
    window = _doubled(np.maximum, size, NEAR, 2 * NEAR)
    peaks = np.flatnonzero((size == np.maximum(window[: size.size], window[1:]))[WINDOW:-WINDOW])
    up, down = residual > 0, residual < 0
    turns = np.cumsum(np.concatenate([[False], up[1:] & down[:-1] | down[1:] & up[:-1]]), dtype=np.int32)
    alternate = peaks[turns[peaks + 2 * WINDOW] - turns[peaks] >= WINDOW]
    if 2 * alternate.size < peaks.size:
        return np.zeros(0, np.uint64)
    up, down = (np.lib.stride_tricks.sliding_window_view(one, 2 * WINDOW + 1)[alternate] for one in (up, down))
    sides = np.delete([up, down], WINDOW, axis=2)  # without the peak itself
    bits = np.packbits([sides, sides[:, :, ::-1]], axis=3).view(">u4")[..., 0].astype(np.uint64)
    return np.asarray((bits << _HALF | bits[:, ::-1]).min(axis=(0, 1)))


def _hashes(patterns: NDArray[np.uint64]) -> Hashes:
    """Return the smallest hashes of the patterns that occur once, in order: the finaliser of splitmix64."""
    mixed = (patterns ^ patterns >> _HALF) * np.uint64(0x9E3779B97F4A7C15)
    mixed = (mixed ^ mixed >> np.uint64(29)) * np.uint64(0xBF58476D1CE4E5B9) >> _HALF
    different, count = np.unique(mixed, return_counts=True)
    return np.asarray(different[count == 1][:SWINGS], "<u4")


def _turning(x: Array, widths: Sequence[int]) -> list[NDArray[np.intp]]:
    """Return the samples that are extreme within each width (a power of two) to either side, the ends left out. Those
    of a larger width are among those of a smaller one, and are sought there by the windows that this one needed."""
    found = [np.zeros(x.size, bool) for _ in widths]
    for extreme in (np.maximum, np.minimum) if widths else ():
        window, width = _doubled(extreme, x, max(widths), 2 * widths[0]), widths[0]
        first = max(widths) - width  # of the window about sample 0
        at = np.flatnonzero(x == extreme(window[first : first + x.size], window[first + 1 : first + 1 + x.size]))
        found[0][at] = True
        for n, wider in enumerate(widths[1:], 1):
            for begin in (*range(-wider, wider, 2 * width), wider + 1 - 2 * width):
                near = window[at + (begin + max(widths))]
                at = at[extreme(near, value := x[at]) == value]
            found[n][at] = True
    return [np.flatnonzero(each[1:-1]) + 1 for each in found]


def _triples(x: Array, at: NDArray[np.intp]) -> Array:
    """Return ratios (n, 3) of successive large swings between turning points."""
    swing = np.diff(_vertex(x[at - 1], x[at], x[at + 1]))
    if swing.size < 4:
        return np.zeros((0, 3))
    large = np.abs(swing) >= SWING * np.ptp(x)
    good = large[:-3] & large[1:-2] & large[2:-1] & large[3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.round(np.log(np.abs(swing[1:] / swing[:-1])) / RATIO)
    return np.asarray(np.stack([ratios[n : n + good.size] for n in range(3)], axis=1)[good])


def _doubled(extreme: np.ufunc, x: Array, width: int, most: int) -> Array:
    """Return the extreme of the samples from each on, the ends repeated `width` times, by windows that double until
    they are `most` wide (a power of two): three times as fast as a filter along the samples."""
    window, size = np.concatenate([np.full(width, x[0]), x, np.full(width, x[-1])]), 1
    free = np.empty_like(window)
    while size < most:
        n = window.size - size
        extreme(window[:n], window[size:], out=free[:n])
        window, free, size = free[:n], window, 2 * size
    return window


def _vertex(before: Array, at: Array, after: Array) -> Array:
    """Return the height of the parabola through three samples about a turning point, independent of the sampling."""
    curvature = before - 2.0 * at + after
    with np.errstate(divide="ignore", invalid="ignore"):
        height = at - (after - before) ** 2 / (8.0 * curvature)
    return np.where(np.abs(height - at) <= np.maximum(np.abs(before - at), np.abs(after - at)), height, at)


def _levels(x: Array, gaps: Array) -> str:
    """Return the hash of the sequence of levels of a channel of coarse steps, in its own steps, up or down."""
    if gaps.size > 1.5 * MOST_LEVELS:
        return ""
    there, place = _different(x, gaps.min()) if gaps.size else (np.unique(x), None)
    gaps = np.diff(there)
    apart = gaps > ROUNDED * np.ptp(x)
    if np.count_nonzero(apart) + 1 < FEW:
        return ""
    smallest = gaps[apart].min()
    step = np.median(gaps[apart & (gaps < 1.5 * smallest)])
    steps = np.where(apart, gaps / step, 0.0)
    if np.abs(steps - np.round(steps)).max() > 0.25 or steps.sum() > MOST_LEVELS:
        return ""
    counts = np.concatenate([[0], np.cumsum(np.round(steps))]).astype("<i4")
    counts = counts[np.searchsorted(there, x) if place is None else place]
    return min(hashlib.sha256(one.tobytes()).hexdigest()[:16] for one in (counts, counts.max() - counts))


def _different(x: Array, step: float) -> tuple[Array, NDArray[np.intp] | None]:
    """Return the different values of x, in order, and the place of each sample among them, found by its number of steps
    from the lowest: faster than sorting. If two lie within one step, they are sorted, without the places."""
    lowest = x.min()
    if np.ptp(x) > 10.0 * MOST_LEVELS * step:
        return np.unique(x), None
    slots = np.rint((x - lowest) / step).astype(np.intp)
    by_slot = np.full(slots.max() + 1, np.nan)
    by_slot[slots] = x
    if not np.array_equal(by_slot[slots], x):
        return np.unique(x), None
    taken = ~np.isnan(by_slot)
    return by_slot[taken], (np.cumsum(taken) - 1)[slots]
