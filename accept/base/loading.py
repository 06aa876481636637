"""The garbage collector while a command loads: what is loaded stays to the end, and to look through it again and again
takes a sixth of the time of a short command."""

import gc

_USUAL = gc.get_threshold()
_LOADING = (500_000, *_USUAL[1:])  # objects made until it looks: more than any command loads


def begin() -> None:
    """The program starts: it will load, hardly anything of it is garbage."""
    gc.set_threshold(*_LOADING)


def done() -> None:
    """The command is loaded and begins: from here on as usual, without what was loaded. Nothing where `begin` was not
    called, in a program that only borrows a command."""
    if gc.get_threshold() == _LOADING:
        gc.freeze()
        gc.set_threshold(*_USUAL)
