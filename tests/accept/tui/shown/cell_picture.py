"""Pictures of a screen, cell by cell as a terminal has it: frames, blocks and dots are drawn to the edges of their
cells, and letters stand in theirs. A browser that shows the library's own pictures leaves gaps between the rows."""

from functools import lru_cache
from pathlib import Path
from typing import Any

from matplotlib import get_data_path
from PIL import Image, ImageDraw, ImageFont
from rich.cells import cell_len
from rich.segment import Segment
from textual.app import App

WIDE, HIGH = 10, 20  # pixels of a cell
_MIDDLE = WIDE // 2, HIGH // 2
_FONT = 16
Colour = tuple[int, int, int]
# Arms to the left, to the right, up and down: none, light, heavy.
_ARMS = {
    "─": "1100", "│": "0011", "┌": "0101", "┐": "1001", "└": "0110", "┘": "1010", "├": "0111", "┤": "1011", "┬": "1101",
    "┴": "1110", "┼": "1111", "╭": "0101", "╮": "1001", "╰": "0110", "╯": "1010", "━": "2200", "┃": "0022",
    "┏": "0202", "┓": "2002", "┗": "0220", "┛": "2020", "╸": "2000", "╺": "0200", "╹": "0020", "╻": "0002", "═": "2200",
    "╧": "2210", "╴": "1000", "╶": "0100", "╵": "0010", "╷": "0001", "┣": "0222", "┫": "2022",
}  # fmt: skip
_DOTS = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3))  # column and row of the bits of braille


def save(app: App[Any], path: Path) -> None:
    """Write the present screen as a PNG."""
    width, height = app.size
    picture = Image.new("RGB", (width * WIDE, height * HIGH))
    pen = ImageDraw.Draw(picture)
    ink, ground = (_rgb(app.theme_variables[name]) for name in ("foreground", "background"))
    for row, strip in enumerate(app.screen._compositor.render_strips()):
        column = 0
        for part in strip:
            for letter in part.text:
                if cells := cell_len(letter):
                    _cell(pen, column * WIDE, row * HIGH, letter, part, ink, ground)
                    column += cells
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)


def _cell(pen: ImageDraw.ImageDraw, x: int, y: int, letter: str, part: Segment, ink: Colour, ground: Colour) -> None:
    style = part.style
    ink = tuple(style.color.get_truecolor()) if style and style.color and not style.color.is_default else ink
    ground = tuple(style.bgcolor.get_truecolor()) if style and style.bgcolor else ground
    if style and style.reverse:
        ink, ground = ground, ink
    pen.rectangle((x, y, x + WIDE * cell_len(letter) - 1, y + HIGH - 1), fill=ground)
    if style and style.underline:
        pen.line((x, y + HIGH - 3, x + WIDE - 1, y + HIGH - 3), fill=ink)
    for left, top, right, foot in _parts(letter):
        pen.rectangle((x + left, y + top, x + right, y + foot), fill=ink)
    if not (letter.isspace() or _parts(letter)):
        pen.text((x, y), letter, ink, _font(bool(style and style.bold), bool(style and style.italic)))


@lru_cache
def _parts(letter: str) -> tuple[tuple[int, int, int, int], ...]:
    """Return the rectangles of a letter that is drawn, none for one of the typeface."""
    (across, down), code = _MIDDLE, ord(letter)
    if 0x2800 <= code <= 0x28FF:
        at = ((2 + 5 * c, 2 + 5 * r) for n, (c, r) in enumerate(_DOTS) if code >> n & 1)
        return tuple((a - 1, b - 1, a + 1, b + 1) for a, b in at)
    if 0x2581 <= code <= 0x2588:
        return ((0, HIGH - round(HIGH * (code - 0x2580) / 8), WIDE - 1, HIGH - 1),)
    if letter in "▀▬┄┈╌┊┆╎":
        dots = [(n, down, n + 1, down) for n in (1, 4, 7)]
        dashes = [(across, n, across, n + 1 + 2 * (letter == "╎")) for n in range(2, HIGH, 5)]
        whole = {"▀": [(0, 0, WIDE - 1, down - 1)], "▬": [(0, down - 2, WIDE - 1, down + 2)]}
        return tuple(whole.get(letter, dots if letter in "┄┈╌" else dashes))
    arms = [int(weight) for weight in _ARMS.get(letter, "0000")]
    ends = (
        (0, down, across, down),
        (across, down, WIDE - 1, down),
        (across, 0, across, down),
        (across, down, across, HIGH - 1),
    )
    return tuple(
        (a - (n > 1) * heavy, b - (n < 2) * heavy, c + (n > 1) * heavy, d + (n < 2) * heavy)
        for n, ((a, b, c, d), weight) in enumerate(zip(ends, arms, strict=True))
        if weight
        for heavy in (weight - 1,)
    )


@lru_cache
def _font(bold: bool, italic: bool) -> ImageFont.FreeTypeFont:
    name = "-".join(filter(None, ("DejaVuSansMono", "Bold" * bold + "Oblique" * italic)))
    return ImageFont.truetype(str(Path(get_data_path()) / "fonts" / "ttf" / f"{name}.ttf"), _FONT)


def _rgb(colour: str) -> Colour:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
