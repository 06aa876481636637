"""Measures, colours and paragraph styles of a certificate; every verdict has a colour, a word and a mark."""

from dataclasses import dataclass
from html import escape
from typing import Any

from reportlab.lib.colors import Color, HexColor
from reportlab.lib.enums import TA_RIGHT
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.platypus import Paragraph

from accept.pictures import signs
from accept.pictures.colours import GREY, INK, PALE
from accept.pictures.pdf.fonts import BOLD, REGULAR
from accept.pictures.words import pretty

WIDTH, HEIGHT = A4
MARGIN = 14 * mm
INNER = WIDTH - 2 * MARGIN
HEADER = 32 * mm  # height of the first page's head
BAND = 37 * mm  # height of the first page's signatures and code
FOOTER = 9 * mm
RUNNING_HEAD = 9 * mm

INK_COLOUR, GREY_COLOUR, PALE_COLOUR = HexColor(INK), HexColor(GREY), HexColor(PALE)
ACROSS = HexColor("#e3e5e8")  # of words across a page: text over them stays legible
ZEBRA = HexColor("#f5f6f7")
WHITE = HexColor("#ffffff")


@dataclass(frozen=True)
class PageSign:
    """The look of a verdict on a page: distinguished by colour, by word and by mark, so also in grey and from afar."""

    word: str
    mark: str
    fill: Color
    ink: Color


def _on_its_colour(sign: signs.Sign) -> PageSign:
    """Return the sign of a whole unit: in a box filled with its colour, of an open unit in an empty box."""
    fill = WHITE if sign.tone is signs.Tone.OPEN else HexColor(sign.tone.fill)
    ink = WHITE if sign.tone in (signs.Tone.GOOD, signs.Tone.BAD) else INK_COLOUR
    return PageSign(sign.word.upper(), sign.print_mark, fill, ink)


def _on_white(sign: signs.Sign) -> PageSign:
    word = sign.word.upper() if sign.tone is signs.Tone.BAD else sign.word
    return PageSign(word, sign.print_mark, HexColor(sign.tone.fill), HexColor(sign.tone.ink))


UNIT_SIGNS = {verdict: _on_its_colour(sign) for verdict, sign in signs.UNITS.items()}
FINDING_SIGNS = {verdict: _on_white(sign) for verdict, sign in signs.FINDINGS.items()}
GAP_SIGNS = {verdict: _on_its_colour(sign) for verdict, sign in signs.GAP.items()}


def _style(name: str, size: float, **more: object) -> ParagraphStyle:
    basic = {"fontName": REGULAR, "fontSize": size, "leading": size * 1.25, "textColor": INK_COLOUR}
    return ParagraphStyle(name, **(basic | more))


BODY = _style("body", 7.5)
NUMBER = _style("number", 7.5, alignment=TA_RIGHT)
STRONG = _style("strong", 7.5, fontName=BOLD)
SMALL = _style("small", 6.2)
SMALL_NUMBER = _style("small number", 6.2, alignment=TA_RIGHT)
QUIET = _style("quiet", 6.2, textColor=GREY_COLOUR)
HEADING = _style("heading", 8.5, fontName=BOLD, spaceBefore=6, spaceAfter=2.5, keepWithNext=1)
TABLE_HEAD = _style("table head", 6.2, fontName=BOLD, textColor=GREY_COLOUR)
TABLE_HEAD_NUMBER = _style("table head number", 6.2, fontName=BOLD, textColor=GREY_COLOUR, alignment=TA_RIGHT)


class _Words(Paragraph):  # type: ignore[misc]  # reportlab has no types
    """A paragraph that keeps its lines: a page asks three times or more for those of one width."""

    _lines_of: tuple[float, tuple[float, float]] | None = None

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Break it into lines of this width; return its width and height."""
        if self._lines_of is None or self._lines_of[0] != width or not hasattr(self, "blPara"):
            self._lines_of = width, super().wrap(width, height)
        return self._lines_of[1]


def words(text: object, style: Any = BODY) -> Paragraph:
    """Return a paragraph of any text: markup in it stays text, control characters become blanks.
    A no-break space holds a line together."""
    plain = "".join(c if c.isprintable() or c == "\u00a0" else " " for c in pretty(str(text)))
    return _Words(escape(plain, quote=False), style)
