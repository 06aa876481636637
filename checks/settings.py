"""Whether a spec sets a check's setting to something that it can be: of the default's kind, finite, and in order."""

import math
from typing import Any

from checks.declare import Setting


def setting_problem(setting: Setting, value: Any) -> str | None:
    """What is wrong with a value, in words; None where nothing is. The default tells what a setting is: a number, which
    is not negative where the default is not; a text; a pair, from and to; so many numbers or points; or, where the
    default is empty, any list of numbers."""
    default = setting.default
    if isinstance(default, str):
        return None if isinstance(value, str) else f"{value!r}: expected a text"
    if isinstance(default, list | tuple):
        return _list_problem(list(default), value)
    if not _is_number(value):
        return f"{value!r}: expected a finite number"
    if value < 0 <= default:
        return f"{value:g}: expected 0 or more"
    return None


def _list_problem(default: list[Any], value: Any) -> str | None:
    if not isinstance(value, list | tuple):
        return f"{value!r}: expected a list"
    if default and len(value) != len(default):
        return f"{len(value)} entries, expected {len(default)}"
    if default and isinstance(default[0], list | tuple):
        return next((p for v, d in zip(value, default, strict=True) if (p := _point_problem(v, len(d)))), None)
    if not all(_is_number(v) for v in value):
        return f"{value!r}: expected finite numbers"
    if len(default) == 2 and default[0] < default[1] and not value[0] < value[1]:
        return f"{value[0]:g} to {value[1]:g} is not a range; expected from < to"
    return None


def _point_problem(value: Any, size: int) -> str | None:
    good = isinstance(value, list | tuple) and len(value) == size and all(_is_number(v) for v in value)
    return None if good else f"{value!r}: expected {size} finite numbers"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
