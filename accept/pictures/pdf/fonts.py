"""The typeface of a certificate: DejaVu, embedded: PDF's own fonts lack the ≤, the Ω and half of Europe."""

from functools import cache
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
        pdfmetrics.registerFont(TTFont(name, str(folder / file)))
    pdfmetrics.registerFontFamily(REGULAR, normal=REGULAR, bold=BOLD, italic=OBLIQUE, boldItalic=BOLD)


def fitting_size(text: str, font: str, largest: float, width: float, smallest: float = 4.0) -> float:
    """Return the largest size [pt] at which the text is not wider than `width` [pt]."""
    natural = pdfmetrics.stringWidth(text, font, largest)
    return largest if natural <= width else max(smallest, largest * width / natural)
