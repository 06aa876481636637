"""The answer of a command, and the one printer of all answers.

A command reads its options, calls its use case and returns an `Answer`: lines and tables for stdout, remarks for stderr
and files, in the order in which they are printed and written, with an exit code.
"""

import json as jsonlib
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec

from rich import box
from rich.table import Column, Table
from rich.text import Text

from accept.base.atomic_files import check_place, check_table, write_atomic
from accept.base.console import clear_errors, say, stdout, tell
from accept.base.documents.document import Document
from accept.base.exit_codes import Exit
from accept.pictures.formats import format_of
from specs.errors import AcceptError

if TYPE_CHECKING:
    import pandas as pd

    from checks.picture import Panel

P = ParamSpec("P")
Content = bytes | Document | Mapping[str, Any] | Sequence[Any]
STDOUT = Path("-")
PLAIN: Mapping[str, Any] = {"box": box.SIMPLE_HEAD, "padding": 0, "pad_edge": False}  # a table without lines
SPACED: Mapping[str, Any] = {**PLAIN, "padding": (0, 1, 0, 0)}  # with a space behind each column
DANGEROUS = ("=", "+", "-", "@", "\t", "\r")  # a spreadsheet takes a cell that begins so for a formula
ENDINGS = {"json": ".json", "csv": ".csv", "mat": ".mat", "uff": ".uff", "html": ".html", "plot": ""}  # of outputs


class Remark(str):
    """A message about the answer, for stderr; an empty one is not printed."""


@dataclass(frozen=True)
class File:
    """A file of an answer. place: None if it was not asked for; "-" for stdout, in place of lines and tables. content:
    bytes, a JSON document, or a function that makes them. announced: a remark names the file once it is written."""

    place: Path | None
    content: Content | Callable[[], Content]
    announced: bool = False


class Answer:
    """The parts of an answer in their order, without those that are None. error: raised after they are printed."""

    def __init__(
        self, *parts: str | Table | File | None, exit: Exit = Exit.ACCEPTED, error: AcceptError | None = None
    ) -> None:
        self.parts, self.exit, self.error = parts, exit, error


def refusal(words: object, exit: Exit = Exit.BAD_INPUT) -> Answer:
    """Return the answer to an order that cannot be carried out."""
    return Answer(Remark(f"accept: {words}"), exit=exit)


def table(titles: Iterable[str | Column], rows: Iterable[Iterable[str | Text]], **style: Any) -> Table:
    """Return a table. style: options of a rich table."""
    made = Table(*titles, title_justify="left", **style)
    for row in rows:
        made.add_row(*row)
    return made


def csv_of(rows: "pd.DataFrame | Sequence[Any]", columns: list[str] | None = None) -> bytes:
    """Return rows as CSV; a text that a spreadsheet would take for a formula is quoted. columns: all, if there may be
    no row."""
    import pandas as pd  # loaded where a table is written

    frame = pd.DataFrame(rows, columns=columns)
    texts = frame.select_dtypes(include=["object", "string", "category"]).columns
    quoted = {
        name: [f"'{v}" if isinstance(v, str) and v.startswith(DANGEROUS) else v for v in frame[name]] for name in texts
    }
    harmless = frame.assign(**{name: pd.Series(values, frame.index, object) for name, values in quoted.items()})
    return harmless.to_csv(index=False).encode()


def picture(
    place: Path | None, panels: "Callable[[], Sequence[Panel]]", columns: int | None = None, announced: bool = False
) -> File:
    """Return a picture of panels, which are only made if it is asked for."""

    def drawn() -> bytes:
        from accept.pictures.draw import picture as draw  # loads matplotlib

        found = panels()
        return draw(found, format_of(place or STDOUT), columns=columns and min(columns, len(found)))

    return File(place, drawn, announced)


def command(function: Callable[P, Answer]) -> Callable[P, Exit]:
    """Return a command that checks the places of its files before the work, prints its answer and returns the exit
    code. An error that a person can mend is one line."""

    @wraps(function)
    @clear_errors
    def run(*args: P.args, **kwargs: P.kwargs) -> Exit:
        _check_places(signature(function).bind(*args, **kwargs).arguments)
        return print_answer(function(*args, **kwargs))

    return run


def _check_places(options: Mapping[str, Any]) -> None:
    for name, value in options.items():
        if is_dataclass(value):
            _check_places(vars(value))
        elif name in ENDINGS and isinstance(value, Path) and value != STDOUT:
            check_place(value, ENDINGS[name])
            if name == "plot":
                format_of(value)


def print_answer(answer: Answer) -> Exit:
    """Print lines and tables, unless a file goes to stdout, and remarks; write the files; return the exit code."""
    for_people = not any(isinstance(part, File) and part.place == STDOUT for part in answer.parts)
    for part in answer.parts:
        match part:
            case File():
                _write(part)
            case Remark() if part:
                say(part)
            case Remark():
                pass
            case str() if for_people:
                tell(part)
            case Table() if for_people:
                stdout.print(part)
    if answer.error is not None:
        raise answer.error
    return answer.exit


def _write(file: File) -> None:
    if file.place is None:
        return
    content = file.content() if callable(file.content) else file.content
    if not isinstance(content, bytes):
        document = content.to_json() if isinstance(content, Document) else content
        content = (jsonlib.dumps(document, indent=1, allow_nan=False) + "\n").encode()
    if file.place == STDOUT:
        sys.stdout.buffer.write(content)
        sys.stdout.flush()
        return
    check_place(file.place)
    if file.place.suffix.lower() == ".csv":
        check_table(file.place, content)
    write_atomic(file.place, content)
    if file.announced:
        say(f"{file.place}: written")
