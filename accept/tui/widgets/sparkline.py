"""Numbers as bars of one row, and a share of a whole as a line."""

from collections.abc import Sequence

_BARS = "▁▂▃▄▅▆▇█"
_DONE, _LEFT = "━", "┄"


def sparkline(values: Sequence[float], zero: bool = False) -> str:
    """Return a bar per value, the lowest and the highest as the scale. zero: the scale begins there, and nothing stands
    for none."""
    lowest, highest = (0.0 if zero else min(values, default=0.0)), max(values, default=0.0)
    if highest <= lowest:
        return "".join(" " if zero else _BARS[3] for _ in values)
    steps = (len(_BARS) - 1) / (highest - lowest)
    return "".join(" " if zero and not value else _BARS[round((value - lowest) * steps)] for value in values)


def share(part: float, whole: float, width: int) -> tuple[str, str]:
    """Return the part of a whole that is done and the one that is left, together so many columns."""
    done = round(width * part / whole) if whole else 0
    return _DONE * done, _LEFT * (width - done)
