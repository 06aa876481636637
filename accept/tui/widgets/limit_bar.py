"""A value in place inside its limits, drawn in one line of characters."""

import math
from collections.abc import Sequence
from itertools import groupby, pairwise

from rich.text import Text

from accept.pictures.words import pretty
from checks.rounding import rounded, with_U

OUTSIDE, INSIDE, LIMIT, SPREAD, VALUE, USUAL = "┄", "━", "┃", "▬", "◆", "╎"
BLOCKS = "▁▂▃▄▅▆▇█"
_MARGIN = 0.35  # of the zone's width, shown on either side of it


def limit_bar(
    value: float | None,
    U: float | None,
    lower: float | None,
    upper: float | None,
    width: int,
    usual: float | None = None,
) -> str:
    """Draw in `width` characters: zone between the limits, the value in it, what U spans, and a tick at the usual value
    unless the value hides it. A value beyond the ends stands at the end as an arrow. Without a value only the zone."""
    lo, hi = _ends(value, lower, upper)
    cells = [_zone(lo + (hi - lo) * (i + 0.5) / width, lower, upper) for i in range(width)]

    def cell(x: float) -> int:
        return math.floor(width * (x - lo) / (hi - lo))

    for limit in (lower, upper):
        if limit is not None:
            cells[min(max(cell(limit), 0), width - 1)] = LIMIT
    if value is not None and math.isfinite(value) and U is not None and math.isfinite(U):
        for i in range(max(cell(value - U), 0), min(cell(value + U), width - 1) + 1):
            cells[i] = SPREAD if cells[i] != LIMIT else LIMIT
    if usual is not None and 0 <= cell(usual) < width and cells[cell(usual)] != LIMIT:
        cells[cell(usual)] = USUAL
    if value is not None and math.isfinite(value):
        at = cell(value)
        cells[min(max(at, 0), width - 1)] = VALUE if 0 <= at < width else ("◀" if at < 0 else "▶")
    return "".join(cells)


def coloured(bar: str, colour: str) -> Text:
    """Return a drawn bar in which the zone with its limits and the value has a colour, and all beyond it is dim."""
    styles = {OUTSIDE: "dim", USUAL: "bold"}
    runs = groupby(bar, key=lambda cell: styles.get(cell, colour))
    return Text.assemble(*(("".join(cells), style) for style, cells in runs))


def below_bar(value: float | None, lower: float | None, upper: float | None, width: int) -> str:
    """Return the numbers of the limits, each below its place in a bar."""
    lo, hi = _ends(value, lower, upper)
    cells = [" "] * width
    for limit in (lower, upper):
        if limit is None:
            continue
        words = f"{limit:g}"
        start = math.floor(width * (limit - lo) / (hi - lo)) - len(words) // 2
        start = max(0, min(start, width - len(words)))
        if not "".join(cells[max(0, start - 1) : start + len(words) + 1]).strip():
            cells[start : start + len(words)] = words
    return "".join(cells)


def spread_above(
    earlier: Sequence[float], value: float | None, lower: float | None, upper: float | None, width: int
) -> str:
    """Return how many earlier units lie above each place of a bar."""
    lo, hi = _ends(value, lower, upper)
    counts = [0] * width
    for each in earlier:
        place = math.floor(width * (each - lo) / (hi - lo)) if math.isfinite(each) else -1
        if 0 <= place < width:
            counts[place] += 1
    return blocks([float(count) for count in counts], width, empty=True)


def blocks(values: Sequence[float], width: int, *, empty: bool = False) -> str:
    """Return values as bars of one row, the last at the right, each the largest of those that share its column. empty:
    nothing stands where the value is zero."""
    known = [v for v in values if math.isfinite(v)]
    if not known:
        return " " * width
    edges = [round(n * len(known) / width) for n in range(width + 1)] if len(known) > width else []
    shown = [max(known[a:b]) for a, b in pairwise(edges)] or known
    lo, hi = (0.0 if empty else min(shown)), max(shown)
    steps = [round((len(BLOCKS) - 1) * (v - lo) / (hi - lo)) if hi > lo else 0 for v in shown]
    drawn = "".join(" " if empty and v == 0.0 else BLOCKS[n] for n, v in zip(steps, shown, strict=True))
    return drawn.rjust(width)


def _ends(value: float | None, lower: float | None, upper: float | None) -> tuple[float, float]:
    """Return what the line spans: the zone and a margin; with one limit, from zero or to beyond the value."""
    reach = abs(value) if value is not None and math.isfinite(value) else 0.0
    if lower is not None and upper is not None:
        margin = _MARGIN * (upper - lower)
        return lower - margin, upper + margin
    limit = upper if upper is not None else (lower or 0.0)
    far = max(abs(limit) * (1 + _MARGIN), 1.1 * min(reach, 3 * abs(limit)), 1e-12)
    return (0.0, far) if limit >= 0 else (-far, 0.0)


def _zone(x: float, lower: float | None, upper: float | None) -> str:
    return INSIDE if (lower is None or lower <= x) and (upper is None or x <= upper) else OUTSIDE


def numbers(value: float | None, U: float | None, unit: str) -> str:
    """Return `value ± U unit` with as many digits as U carries."""
    of = after_number(unit)
    if value is None:
        return f"no value{of}"
    if U is None:
        return f"{value:.4g}{of}, U unknown"
    return f"{with_U(value, U) if U > 0 else f'{rounded(value, U)} ± 0'}{of}"


def alike(value: float, others: Sequence[float], digits: int) -> str:
    """Return a number with as many decimals as the longest of the others has in so many digits."""
    written = [f"{each + 0.0:.{digits}g}" for each in (value, *others)]  # no "-0"
    if any("e" in words for words in written):
        return written[0]
    return f"{value + 0.0:.{max(len(words.partition('.')[2]) for words in written)}f}"


def usual_words(usual: float | None) -> str:
    """Return what the tick in a bar is, "" without one."""
    return "" if usual is None else f"   {USUAL} usual {usual:.3g}"


def after_number(unit: str) -> str:
    """Return the unit as people write it behind a number: a pure number has none."""
    return "" if unit in ("", "1") else f" {pretty(unit)}"


def limits(lower: float | None, upper: float | None, unit: str) -> str:
    """Return the limits in words; one of them is given."""
    if lower is None or upper is None:
        words = f"≤ {upper:g}" if upper is not None else f"≥ {lower:g}"
    else:
        words = f"{lower:g} … {upper:g}"
    return f"{words}{after_number(unit)}"
