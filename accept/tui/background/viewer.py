"""A file shown by the program that the desktop has for it."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from accept.base.child_processes import environment

_REMOTE = "SSH_CONNECTION", "SSH_TTY"  # the desktop is another computer's
_DISPLAYS = "DISPLAY", "WAYLAND_DISPLAY"


def viewer(given: Mapping[str, str] = os.environ, platform: str = sys.platform) -> Sequence[str]:
    """Return the command that opens a file in its own window, () if no desktop would show it."""
    if any(given.get(name) for name in _REMOTE):
        return ()
    if platform == "win32":
        return ("explorer",)
    if platform == "darwin":
        return ("open",)
    found = shutil.which("xdg-open", path=given.get("PATH")) if any(map(given.get, _DISPLAYS)) else None
    return (found,) if found else ()


def open_file(command: Sequence[str], path: Path) -> None:
    """Open a file, without waiting for its window. Raises OSError."""
    nothing, words = subprocess.DEVNULL, [*command, str(path)]
    subprocess.Popen(words, stdin=nothing, stdout=nothing, stderr=nothing, start_new_session=True, env=environment())
