"""The content of a report as blocks of plain data: no medium (terminal, PDF, web page, screen) adds words."""

from dataclasses import dataclass
from enum import Enum, auto


class Role(Enum):
    """The role of a sentence; each medium has its own look for each."""

    FOUND = auto()  # what the report is about
    RIVAL = auto()  # what cannot be distinguished
    UNNAMED = auto()
    REMARK = auto()
    DETAIL = auto()  # for those who have room
    LEGEND = auto()  # how to read what stands beside it


@dataclass(frozen=True)
class Heading:
    """Words above other blocks. new_page: where a medium has pages, it begins one."""

    words: str
    new_page: bool = False


@dataclass(frozen=True)
class Sentence:
    """A sentence of a report. details: numbers and advice that belong to it; evidence: how sure it is."""

    words: str
    role: Role = Role.REMARK
    details: tuple[str, ...] = ()
    evidence: tuple[str, ...] = ()

    @property
    def more(self) -> str:
        return "; ".join([*self.details, *self.evidence])


@dataclass(frozen=True)
class Table:
    """A table. note: a line above it."""

    title: str
    note: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Picture:
    """Panels that stand below each other, by their names."""

    panels: tuple[str, ...]


Block = Heading | Sentence | Table | Picture
