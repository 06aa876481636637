"""Numbers as short as they can be read."""

import math

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN = (1e-2, 1e5)  # numbers in here are written out, others as powers of ten


def number(value: float) -> str:
    """0.5, 200, 2·10⁻⁷, 10⁶."""
    if _PLAIN[0] <= value < _PLAIN[1]:
        return f"{value:.10g}"
    power = math.floor(math.log10(value) + 1e-9)
    factor = round(value / 10.0**power, 6)
    ten = "10" + str(power).translate(_RAISED)
    return ten if factor == 1.0 else f"{factor:g}·{ten}"
