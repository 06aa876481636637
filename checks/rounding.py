"""Rounded numbers for display: a value to the second digit of its uncertainty. No verdict depends on them."""

import math

MOST_DECIMALS = 9  # more are never read
BELIEVED = 1e-4  # of a value: a smaller U is not credible for a measurement here, so it is shown as below a digit
LARGE = 1e12  # above, digits to U would run beyond those of a float


def decimals_of(U: float) -> int:
    """Return the number of decimals that leave two digits of U ([JCGM100] 7.2.6), negative for tens and hundreds; U
    finite and above 0.

    The count is that of the rounded U: 0.0999 has two digits in 0.100."""
    return 1 - int(f"{U:.1e}".split("e")[1])


def rounded(value: float, U: float | None) -> str:
    """Return the value rounded to the decimals of U, to six digits if U is unknown, 0 or much larger than the value."""
    if U is None or not math.isfinite(U) or U <= 0.0 or decimals_of(U) > MOST_DECIMALS or abs(value) >= LARGE:
        return f"{value:.6g}"
    return fixed(value, decimals_of(U))


def with_U(value: float, U: float) -> str:
    """Return `93.918 ± 0.019`; `0.2957 ± less than 0.0001` if U is above 0 but under 1e-4 of the value."""
    if not 0.0 < U < BELIEVED * abs(value) or not math.isfinite(value) or abs(value) >= LARGE:
        return f"{rounded(value, U)} ± {rounded_U(U)}"
    decimals = 3 - math.floor(math.log10(abs(value)))
    return f"{fixed(value, decimals)} ± less than {10.0**-decimals:.10g}"


def rounded_U(U: float) -> str:
    """Return U rounded to two digits; U finite and above 0."""
    return f"{U:.2g}" if decimals_of(U) > MOST_DECIMALS else fixed(U, decimals_of(U))


def fixed(value: float, decimals: int) -> str:
    """Return the value with this number of decimals, never as "-0.0"."""
    return f"{round(value, decimals) + 0.0:.{max(0, decimals)}f}"
