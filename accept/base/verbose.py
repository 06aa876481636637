"""`accept -v`: files and ports that the program opens, on stderr; `-vv`: also every byte and the libraries' logs."""

import atexit
import logging
import os
import platform
import sys
import time
from pathlib import Path

from accept.base.home import home
from accept.base.plain_text import one_line, without_secrets
from accept.base.version import code_sha256, program
from specs import plugins

NAME = "verbose.log"  # in ACCEPT_HOME/log, of a command that fills the screen
FULL_SCREEN = ("run",)
log = logging.getLogger("accept")


def begin(level: int, command: str | None) -> None:
    """Log from now on: level 1 opened files and ports, 2 everything. On stderr; for a full screen in a new file."""
    handler = logging.StreamHandler(sys.stderr) if command not in FULL_SCREEN else _file_handler()
    handler.setFormatter(_Plain("%(asctime)s.%(msecs)03d %(name)s: %(message)s", "%H:%M:%S"))
    root = logging.getLogger() if level > 1 else log
    root.addHandler(handler)
    root.setLevel(logging.DEBUG if level > 1 else logging.INFO)
    log.setLevel(root.level)
    began = time.monotonic()
    log.info(
        "accept %s, code %s, Python %s, %s", program(), code_sha256()[:12], platform.python_version(), sys.platform
    )
    log.info("folder of the bench %s", home())
    log.info(
        "variables that are set: %s", ", ".join(sorted(k for k in os.environ if k.startswith("ACCEPT_"))) or "none"
    )
    atexit.register(lambda: _ended(time.monotonic() - began))


def _ended(seconds: float) -> None:
    for plugin in plugins.USED:
        log.info("plug-in %s of %s %s", plugin.name, plugin.package, plugin.version)
    log.info("ended after %.1f s", seconds)


def _file_handler() -> logging.Handler:
    path: Path = home() / "log" / NAME
    path.parent.mkdir(mode=0o700, exist_ok=True)
    print(f"accept: what it reads and opens is logged in {one_line(str(path))}", file=sys.stderr)
    return logging.FileHandler(path, mode="w", encoding="utf-8")


class _Plain(logging.Formatter):
    """A name of a file writes no line of its own and moves no cursor."""

    def format(self, record: logging.LogRecord) -> str:
        return one_line(without_secrets(super().format(record)))
