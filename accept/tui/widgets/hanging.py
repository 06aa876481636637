"""Text whose long lines go on below their own first letter, not at the left edge."""

import re
from collections.abc import Callable, Iterator
from itertools import zip_longest

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.segment import Segment
from rich.text import Text
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Static

ROOM = 59  # columns beside the steps at 80, before the first layout
_INDENT = re.compile(r"^ *(?:(?:\d|[·▪▶✓✗○→]) +)?")


class Hung:
    """A text, each line of which is folded under its first word, behind indent, number and mark."""

    def __init__(self, text: Text) -> None:
        self.text = text

    @property
    def plain(self) -> str:
        return self.text.plain

    def __str__(self) -> str:
        return self.plain

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for line in self.text.split("\n", allow_blank=True):
            yield from _folded(line, console, options.max_width)


def _folded(line: Text, console: Console, width: int) -> Iterator[Text]:
    indent = len(line.plain) - len(_INDENT.sub("", line.plain))
    for n, part in enumerate(line[indent:].wrap(console, max(1, width - indent)) or [Text()]):
        yield (Text(" " * indent) if n else line[:indent]).append_text(part)


class Hanging(Static):
    """Shows such a text. Of another as long as the one before, only lines that differ are drawn and sent."""

    def __init__(self, words: str | Text = "", *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(id=id, classes=classes, markup=False)
        self._hung = Hung(Text(words) if isinstance(words, str) else words)
        self._text_of: Callable[[int], Text] | None = None
        self._drawn_for: tuple[object, ...] = ()  # width, style and text
        self._rows_of: dict[object, list[Strip]] = {}  # of each line of the text
        self._drawn: list[Strip] = []

    def fit(self, text_of: Callable[[int], Text]) -> None:
        """Show a text that is made for so many columns, and made anew when there are others."""
        self._text_of = text_of
        self.on_resize()

    def on_resize(self) -> None:
        if self._text_of is not None:
            self.hang(self._text_of(self.size.width or ROOM))
        least = self.styles.min_height  # a card may be higher than its text, to fill the room
        room = self.parent.size if isinstance(self.parent, Widget) else self.app.size
        floor = 0 if least is None else int(least.resolve(room, self.app.size))
        if self.styles.auto_dimensions and max(len(self._rows()), floor) != self.size.height:
            self.call_after_refresh(self.refresh, layout=True)  # it was laid out with the text before

    def hang(self, text: Text) -> None:
        if text == self._hung.text and text.spans == self._hung.text.spans:
            return
        before = self._rows()
        self._hung = Hung(text)
        after = self._rows()
        if not before:
            self.refresh(layout=True)
            return
        rows = enumerate(zip_longest(before, after, fillvalue=Strip.blank(0)))
        regions = [_whole(y, old, new) for y, (old, new) in rows if old is not new and old != new]
        if regions:
            self.refresh(*regions, layout=len(before) != len(after) and self.styles.auto_dimensions)

    def _rows(self) -> list[Strip]:
        """Return the rows as they are drawn, none before the first layout. Lines as before are not drawn anew."""
        width, style, console = self.size.width, self.visual_style, self.app.console
        if self._drawn_for != (width, style, self._hung):
            before = self._rows_of if self._drawn_for[:2] == (width, style) else {}
            self._drawn_for, self._rows_of, self._drawn = (width, style, self._hung), {}, []
            for line in self._hung.text.split("\n", allow_blank=True) if width else ():
                name = line.plain, tuple(line.spans)
                self._rows_of[name] = before.get(name) or [
                    Strip(Segment.apply_style(part.render(console), style.rich_style))
                    for part in _folded(line, console, width)
                ]
                self._drawn += self._rows_of[name]
        return self._drawn

    def render(self) -> Hung:
        return self._hung

    def render_line(self, y: int) -> Strip:
        self._dirty_regions.clear()
        rows = self._rows()
        return rows[y] if y < len(rows) else Strip.blank(self.size.width, self.visual_style.rich_style)


def _whole(y: int, *rows: Strip) -> Region:
    """Return the place of a row of which something is to be seen."""
    return Region(0, y, max(1, *(cell_len(row.text.rstrip()) for row in rows)), 1)
