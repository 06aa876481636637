"""The bench's own folder: event store, keys, tables."""

import os
from pathlib import Path

import platformdirs

from specs.errors import AcceptError


class HomeError(AcceptError, RuntimeError):
    """The bench's folder cannot be used; the text states the reason and the remedy."""


def home() -> Path:
    """Return the folder of the bench: `ACCEPT_HOME`, else the platform's place for application data. Made if absent."""
    chosen = os.environ.get("ACCEPT_HOME")
    path = Path(chosen) if chosen else platformdirs.user_data_path("accept", appauthor=False)
    try:
        path.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as e:
        raise HomeError(f"{path}: the bench's folder cannot be made ({e.strerror}); set ACCEPT_HOME to another") from e
    return path
