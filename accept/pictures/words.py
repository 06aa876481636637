"""Units and numbers as people write them."""

import math
import re

_UNITS = {"um": "µm", "uF": "µF", "urad": "µrad", "[us]": "[µs]", "ohm": "Ω", "percent": "%"}
_WORDS = re.compile(r"\[us\]|(?<![A-Za-z_])(?:um|uF|urad|ohm|percent)(?![A-Za-z_])")


def pretty(text: str) -> str:
    """Return the text with µm for um, µF for uF, Ω for ohm, % for percent. Names such as `flatness_um` stay."""
    return _WORDS.sub(lambda found: _UNITS[found.group()], text)


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN = (1e-2, 1e5)  # numbers in here are written out, others as powers of ten


def number(value: float, digits: int = 6) -> str:
    """Return a number as 0.5, 200, 2·10⁻⁷, 10⁶; a power of ten with at most so many digits before it."""
    if _PLAIN[0] <= value < _PLAIN[1]:
        return f"{value:.10g}"
    power = math.floor(math.log10(value) + 1e-9)
    factor = round(value / 10.0**power, digits)
    ten = "10" + str(power).translate(_RAISED)
    return ten if factor == 1.0 else f"{factor:.{digits}g}·{ten}"
