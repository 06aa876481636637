"""The scale of an axis of a panel: its limits, the position of values along it, and its ticks."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from accept.pictures.words import number
from checks.arrays import Array
from checks.picture import Band, Heights, Image, Item, Line, Mark, Panel, Span

MARGIN = 0.05  # of the extent of the data, left free at both ends
_NICE = (1.0, 2.0, 2.5, 5.0, 10.0)  # steps between ticks, times a power of ten
_SHORTEST = 1e-12  # relative, of a range that is one number but for rounding
_TEN_THOUSAND = 1e4
LARGEST = 1e100  # that has a place on an axis: the square of it is still a number


@dataclass(frozen=True)
class Scale:
    """Limits lo < hi of an axis, both positive if it is logarithmic; names: in place of the numbers 0, 1, ..."""

    lo: float
    hi: float
    log: bool = False
    degrees: bool = False
    names: tuple[str, ...] = ()

    def at(self, values: Array | float) -> Array:
        """Return the position of values, 0 at lo and 1 at hi; NaN if they have no logarithm."""
        x = np.asarray(values, float)
        if not self.log:
            with np.errstate(over="ignore"):
                return np.asarray((x - self.lo) / (self.hi - self.lo))
        with np.errstate(invalid="ignore"):
            found = np.log10(np.where(x > 0.0, x, np.nan)) - math.log10(self.lo)
        return found / (math.log10(self.hi) - math.log10(self.lo))

    def ticks(self, most: int) -> list[tuple[float, str]]:
        """Return (value, words) of at most `most` ticks within the limits."""
        if self.names:
            low, high = sorted((self.lo, self.hi))  # an axis of names may begin at the top
            return [(float(n), name) for n, name in enumerate(self.names) if low <= n <= high]
        if self.log and self.hi / self.lo > 10.0**0.9:
            return [(v, number(v)) for v in self._decades(most)]
        step = self._step(most)
        first, last = math.ceil(self.lo / step - 1e-9), math.floor(self.hi / step + 1e-9)
        values = [k * step for k in range(first, last + 1)]
        return list(zip(values, _words(values, step), strict=True))

    def _step(self, most: int) -> float:
        """Return the smallest round step with at most `most` ticks; quarters of a turn from half a turn on."""
        span = self.hi - self.lo
        if self.degrees and span >= 180.0:
            return 90.0 * math.ceil(span / 90.0 / most)
        least = span / most
        power = 10.0 ** math.floor(math.log10(least))
        return next(power * nice for nice in _NICE if power * nice >= least * (1.0 - 1e-9))

    def _decades(self, most: int) -> list[float]:
        low, high = math.log10(self.lo), math.log10(self.hi)
        powers = range(math.floor(low), math.ceil(high) + 1)
        fine = self._within([d * 10.0**p for p in powers for d in (1.0, 2.0, 5.0)])
        if len(fine) <= most:
            return fine
        coarse = self._within([10.0**p for p in powers])
        if len(coarse) < 2:
            return fine
        apart = -(-len(coarse) // most)
        return [v for v in coarse if round(math.log10(v)) % apart == 0]

    def _within(self, values: Sequence[float]) -> list[float]:
        return [v for v in values if self.lo * (1 - 1e-9) <= v <= self.hi * (1 + 1e-9)]


def _words(values: Sequence[float], step: float) -> list[str]:
    """Return the numbers of an axis with the same digits; as powers of ten if digits alone would be long."""
    largest = max((abs(v) for v in values), default=0.0)
    if largest >= 10.0 * _TEN_THOUSAND or 0.0 < largest < 1e-3:
        told_apart = max(6, 2 + math.ceil(math.log10(largest / step))) if step else 6
        return [
            "0"
            if abs(v) < step / 2
            else ("−" if v < 0 else "") + number(abs(round(v / step) * step if step else v), told_apart)
            for v in values
        ]
    digits = max(0, math.ceil(-math.log10(step) - 1e-9))
    digits += abs(round(step, digits) - step) > 1e-6 * step  # 2.5 of a power of ten
    return [f"{0.0 if abs(v) < step / 2 else v:.{digits}f}".replace("-", "−") for v in values]


def scales(panel: Panel, wide: float, tall: float) -> tuple[Scale, Scale]:
    """Return the scales of both axes of a panel whose axes are `wide` and `tall`, in one unit."""
    x_lo, x_hi = panel.x_range or _extent(panel.items, "x", panel.x_log)
    y_lo, y_hi = panel.y_range or _extent(panel.items, "y", panel.y_log)
    if panel.equal:
        grown = max((x_hi - x_lo) / wide, (y_hi - y_lo) / tall)
        x_lo, x_hi = _about((x_lo + x_hi) / 2, grown * wide)
        y_lo, y_hi = _about((y_lo + y_hi) / 2, grown * tall)
    degrees = panel.y_label.endswith("[deg]")
    return Scale(x_lo, x_hi, panel.x_log), Scale(y_lo, y_hi, panel.y_log, degrees, panel.y_names)


def _about(middle: float, span: float) -> tuple[float, float]:
    return middle - span / 2, middle + span / 2


def _extent(items: Sequence[Item], axis: str, log: bool) -> tuple[float, float]:
    """Return limits of an axis that show every item with a margin; maps fill theirs."""
    parts = [np.ravel(np.asarray(part, float)) for item in items for part in _parts(item, axis)]
    values = np.concatenate([np.empty(0), *parts])
    values = values[(np.abs(values) < LARGEST) & ((values > 1.0 / LARGEST) | (not log))]  # no NaN, no inf
    if not values.size:
        return (1.0, 10.0) if log else (0.0, 1.0)
    lo, hi = float(values.min()), float(values.max())
    if any(isinstance(item, Image) for item in items):
        return (lo, hi) if hi > lo else (lo - 0.5, hi + 0.5)
    free = 3 * MARGIN if any(isinstance(item, Heights) for item in items) else MARGIN
    if log:
        ends = math.log10(lo), math.log10(hi)
        room = free * (ends[1] - ends[0]) or 0.1
        return 10.0 ** (ends[0] - room), 10.0 ** (ends[1] + room)
    span = hi - lo
    room = free * span if span > _SHORTEST * max(abs(lo), abs(hi)) else max(abs(lo) * free, 1e-3)
    return lo - room, hi + room


def _parts(item: Item, axis: str) -> list[Array]:
    match item:
        case Line():
            return [item.x if axis == "x" else item.y]
        case Band():
            return [item.x] if axis == "x" else [item.lo, item.hi]
        case Span():
            return [np.array([item.lo, item.hi])] if item.axis == axis else []
        case Mark():
            return [np.array([item.at])] if item.axis == axis else []
        case Heights():
            return [item.x if axis == "x" else item.y]
        case Image():
            return [edges(item.x if axis == "x" else item.y)]
        case _:
            return []


def edges(centres: Array) -> Array:
    """Return (N + 1,) edges of the cells about N centres."""
    x = np.asarray(centres, float)
    if x.size < 2:
        return np.array([x[0] - 0.5, x[0] + 0.5]) if x.size else x
    inner = (x[:-1] + x[1:]) / 2
    return np.concatenate([[2 * x[0] - inner[0]], inner, [2 * x[-1] - inner[-1]]])


def runs(*values: Array) -> Iterator[slice]:
    """Yield stretches in which every one of the values (N,) is a number."""
    good = np.isfinite(np.stack(values)).all(axis=0)
    steps = np.flatnonzero(np.diff(good.astype(np.int8), prepend=0, append=0))
    yield from (slice(int(a), int(b)) for a, b in zip(steps[::2], steps[1::2], strict=True))
