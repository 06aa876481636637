"""Names of persons: the operator's, and two that a reader takes for one, which are one person ([UTS39], skeletons).

The workflow asks for the operator before anything slow is imported: nothing slow is imported here.
"""

import getpass
import sys
import tomllib
import unicodedata
from functools import cache
from pathlib import Path

_FIRST_PERSON = 501 if sys.platform == "darwin" else 1000  # number of the first account that is a person's
_NOBODY = 65534
_EAST_ASIAN = {"CJK", "HIRAGANA", "KATAKANA", "HANGUL", "BOPOMOFO", "KATAKANA-HIRAGANA"}  # written beside Latin letters


class KeyHolder(str):
    """The name on a key that its holder opened. An event under any other name is marked `typed`."""


def shown_name(who: str, typed: bool) -> str:
    """Return the name of a person as printed beside a decision."""
    return f"{who} (typed)" if typed else str(who)


def operator_name(given: str | None) -> str:
    """Return the given operator, else the login name, else `unknown`, which the certificate then shows."""
    if given:
        return given
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "unknown"


def is_system_account(name: str) -> bool:
    """Return whether a name is a system account, such as root: a person does not sign with it."""
    try:
        import pwd  # not on every system

        number = pwd.getpwnam(name).pw_uid
    except (ImportError, KeyError, ValueError):
        return name in ("unknown", "root", "Administrator", "SYSTEM")
    return not _FIRST_PERSON <= number < _NOBODY


def same_person(one: str, other: str) -> bool:
    """Return whether two names are the same to a reader: apart from case, spaces, punctuation and what shows nothing,
    the composition of letters, and letters that look alike."""
    return _folded(one) == _folded(other) or skeleton(one) == skeleton(other)


@cache
def _prototypes() -> dict[int, str]:
    """Return the Latin letters of each letter that looks like them, by its code."""
    alike = tomllib.loads((Path(__file__).parent / "confusable_letters.toml").read_text(encoding="utf-8"))
    by_code = {ord(letter): latin for latin, letters in alike.items() for letter in letters}
    return by_code | {ord("I"): "l", ord("1"): "l", ord("|"): "l", ord("0"): "O"}


def skeleton(name: str) -> str:
    """Return what names that look alike have in common."""
    plain = unicodedata.normalize("NFKC", name).translate(_prototypes())
    return _letters(plain.casefold().translate(_prototypes())).replace("rn", "m").replace("vv", "w")


def scripts(name: str) -> set[str]:
    """Return the scripts of the letters in a name, without those that are commonly written beside others."""
    letters = (c for c in unicodedata.normalize("NFKC", name) if c.isalpha())
    return {unicodedata.name(c, "?").split()[0] for c in letters} - _EAST_ASIAN


def _folded(name: str) -> str:
    return _letters(unicodedata.normalize("NFKC", name).casefold())


def _letters(text: str) -> str:
    """Return letters and digits alone, without the letters of Hangul that show nothing. Of other text nothing is left
    out, so that two names of signs alone are not one."""
    return "".join(c for c in text if c.isalnum() and c not in "\u115f\u1160") or text
