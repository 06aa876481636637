"""The operator's name; a module of its own, because the workflow asks for it before anything slow is imported."""

import getpass


def operator_name(given: str | None) -> str:
    """Return the operator named, else the login name; a machine without one is `unknown`, which the certificate then
    shows."""
    if given:
        return given
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "unknown"
