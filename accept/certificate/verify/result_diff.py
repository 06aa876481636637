"""Differences between the result on a certificate and the one judged again from its attachments."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from checks.verdict import UnitVerdict, Verdict

# Another processor sums in another order; nothing physical is that small.
_RELATIVE = 1e-6
_ABSOLUTE = 1e-12  # for values about zero; below what any quantity shows in its unit
# A tail probability moves faster than the value it belongs to: by z dz, and z is 5 at 1e-6.
_RELATIVE_RISK = 1e-3  # so do the G and the p of a cause, which its sentence rounds to three digits
_RELATIVE_WORDS = 1e-4  # numbers in sentences are rounded to six digits and fewer
_CHARACTERS = 2  # by which rounding changes the length of a number: "0.3", "0.301"; more could push words off the page
ONLY_AGAIN = " is only judged again"  # how a line ends about what the attached result does not mention
_SAID = frozenset({"note", "notes", "reason", "sentence", "source"})  # how something is said; causes have codes beside
# Texts as they were given.
_NAMED = frozenset({"serial", "kind", "parts", "inputs", "models", "origin", "measured", "provided"})
_ENTRY = re.compile(r"(findings|information)\[(\w+)\]\.(\w+)")
_COMPUTED = frozenset({"value", "U", "budget", "p_false_accept", "cause", "verdict"})
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def differences(attached: Any, again: Any, path: str = "") -> list[str]:
    """Return one line for each place where two results differ by more than rounding, with the path to it."""
    if isinstance(attached, Mapping) and isinstance(again, Mapping):
        keys = sorted({*attached, *again})
        return [line for key in keys for line in _entry(attached, again, key, f"{path}.{key}" if path else str(key))]
    if _is_list(attached) and _is_list(again) and len(attached) == len(again):
        return [
            line
            for nth, (a, b) in enumerate(zip(attached, again, strict=True))
            for line in differences(a, b, f"{path}[{_name(a, nth)}]")
        ]
    if _is_list(attached) and _is_list(again):
        return [f"{path} has {len(attached)} entries attached, {len(again)} judged again"]
    return [] if _same(attached, again, path) else [f"{path} is {attached!r} attached, {again!r} judged again"]


def is_said_otherwise(line: str) -> bool:
    """Return whether a line of `differences` concerns only words, and no number, limit, cause or verdict."""
    key = line.partition(" ")[0].rpartition(".")[2].partition("[")[0]
    return key in _SAID


def is_within_U(line: str, attached: Mapping[str, Any], again: Mapping[str, Any]) -> bool:
    """Return whether a line of `differences` may stand between the results of two versions of the program: it concerns
    a value that both judge alike and that differs by no more than the U that is found now, one that the attached result
    does not claim, or a number beside what is judged. A U that is attached widens nothing."""
    path = line.partition(" ")[0]
    entry = _ENTRY.match(path)
    if entry is None:
        return path == "verdict" and not _is_accepted(attached)
    kind, quantity, key = entry.groups()
    if key not in _COMPUTED:
        return False
    if kind == "information":
        return True
    one, other = (_finding(result, quantity) for result in (attached, again))
    if one.get("verdict") == Verdict.NO_RESULT:
        return not _is_accepted(attached)
    if one.get("verdict") != other.get("verdict"):
        return False
    stated = (one.get("value"), one.get("U"), other.get("value"), other.get("U"))
    match [n for n in stated if isinstance(n, int | float)]:
        case [claimed, _, value, U]:
            return bool(abs(claimed - value) <= U)
    return False


def _finding(result: Mapping[str, Any], quantity: str) -> Mapping[str, Any]:
    return next((f for f in result["findings"] if f["quantity"] == quantity), {})


def _is_accepted(result: Mapping[str, Any]) -> bool:
    return result["verdict"] in (UnitVerdict.ACCEPTED, UnitVerdict.CONDITIONAL)


def _entry(attached: Mapping[str, Any], again: Mapping[str, Any], key: str, path: str) -> list[str]:
    if key not in attached or key not in again:
        return [f"{path} is only attached" if key in attached else f"{path}{ONLY_AGAIN}"]
    return differences(attached[key], again[key], path)


def _same(a: Any, b: Any, path: str) -> bool:
    if isinstance(a, bool) or isinstance(b, bool):
        return a is b
    if not isinstance(a, int | float) or not isinstance(b, int | float):
        words = isinstance(a, str) and isinstance(b, str) and path.partition(".")[0] not in _NAMED
        return a == b or (words and same_words(a, b))
    relative = _RELATIVE_RISK if path.endswith("p_false_accept") or ".cause." in path else _RELATIVE
    return math.isclose(a, b, rel_tol=relative, abs_tol=_ABSOLUTE)


def same_words(a: str, b: str) -> bool:
    """Return whether two sentences are the same apart from digits of rounded numbers."""
    if _NUMBER.sub("#", a) != _NUMBER.sub("#", b) or abs(len(a) - len(b)) > _CHARACTERS:
        return False
    numbers = zip(_NUMBER.findall(a), _NUMBER.findall(b), strict=True)
    return all(x == y or ("." in x + y and _near(x, y)) for x, y in numbers)


def _near(x: str, y: str) -> bool:
    as_long = abs(len(x) - len(y)) <= _CHARACTERS
    return as_long and math.isclose(float(x), float(y), rel_tol=_RELATIVE_WORDS, abs_tol=_ABSOLUTE)


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _name(entry: Any, nth: int) -> str:
    return str(entry["quantity"]) if isinstance(entry, Mapping) and "quantity" in entry else str(nth)
