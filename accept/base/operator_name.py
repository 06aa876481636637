"""Who is at the bench; apart from the other talk, because the workflow asks before anything slow is imported."""

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
