"""The report of a gap on a terminal: at most 24 lines of 80 columns, the gap itself never cut."""

import textwrap
from collections.abc import Iterator, Sequence

from accept.gap.improved_model import AddedElement
from accept.gap.report import elements, short_report, title
from accept.pictures.blocks import Block, Heading, Role, Sentence, Table
from checks.gap import Result

LINES, COLUMNS = 24, 80  # of a terminal


def summary(serial: str, r: Result, added: Sequence[AddedElement] = ()) -> list[str]:
    """Return at most 24 lines of 80 columns for a terminal; the gap itself is never cut. added: elements that were
    added to the improved model, in lines of their own."""
    lines = _wrap(f"{title(serial, r)} (model {r.model}, damping {r.damping})", "")
    more, kept = (list(_lines(blocks)) for blocks in short_report(r))
    room = LINES - len(lines) - len(kept)
    cut = [] if len(more) <= room else ["  ... for the rest see gap.json and gap.pdf"]
    return [*lines, *more[: room - len(cut)], *cut, *kept, *(_lines([elements(added)]) if added else ())]


def _lines(blocks: Sequence[Block]) -> Iterator[str]:
    for block in blocks:
        match block:
            case Heading():
                yield from _wrap(f"{block.words}:", "  ")
            case Sentence():
                yield from _wrap(block.words, "  ", most=2 if block.role is Role.UNNAMED else None)
                yield from _wrap(block.more, "    ")
            case Table():
                yield from _wrap(block.note, "  ")
                for first, *rest in block.rows:
                    cells = ", ".join(f"{head} {cell}" for head, cell in zip(block.head[1:], rest, strict=True))
                    yield from _wrap(f"{first}: {cells}", "    ", most=2)


def _wrap(words: str, indent: str, most: int | None = None) -> list[str]:
    return textwrap.wrap(
        words,
        COLUMNS,
        initial_indent=indent,
        subsequent_indent=indent + "  ",
        break_on_hyphens=False,
        max_lines=most,
        placeholder=" ...",
    )
