"""Numbers as printed on a certificate. For the eye only: nothing is judged on them."""

import math
from collections.abc import Mapping
from typing import Any

from checks.rounding import with_U


def value_and_U(value: float | None, U: float | None) -> tuple[str, str]:
    """Return value and U with two significant digits of U, the value to the same place; with an unknown U six digits
    and "?". An implausibly small U is shown as less than the last of four digits."""
    if value is None:
        return "–", ""
    if U is None or not math.isfinite(U) or U <= 0:
        return _signed(f"{value:.6g}"), "0" if U == 0 else "?"
    shown, _, shown_U = with_U(value, U).partition(" ± ")
    return _signed(shown), shown_U


def _signed(text: str) -> str:
    """Return a typeset minus, and none before a zero."""
    zero = not any(c in "123456789" for c in text.split("e")[0])
    return text.lstrip("-") if zero else text.replace("-", "−")


def limits(finding: Mapping[str, Any]) -> str:
    """Return the limits of a finding, as its row prints them."""
    lower, upper = finding["lower"], finding["upper"]
    if lower is not None and upper is not None:
        return f"{_plain(lower)} … {_plain(upper)}"
    return f"≥ {_plain(lower)}" if lower is not None else f"≤ {_plain(upper)}"


def _plain(number: float) -> str:
    """Return a limit with all its digits: it is given, not measured."""
    return _signed(f"{number:.12g}")


def risk(probability: float | None, verdict: str) -> str:
    """Return the probability of false acceptance in percent, "" if the finding is not accepted."""
    if probability is None:
        return "–"
    if verdict == "fail":
        return "0 %"
    return f"{100 * probability:.2g} %" if probability >= 1e-5 else "< 0.001 %"
