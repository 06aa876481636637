"""The name of the program's package, and the command that installs an extra."""

NAME = "accept-bench"  # `accept` is a stranger's on the package index; the command and the import keep that name


def install(extra: str) -> str:
    """Return the command that installs an extra."""
    return f"pip install '{NAME}[{extra}]'"
