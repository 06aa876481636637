"""Text whose long lines go on below their own first letter, not at the left edge."""

import re
from collections.abc import Callable, Iterator
from itertools import zip_longest

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.segment import Segment
from rich.text import Text
from textual.geometry import Region
from textual.widgets import Static

ROOM = 59  # columns beside the steps at 80, before the first layout
_INDENT = re.compile(r"^ *(?:(?:\d|[·▪▶✓✗○→]) )?")


class Hung:
    """A text, each line of which is folded under its first word, behind indent, number and mark."""

    def __init__(self, text: Text) -> None:
        self.text = text
        self._folded: dict[int, list[Text]] = {}  # by columns: it is drawn to be compared, then to be shown

    @property
    def plain(self) -> str:
        return self.text.plain

    def __str__(self) -> str:
        return self.plain

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if options.max_width not in self._folded:
            self._folded[options.max_width] = list(self._fold(console, options.max_width))
        yield from self._folded[options.max_width]

    def _fold(self, console: Console, width: int) -> Iterator[Text]:
        for line in self.text.split("\n", allow_blank=True):
            indent = len(line.plain) - len(_INDENT.sub("", line.plain))
            folded = line[indent:].wrap(console, max(1, width - indent)) or [Text()]
            for n, part in enumerate(folded):
                yield (Text(" " * indent) if n else line[:indent]).append_text(part)


class Hanging(Static):
    """Shows such a text. Of another text as long as the one before, the lines that differ are sent to the terminal."""

    def __init__(self, words: str | Text = "", *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(id=id, classes=classes, markup=False)
        self._hung = Hung(Text(words) if isinstance(words, str) else words)
        self._text_of: Callable[[int], Text] | None = None
        self._drawn: tuple[int, list[list[Segment]]] | None = None  # its width and lines

    def fit(self, text_of: Callable[[int], Text]) -> None:
        """Show a text that is made for so many columns, and made anew when there are others."""
        self._text_of = text_of
        self.on_resize()

    def on_resize(self) -> None:
        if self._text_of is not None:
            self.hang(self._text_of(self.size.width or ROOM))

    def hang(self, text: Text) -> None:
        if text == self._hung.text and text.spans == self._hung.text.spans:
            return
        before = self._rows()
        self._hung, self._drawn = Hung(text), None
        after = self._rows()
        if not before:
            self.refresh(layout=True)
            return
        none: list[Segment] = []
        rows = enumerate(zip_longest(before, after, fillvalue=none))
        regions = [Region(0, y, max(_length(old), _length(new)), 1) for y, (old, new) in rows if old != new]
        if regions:
            self.refresh(*regions, layout=len(before) != len(after) and self.styles.auto_dimensions)

    def _rows(self) -> list[list[Segment]]:
        """Return the lines as they are drawn, none before the first layout."""
        width, console = self.size.width, self.app.console
        if self._drawn is None or self._drawn[0] != width:
            rows = console.render_lines(self._hung, console.options.update(width=width)) if width else []
            self._drawn = width, rows
        return self._drawn[1]

    def render(self) -> Hung:
        return self._hung


def _length(row: list[Segment]) -> int:
    """Return how many columns of a row hold something; one at least."""
    return max(1, cell_len("".join(segment.text for segment in row).rstrip()))
