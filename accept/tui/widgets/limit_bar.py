"""A value in place inside its limits, drawn in one line of characters."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from rich.text import Text

from accept.pictures.words import pretty
from checks.rounding import rounded, with_U

OUTSIDE, INSIDE, LIMIT, SPREAD, VALUE, USUAL = "┄", "━", "┃", "▬", "◆", "╎"
BLOCKS = "▁▂▃▄▅▆▇█"
_MARGIN = 0.35  # of the zone's width, shown on either side of it


@dataclass(frozen=True)
class LimitBar:
    """One line of so many columns that spans the zone between the limits and a margin; with one limit, from zero or to
    beyond the value. value: None shows the zone alone."""

    lower: float | None
    upper: float | None
    width: int
    value: float | None = None

    def drawn(self, colour: str, U: float | None = None, usual: float | None = None) -> Text:
        """Return the zone, the value in it, what U spans, and a tick at the usual value unless the value hides it; what
        lies beyond the zone is dim. A value beyond the ends stands at the end as an arrow."""
        lo, hi = self._ends
        cells = [self._zone(lo + (hi - lo) * (i + 0.5) / self.width) for i in range(self.width)]
        for limit in self._limits:
            cells[min(max(self._place(limit), 0), self.width - 1)] = LIMIT
        if self.value is not None and math.isfinite(self.value) and U is not None and math.isfinite(U):
            for i in range(max(self._place(self.value - U), 0), min(self._place(self.value + U), self.width - 1) + 1):
                cells[i] = SPREAD if cells[i] != LIMIT else LIMIT
        if usual is not None and 0 <= (at := self._place(usual)) < self.width and cells[at] != LIMIT:
            cells[at] = USUAL
        if self.value is not None and math.isfinite(self.value):
            at = self._place(self.value)
            cells[min(max(at, 0), self.width - 1)] = VALUE if 0 <= at < self.width else ("◀" if at < 0 else "▶")
        styles = {OUTSIDE: "dim", USUAL: "bold"}
        runs = groupby(cells, key=lambda cell: styles.get(cell, colour))
        return Text.assemble(*(("".join(run), style) for style, run in runs))

    def numbers_below(self) -> Text:
        """Return the numbers of the limits, each below its place."""
        cells = [" "] * self.width
        for limit in self._limits:
            words = f"{limit:g}"
            start = max(0, min(self._place(limit) - len(words) // 2, self.width - len(words)))
            if not "".join(cells[max(0, start - 1) : start + len(words) + 1]).strip():
                cells[start : start + len(words)] = words
        return Text("".join(cells), "dim")

    def spread_above(self, earlier: Sequence[float]) -> Text:
        """Return how many earlier units lie above each place."""
        counts = [0.0] * self.width
        for each in earlier:
            place = self._place(each) if math.isfinite(each) else -1
            if 0 <= place < self.width:
                counts[place] += 1
        return Text(blocks(counts, self.width, empty=True), "dim")

    @property
    def _limits(self) -> list[float]:
        return [limit for limit in (self.lower, self.upper) if limit is not None]

    @property
    def _ends(self) -> tuple[float, float]:
        if self.lower is not None and self.upper is not None:
            margin = _MARGIN * (self.upper - self.lower)
            return self.lower - margin, self.upper + margin
        reach = abs(self.value) if self.value is not None and math.isfinite(self.value) else 0.0
        limit = next(iter(self._limits), 0.0)
        far = max(abs(limit) * (1 + _MARGIN), 1.1 * min(reach, 3 * abs(limit)), 1e-12)
        return (0.0, far) if limit >= 0 else (-far, 0.0)

    def _place(self, x: float) -> int:
        lo, hi = self._ends
        return math.floor(self.width * (x - lo) / (hi - lo))

    def _zone(self, x: float) -> str:
        inside = (self.lower is None or self.lower <= x) and (self.upper is None or x <= self.upper)
        return INSIDE if inside else OUTSIDE


def blocks(values: Sequence[float], width: int, *, empty: bool = False) -> str:
    """Return values as bars of one row, the last at the right, each the largest of those that share its column. empty:
    nothing stands where the value is zero."""
    known = [v for v in values if math.isfinite(v)]
    if not known:
        return " " * width
    edges = [round(n * len(known) / width) for n in range(width + 1)] if len(known) > width else []
    shown = [max(known[a:b]) for a, b in pairwise(edges)] or known
    lo, hi = (0.0 if empty else min(shown)), max(shown)
    return "".join(" " if empty and v == 0.0 else block(v, lo, hi) for v in shown).rjust(width)


def block(value: float, lo: float, hi: float) -> str:
    """Return a bar of one cell: the lowest at one end of a range, the highest at the other alone."""
    return BLOCKS[round((len(BLOCKS) - 1) * (value - lo) / (hi - lo))] if hi > lo else BLOCKS[0]


def share_bar(parts: Sequence[tuple[float, str]], whole: float, width: int) -> Text:
    """Return a bar that is filled as far as parts of the whole go, each in its style and seen if there is one."""
    bar, done = Text(), 0.0
    for count, style in parts:
        done += count
        bar.append(INSIDE * max(round(width * done / whole) - len(bar), 1 if count else 0), style)
    bar.truncate(width)
    return bar.append(OUTSIDE * (width - len(bar)), "dim")


def numbers(value: float | None, U: float | None, unit: str) -> str:
    """Return `value ± U unit` with as many digits as U carries."""
    of = after_number(unit)
    if value is None:
        return "no value"
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
