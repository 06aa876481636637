"""Regular expressions that a file brings: only those that match any text in little time.

A repeat inside a repeat, or alternatives inside one, can take time that doubles with every letter (`(a+)+x`)."""

import re
from re import _constants as op  # type: ignore[attr-defined]
from re import _parser as parser  # type: ignore[attr-defined]
from typing import Any

LONGEST = 200  # characters of a pattern
MOST_REPEATS = 3  # of variable length, one after the other: time grows with the length to this power
_REPEATS = tuple(getattr(op, name) for name in ("MAX_REPEAT", "MIN_REPEAT", "POSSESSIVE_REPEAT") if hasattr(op, name))


def pattern_problem(pattern: str) -> str | None:
    """Return why a regular expression is refused, None if it is not."""
    if len(pattern) > LONGEST:
        return f"is longer than {LONGEST} characters"
    try:
        re.compile(pattern)
        tree = parser.parse(pattern)
    except (re.error, RecursionError, OverflowError) as e:
        return f"is not a regular expression: {e}"
    counts: list[int] = []
    if words := _problem(tree, repeated=False, counts=counts):
        return words
    if sum(counts) > MOST_REPEATS:
        return f"has {sum(counts)} repeats of variable length; at most {MOST_REPEATS} are matched in little time"
    return None


def _problem(tree: Any, repeated: bool, counts: list[int]) -> str | None:
    """Return the fault of a part of a pattern; its repeats of variable length are added to `counts`."""
    for code, argument in tree:
        if code in _REPEATS:
            least, most, inner = argument
            variable = least != most and most > 1
            if repeated and least != most:
                return "has a repeat inside a repeat, which may take for ever to match"
            counts.append(variable)
            found = _problem(inner, repeated or most > 1, counts)
        elif code is op.BRANCH:
            if repeated:
                return "has alternatives inside a repeat, which may take for ever to match"
            found = next((f for part in argument[1] if (f := _problem(part, repeated, counts))), None)
        elif code in (op.GROUPREF, op.GROUPREF_EXISTS, op.ASSERT, op.ASSERT_NOT):
            return "refers to what it has matched or looks ahead, which may take for ever to match"
        elif code is op.SUBPATTERN:
            found = _problem(argument[-1], repeated, counts)
        else:
            found = _problem(argument, repeated, counts) if code is getattr(op, "ATOMIC_GROUP", None) else None
        if found:
            return found
    return None
