"""The declarations of a file, before its data are read: names, shapes and kinds."""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from checks.arrays import Array
from checks.errors import RecordError


@dataclass(frozen=True, eq=False)
class Clock:
    """The times of a channel as stated: sample k was taken at start + k step, or at axis[k], in s.

    source : name of the statement; step : NaN if it is not stated; origin : of the times, as written; shown : the start
    as written, if it is a date; in_seconds : False if no unit is stated."""

    source: str
    step: float = math.nan
    start: float = 0.0
    axis: Array | None = None
    origin: str = ""
    shown: str = ""
    in_seconds: bool = True


@dataclass(frozen=True, eq=False)
class Variable:
    """One named array of a file.

    shape : as declared; kind : "double", "int16", "char", "struct" and the like; unit : "" if the file states none.
    load : its data as (size,) float64; None unless real numbers. text : of words. inner : content of a structure, a
    matrix in its shape. clock : its own times, if they are part of it. home : name of its structure. unpacked : bytes
    that it unpacks to, if the file states them."""

    name: str
    shape: tuple[int, ...]
    kind: str
    load: Callable[[], Array] | None = None
    unit: str = ""
    text: Callable[[], str] | None = None
    inner: Callable[[], Any] | None = None
    clock: Callable[[], Clock] | None = None
    home: str = ""
    unpacked: int = 0

    @property
    def values(self) -> Array:
        """Return (size,) float64. Raises RecordError if the variable is not real numbers."""
        if self.load is None:
            raise RecordError(f"'{self.name}' is of kind {self.kind}, expected real numbers")
        return self.load()

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    @property
    def is_vector(self) -> bool:
        """Return whether at most one dimension is longer than 1: (N,), (N, 1), (1, N), (1, 1)."""
        return sum(n != 1 for n in self.shape) <= 1

    def __str__(self) -> str:
        return f"{self.name} ({' x '.join(map(str, self.shape)) or 'scalar'} {self.kind})"


Variables = Mapping[str, Variable]
NESTED = ("struct", "cell")  # kinds of variables that may hold channels
CLOCK = "clock"  # kind of the time in a list of channels, if the file states start and step instead of a vector
T = TypeVar("T")


class Remarked(dict[str, T]):
    """Content of a file by name. remarks: in words, on every value that was not taken as written."""

    def __init__(self, items: Mapping[str, T], remarks: tuple[str, ...] = ()) -> None:
        super().__init__(items)
        self.remarks = remarks


def remarks_of(found: Mapping[str, object]) -> tuple[str, ...]:
    """Return the reader's remarks on a content, if it makes any."""
    return found.remarks if isinstance(found, Remarked) else ()


OWN_RECORD = "accept_record"  # a variable of records that this program wrote: their channels have our names, in SI


def unique(file: str, variables: list[Variable]) -> dict[str, Variable]:
    """Return the variables by name. Raises RecordError if a name occurs twice, because it is then ambiguous."""
    named = {v.name: v for v in variables}
    if len(named) < len(variables):
        twice = sorted(name for name, count in Counter(v.name for v in variables).items() if count > 1)
        raise RecordError(f"{file}: holds {', '.join(map(repr, twice[:5]))} more than once; names must be unique")
    return named


def listing(variables: Variables, most: int = 12) -> str:
    """Return names and shapes in words, for messages."""
    shown = [str(v) for v in variables.values()]
    more = f" and {len(shown) - most} more" if len(shown) > most else ""
    return (", ".join(shown[:most]) or "nothing") + more
