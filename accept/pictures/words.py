"""Units as people write them."""

import re

_UNITS = {"um": "µm", "uF": "µF", "urad": "µrad", "[us]": "[µs]", "ohm": "Ω", "percent": "%"}
_WORDS = re.compile(r"\[us\]|(?<![A-Za-z_])(?:um|uF|urad|ohm|percent)(?![A-Za-z_])")


def pretty(text: str) -> str:
    """Text with µm for um, µF for uF, Ω for ohm, and % for percent; names such as `flatness_um` stay as they are."""
    return _WORDS.sub(lambda found: _UNITS[found.group()], text)
