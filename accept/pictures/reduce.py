"""Panels reduced to the resolution of a printed picture, so that they can be attached to a certificate."""

from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.picture import Band, Image, Item, Line, Panel

POINTS = 800  # a certificate's panel is 55 mm wide: 15 points per millimetre
_DIGITS = 7  # of a number in a picture: more than print resolves
_EXACT, _UNSURE = 22, 1e-6  # 10^22 is the last power of ten without rounding; of a step of the seventh digit
_PIXELS = 200  # at most, along each side of a map


def reduce_panel(panel: Panel) -> Panel:
    """Return the panel with at most POINTS points a curve and 7 digits a number. Reducing twice is reducing once."""
    return replace(panel, items=tuple(_item(item) for item in panel.items))


def _item(item: Item) -> Item:
    if isinstance(item, Line):
        keep = _keep_extremes(item.y, item.y)
        item = replace(item, x=item.x[keep], y=item.y[keep])
    elif isinstance(item, Band):
        keep = _keep_extremes(item.lo, item.hi)
        item = replace(item, x=item.x[keep], lo=item.lo[keep], hi=item.hi[keep])
    elif isinstance(item, Image):
        rows, columns = (slice(None, None, -(-n // _PIXELS)) for n in item.z.shape)
        item = replace(item, x=item.x[columns], y=item.y[rows], z=item.z[rows, columns])
    values = {field.name: getattr(item, field.name) for field in fields(item)}
    fewer: dict[str, Any] = {name: _round_values(v) for name, v in values.items() if isinstance(v, np.ndarray)}
    return replace(item, **fewer)


def _keep_extremes(low: Array, high: Array) -> NDArray[np.int64]:
    """Return indices to keep: of each run of samples its ends, its lowest and its highest, so that no peak is lost."""
    n = len(low)
    if n <= POINTS:
        return np.arange(n)
    edges = np.linspace(0, n, POINTS // 4 + 1).astype(np.int64).tolist()
    chosen = {edges[-1] - 1}
    low, high = np.where(np.isnan(low), np.inf, low), np.where(np.isnan(high), -np.inf, high)
    for a, b in pairwise(edges):
        chosen |= {a, a + int(low[a:b].argmin()), a + int(high[a:b].argmax()), b - 1}
    return np.array(sorted(chosen), dtype=np.int64)


def _round_values(values: Array) -> Array:
    """Return the values as their seven digits are read. The quotient of whole numbers below 2^53, and of a power of ten
    up to the 22nd, is that number; what lies about the middle of two is written and read."""
    flat = np.asarray(values, float).ravel()
    with np.errstate(all="ignore"):  # 0, NaN and infinite values are written and read too
        power = _DIGITS - 1 - np.floor(np.log10(np.abs(flat)))
        up, down = 10.0 ** np.clip(power, 0, _EXACT), 10.0 ** np.clip(-power, 0, _EXACT)
        whole = np.rint(digits := flat * up / down)
        sure = (np.abs(digits - whole) < 0.5 - _UNSURE) & (np.abs(power) <= _EXACT)
    rounded = whole / up * down
    rounded[~sure] = [float(f"{v:.{_DIGITS}g}") for v in flat[~sure].tolist()]
    return np.asarray(rounded.reshape(np.shape(values)))
