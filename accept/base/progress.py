"""A bar at the bottom of the terminal during long work: how many of how many are done, and since when.

It is drawn on stderr, and only on a terminal that can redraw a line: files, pipes and workers get only the messages.
Bars can be nested (units, and the rows of a table that one of them needs); messages are printed above them, and the
bars are erased at the end."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import parent_process
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress

T = TypeVar("T")
_bars: Progress | None = None  # of this process; a terminal has one bottom


def steps(items: Iterable[T], words: str, of: int | None = None) -> Iterator[T]:
    """Yield the items beside a progress bar. of: their number, if the iterable has no length."""
    known = len(items) if of is None and hasattr(items, "__len__") else of  # type: ignore[arg-type]
    with _bar(words, known if known != 1 else None) as advance:
        for item in items:
            yield item
            advance()


@contextmanager
def busy(words: str) -> Iterator[None]:
    """Yield beside a bar that only moves, for work of unknown length."""
    with _bar(words, None):
        yield


@contextmanager
def _bar(words: str, of: int | None) -> Iterator[Callable[[], None]]:
    global _bars
    if not _can_redraw():
        yield lambda: None
        return
    outermost = _bars is None
    bars = _bars = _bars or _begun()
    row = bars.add_task(words, total=of)
    try:
        yield lambda: bars.advance(row)
    finally:
        bars.remove_task(row)
        if outermost:
            _bars = None
            bars.stop()


def _can_redraw() -> bool:
    if parent_process() is not None or os.environ.get("TERM", "") in ("", "dumb", "unknown"):
        return False
    try:  # asked of the system: the screens replace stderr by an object that claims to be a terminal
        return os.isatty(sys.stderr.fileno())
    except (AttributeError, OSError, ValueError):
        return False


def _begun() -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    bars = Progress(
        *columns,
        console=Console(stderr=True, highlight=False, markup=False),
        transient=True,
        redirect_stdout=sys.stdout.isatty(),  # else it is data on its way to a file
    )
    bars.start()
    return bars
