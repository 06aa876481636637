"""The names of persons; a module of its own, because the workflow asks for it before anything slow is imported."""

import getpass
import sys

_FIRST_PERSON = 501 if sys.platform == "darwin" else 1000  # number of the first account that is a person's
_NOBODY = 65534


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
