"""The result in letters of three rows, which are seen from across the room."""

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


class Banner(Static):
    """Shows one word; nothing before there is one."""

    def __init__(self) -> None:
        super().__init__("", id="banner", markup=False)
        self.word = ""

    def show(self, word: str, style: str) -> None:
        self.word = word
        self.display = bool(word)
        self.update(Text(no_wrap=True).append("\n".join(drawn(word)), style))  # a part: colours of the theme

    def on_mount(self) -> None:
        self.display = bool(self.word)


def drawn(word: str) -> list[str]:
    """Return the three rows of a word, two dots in a cell. A letter that has no drawing is left out."""
    dots = ["0".join(_LETTERS[letter][row] for letter in word.upper() if letter in _LETTERS) for row in range(_ROWS)]
    pairs = zip([*dots[0::2]], [*dots[1::2], "0" * len(dots[0])], strict=True)
    return ["".join(_HALVES[upper + lower] for upper, lower in zip(*pair, strict=True)) for pair in pairs]
