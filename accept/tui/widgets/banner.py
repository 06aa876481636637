"""The result in letters that are seen from three metres, on a band of its colour."""

from rich.text import Text
from textual.widgets import Static

_LETTERS = {
    "A": ("01110", "10001", "11111", "10001", "10001"),
    "C": ("01111", "10000", "10000", "10000", "01111"),
    "D": ("11110", "10001", "10001", "10001", "11110"),
    "E": ("11111", "10000", "11110", "10000", "11111"),
    "H": ("10001", "10001", "11111", "10001", "10001"),
    "I": ("111", "010", "010", "010", "111"),
    "J": ("00111", "00010", "00010", "10010", "01100"),
    "L": ("10000", "10000", "10000", "10000", "11111"),
    "M": ("10001", "11011", "10101", "10001", "10001"),
    "N": ("10001", "11001", "10101", "10011", "10001"),
    "O": ("01110", "10001", "10001", "10001", "01110"),
    "P": ("11110", "10001", "11110", "10000", "10000"),
    "R": ("11110", "10001", "11110", "10010", "10001"),
    "T": ("11111", "00100", "00100", "00100", "00100"),
}
_ROWS = 5
_HALVES = {"00": " ", "10": "▀", "01": "▄", "11": "█"}
_LARGE = (110, 30)  # columns and rows of a terminal on which a letter is five rows high


class Banner(Static):
    """Shows one word; nothing before there is one."""

    def __init__(self) -> None:
        super().__init__("", id="banner", markup=False)
        self._word, self._style = "", ""

    def show(self, word: str, style: str) -> None:
        self._word, self._style = word, style
        self.display = bool(word)
        self._draw()

    def on_mount(self) -> None:
        self.display = bool(self._word)

    def on_resize(self) -> None:
        self._draw()

    def _draw(self) -> None:
        size = self.app.size
        large = size.width >= _LARGE[0] and size.height >= _LARGE[1]
        self.update(band(self._word, self._style, size.width, large))


def band(word: str, style: str, width: int, large: bool) -> Text:
    """Return a word in the middle of a band of `width` columns: five rows with letters ten columns wide if large, else
    three rows of half blocks. A letter that has no drawing is left out."""
    dots = [_dots(word, row) for row in range(_ROWS)]
    if large:
        lines = ["".join("██" if dot == "1" else "  " for dot in row) for row in dots]
    else:
        pairs = zip([*dots[0::2]], [*dots[1::2], "0" * len(dots[0])], strict=True)
        lines = ["".join(_HALVES[upper + lower] for upper, lower in zip(*pair, strict=True)) for pair in pairs]
    text = Text(no_wrap=True)  # a style of the whole would not take the colours of the theme
    return text.append("\n".join(f"{line:^{width}}" for line in lines), f"reverse {style}")


def _dots(word: str, row: int) -> str:
    return "0".join(_LETTERS[letter][row] for letter in word.upper() if letter in _LETTERS)
