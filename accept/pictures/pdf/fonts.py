"""The typeface of a certificate: DejaVu, embedded: PDF's own fonts lack the ≤, the Ω and half of Europe."""

from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path

from reportlab import rl_config
from reportlab.graphics import shapes
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.platypus.tables import CellStyle

REGULAR, BOLD, OBLIQUE, MONO = "Accept", "Accept-Bold", "Accept-Oblique", "Accept-Mono"
_FILES = {
    REGULAR: "DejaVuSans.ttf",
    BOLD: "DejaVuSans-Bold.ttf",
    OBLIQUE: "DejaVuSans-Oblique.ttf",
    MONO: "DejaVuSansMono.ttf",
}
_SHORT, _MANY = 64, 20_000  # letters of a word, and words of each typeface, whose widths are kept


class _Typeface(TTFont):  # type: ignore[misc]  # reportlab has no types
    """A typeface that keeps the widths of words: reportlab asks for each some six times, letter by letter, and one
    certificate has most words of another."""

    def __init__(self, name: str, file: str) -> None:
        super().__init__(name, file)
        widths, other = self.face.charWidths, self.face.defaultWidth
        self._width = lambda word: sum(widths.get(ord(letter), other) for letter in word)
        self._kept = lru_cache(_MANY)(self._width)

    def stringWidth(self, text: str | bytes, size: float, encoding: str = "utf8") -> float:
        """Return the width of a text [pt], as reportlab does."""
        word = text if isinstance(text, str) else text.decode(encoding)
        return 0.001 * size * float((self._kept if len(word) <= _SHORT else self._width)(word))


@cache
def register() -> None:
    """Register the typeface with reportlab, once, and let it write binary streams: as text they take most time."""
    rl_config.useA85 = 0
    # Pages, drawings and cells of tables begin with these: Helvetica would be there, not embedded.
    rl_config.canvas_basefontname = shapes.STATE_DEFAULTS["fontName"] = CellStyle.fontname = REGULAR
    matplotlib = find_spec("matplotlib")  # its files are wanted, not its half second of loading
    if matplotlib is None or matplotlib.origin is None:
        raise RuntimeError("matplotlib is not installed: the certificate's typeface comes with it")
    folder = Path(matplotlib.origin).parent / "mpl-data" / "fonts" / "ttf"
    for name, file in _FILES.items():
        pdfmetrics.registerFont(_Typeface(name, str(folder / file)))
    pdfmetrics.registerFontFamily(REGULAR, normal=REGULAR, bold=BOLD, italic=OBLIQUE, boldItalic=BOLD)


def fitting_size(text: str, font: str, largest: float, width: float, smallest: float = 4.0) -> float:
    """Return the largest size [pt] at which the text is not wider than `width` [pt]."""
    natural = pdfmetrics.stringWidth(text, font, largest)
    return largest if natural <= width else max(smallest, largest * width / natural)
