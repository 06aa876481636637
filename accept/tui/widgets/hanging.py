"""Text whose long lines go on below their own first letter, not at the left edge."""

from itertools import zip_longest

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.padding import Padding
from rich.segment import Segment
from rich.text import Text
from textual.geometry import Region
from textual.widgets import Static


class Hung:
    """A text, each line of which is folded under its indent."""

    def __init__(self, text: Text) -> None:
        self.text = text

    @property
    def plain(self) -> str:
        return self.text.plain

    def __str__(self) -> str:
        return self.plain

    def __rich_console__(self, _: Console, __: ConsoleOptions) -> RenderResult:
        for line in self.text.split("\n", allow_blank=True):
            indent = len(line.plain) - len(line.plain.lstrip())
            yield Padding(line[indent:], (0, 0, 0, indent))


class Hanging(Static):
    """Shows such a text. Of another text as long as the one before, the lines that differ are sent to the terminal."""

    def __init__(self, words: str | Text = "", *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(id=id, classes=classes, markup=False)
        self._hung = Hung(Text(words) if isinstance(words, str) else words)
        self._drawn: tuple[int, list[list[Segment]]] | None = None  # its width and lines

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
