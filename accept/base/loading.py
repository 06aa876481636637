"""How a command loads. Loaded objects stay to the end; walking them again and again in search of garbage takes a sixth
of the time of a short command."""

import gc
import os

SAFE_PATH = "PYTHONSAFEPATH"  # set: a process imports nothing from the folder that it is started in
_USUAL = gc.get_threshold()
_LOADING = (500_000, *_USUAL[1:])  # objects made until it looks: more than any command loads


def import_nothing_from_here() -> None:
    """Let no process that is started from now on import from its working folder, whatever starts it."""
    os.environ[SAFE_PATH] = "1"


def begin() -> None:
    """Stop garbage collection while the program loads: hardly anything is garbage."""
    gc.set_threshold(*_LOADING)


def done() -> None:
    """Resume garbage collection, without the loaded objects. Does nothing without `begin`."""
    if gc.get_threshold() == _LOADING:
        gc.freeze()
        gc.set_threshold(*_USUAL)
