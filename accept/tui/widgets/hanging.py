"""Text whose long lines go on below their own first letter, not at the left edge."""

from rich.console import Console, ConsoleOptions, RenderResult
from rich.padding import Padding
from rich.text import Text
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
    """Shows such a text."""

    def __init__(self, words: str | Text = "", *, id: str | None = None) -> None:
        super().__init__(id=id, markup=False)
        self._hung = Hung(Text(words) if isinstance(words, str) else words)

    def hang(self, text: Text) -> None:
        self._hung = Hung(text)
        self.refresh(layout=True)

    def render(self) -> Hung:
        return self._hung
