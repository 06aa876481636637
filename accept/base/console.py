"""The console of every command: messages on stderr, one clear line for an error, the operator's name."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import wraps
from typing import Any, ParamSpec

from rich.console import Console, ConsoleOptions, OverflowMethod, RenderableType
from rich.segment import Segment
from rich.table import Table

from accept.base import loading
from accept.base.exit_codes import Exit
from accept.base.names import operator_name
from accept.base.plain_text import lines, one_line, without_secrets
from specs import plugins
from specs.errors import AcceptError

__all__ = ["KNOWN_ERRORS", "ask", "clear_errors", "confirm", "one_line", "operator_name", "say", "stdout", "tell"]

P = ParamSpec("P")


class PlainConsole(Console):
    """Escapes control characters, in cells of tables too, and keeps each value on its own line, so that no name can
    imitate an answer; its own colours stay."""

    def print(self, *objects: Any, **options: Any) -> None:
        super().print(*map(_on_one_line, objects), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(lines(segment.text), segment.style)


KNOWN_ERRORS = (AcceptError, OSError)

# A file or a pipe has no width: a table cut to 80 columns would lose a script's values. Without markup: it would
# take "[percent]" or "[a]" in a file's name for a style and drop it.
stdout = PlainConsole(highlight=False, markup=False, soft_wrap=False, width=None if sys.stdout.isatty() else 240)


def say(words: str) -> None:
    """Write a message to stderr, so that stdout stays data. Further lines are indented: a line break in a name cannot
    imitate a line of the program."""
    print(lines(words).replace("\n", "\n    "), file=sys.stderr, flush=True)


def confirm(question: str) -> bool | None:
    """Ask a question at the terminal and return the answer; None without a terminal to ask at."""
    answer = ask(f"{question} [y/N]")
    return None if answer is None else answer.lower() in ("y", "yes")


def ask(question: str) -> str | None:
    """Ask for a line of text at the terminal and return it; None without a terminal to ask at."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return None
    print(f"{one_line(question)} ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip()


def tell(*words: str) -> None:
    """Write lines of an answer to stdout, without markup and of any length, each one line."""
    print("\n".join(map(one_line, words)), flush=True)


def _on_one_line(shown: Any) -> Any:
    """Return a text, or a table's cells, without line breaks; column titles may have some, they are the program's own.
    On a narrow terminal a long word goes on in the next line of its cell: rich would put dots for its end."""
    if isinstance(shown, Table):
        folded: dict[OverflowMethod, OverflowMethod] = {"ellipsis": "fold"}
        shown.columns = [
            replace(c, _cells=[_on_one_line(cell) for cell in c.cells], overflow=folded.get(c.overflow, c.overflow))
            for c in shown.columns
        ]
    return one_line(shown) if isinstance(shown, str) else shown


def clear_errors(command: Callable[P, Exit]) -> Callable[P, Exit]:
    """Return a command that turns bad input, an unwritable folder and an unusable store into a message and exit 6."""

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> Exit:
        loading.done()
        known = _say_problems(0)
        try:
            return command(*args, **kwargs)
        except BrokenPipeError:
            raise
        except KNOWN_ERRORS as e:
            say(f"accept: {_words(e)}")
            return Exit.BAD_INPUT
        except MemoryError:
            say(f"accept: {_too_large()}")
            return Exit.BAD_INPUT
        except KeyboardInterrupt:
            say("accept: stopped; what is finished is kept; run the command again to continue")
            return Exit.STOPPED
        finally:
            _say_problems(known)  # of products, which are looked up when one is needed

    return run


def _say_problems(known: int) -> int:
    """Print which plug-ins are left out, without known ones; return their number."""
    for words in plugins.PROBLEMS[known:]:
        say(f"accept: {words}")
    return len(plugins.PROBLEMS)


def _too_large() -> str:
    from accept.base.worker_process import too_large  # loads multiprocessing

    return f"{too_large()} or than this machine has"


def _words(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror and not isinstance(error, AcceptError):
        return without_secrets(f"{error.filename or 'a file'}: {_PLAIN.get(type(error), error.strerror)}")
    return without_secrets(str(error))


_PLAIN: dict[type[BaseException], str] = {  # errors of the system, in our words
    FileExistsError: "is a file, expected a folder",
    NotADirectoryError: "is a file, expected a folder",
    IsADirectoryError: "is a folder, expected a file",
    FileNotFoundError: "no such file or folder",
    PermissionError: "no permission to read or write it",
}
