"""Opening the bench's keys for a command: which passphrase, whose key, made when there is none."""

import getpass
import os
import sys
from pathlib import Path

from accept.base.console import say
from accept.certificate import keys
from accept.certificate.keys import TECHNICIAN, Credential, KeysError

DEMO = "demo"  # keys and events of the demo, apart from those of the bench: a demo must never sign as the bench
_DEMO_PASSPHRASE = "demo"  # no secret: the demo's CA is trusted for documents marked as demonstrations only


def terminal_prompt(words: str) -> str | None:
    """What the person types, None where there is no terminal to ask at."""
    return getpass.getpass(words) if sys.stdin.isatty() else None


def passphrase_of(file: Path | None, words: str, variable: str = keys.PASSPHRASE) -> str:
    """Passphrase from a file named on the command line, the environment, or the terminal. Raises KeysError.

    variable : asked before `ACCEPT_PASSPHRASE`.
    """
    if file is not None:
        try:
            return file.read_text(encoding="utf-8").rstrip("\r\n")
        except OSError as e:
            raise KeysError(f"{file}: no passphrase can be read from it ({e.strerror})") from e
        except UnicodeDecodeError as e:
            raise KeysError(f"{file}: no passphrase can be read from it (it is not UTF-8)") from e
    given = os.environ.get(variable)
    return keys.passphrase(given, prompt=(lambda: terminal_prompt(words) or "") if sys.stdin.isatty() else None)


def bench_credential(home: Path, operator: str) -> Credential | None:
    """The technician's key of the bench, made when there is none. None, and a word why, when no passphrase is given:
    the units are judged all the same."""
    try:
        phrase = passphrase_of(None, f"passphrase of the technician's key in {home}: ")
    except KeysError as e:
        say(f"no certificates are written: {e}")
        return None
    if not keys.exist(home):
        keys.init(home, phrase, operator, "quality assurance")
        say(f"made the bench's keys in {keys.folder(home)}; `accept keys list` shows them")
    return keys.unlock(home, TECHNICIAN, phrase)


def demo_credential(home: Path) -> Credential:
    """The technician's key of the demo, made when there is none."""
    place = home / DEMO
    if not keys.exist(place):
        keys.init(place, _DEMO_PASSPHRASE, "Demo technician", "Demo quality assurance")
    return keys.unlock(place, TECHNICIAN, _DEMO_PASSPHRASE)
