"""What the program is called where packages are installed, and how its extras are installed."""

NAME = "accept-bench"  # `accept` is a stranger's on the package index; the command and the import keep that name


def install(extra: str) -> str:
    """Return the command that installs an extra."""
    return f"pip install '{NAME}[{extra}]'"
