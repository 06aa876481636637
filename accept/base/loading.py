"""The garbage collector while a command loads: what is loaded stays to the end, and to look through it again and again
takes a sixth of the time of a short command."""

import gc

_USUAL = gc.get_threshold()
_LOADING = (500_000, *_USUAL[1:])  # objects made until it looks: more than any command loads


def begin() -> None:
    """Hold the garbage collector while the program loads: hardly anything of it is garbage."""
    gc.set_threshold(*_LOADING)


def done() -> None:
    """Let the garbage collector run again, without what was loaded. Do nothing if `begin` was not
    called, in a program that only borrows a command."""
    if gc.get_threshold() == _LOADING:
        gc.freeze()
        gc.set_threshold(*_USUAL)
