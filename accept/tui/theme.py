"""The design of the screens: one palette, light and dark, for Textual's parts and for what is drawn as text.

Colours are those of the certificate (Okabe and Ito), lightened on dark and darkened on light until text of that colour
has a contrast of 4.5 to its background or more.
"""

import os
from dataclasses import replace
from typing import Any

from rich.segment import Segment
from rich.style import Style
from rich.terminal_theme import TerminalTheme
from textual.color import Color
from textual.filter import Monochrome
from textual.theme import Theme

DARK, LIGHT = "accept-dark", "accept-light"

_COLOURS = {  # on dark, on light
    "primary": ("#6cb6ff", "#0060a8"),
    "secondary": ("#8fa3bf", "#4a5a70"),
    "accent": ("#f0b450", "#8a5300"),
    "success": ("#4cc38a", "#00694c"),
    "warning": ("#f0b450", "#8a5300"),
    "error": ("#ff8a6b", "#a83a00"),
    "foreground": ("#dfe6ef", "#1c2430"),
    "background": ("#10151d", "#fbfcfd"),
    "surface": ("#171e29", "#f0f3f6"),
    "panel": ("#1f2937", "#e2e8ee"),
}
_VARIABLES = {
    "frame": ("#3a4a61", "#aab7c4"),  # of a card that is not in use
    "footer-background": ("#171e29", "#e2e8ee"),
    "footer-key-foreground": ("#f0b450", "#8a5300"),
    "footer-description-foreground": ("#a9b6c8", "#3c4a5c"),
    "input-selection-background": ("#6cb6ff 35%", "#0060a8 25%"),
    "block-cursor-background": ("#2b4a6f", "#c4dcf2"),
    "block-cursor-foreground": ("#ffffff", "#0b1a2b"),
    "block-cursor-blurred-background": ("#26344a", "#d8e4ef"),
}


def _theme(name: str, at: int) -> Theme:
    colours: dict[str, Any] = {part: both[at] for part, both in _COLOURS.items()}
    return Theme(name, dark=name == DARK, variables={part: both[at] for part, both in _VARIABLES.items()}, **colours)


THEMES = (_theme(DARK, 0), _theme(LIGHT, 1))


def _rgb(*colours: str) -> list[tuple[int, int, int]]:
    return [(int(c[1:3], 16), int(c[3:5], 16), int(c[5:7], 16)) for c in colours]


# black, red, green, yellow, blue, magenta, cyan, white: what "green" and its like are in text that is drawn
ANSI_DARK = TerminalTheme(
    (16, 21, 29),
    (223, 230, 239),
    _rgb("#10151d", "#ff8a6b", "#4cc38a", "#f0b450", "#6cb6ff", "#d6a2e8", "#58c4dd", "#dfe6ef"),
    _rgb("#7d8ba0", "#ff8a6b", "#4cc38a", "#f0b450", "#6cb6ff", "#d6a2e8", "#7ad7f0", "#ffffff"),
)
ANSI_LIGHT = TerminalTheme(
    (251, 252, 253),
    (28, 36, 48),
    _rgb("#1c2430", "#a83a00", "#00694c", "#8a5300", "#0060a8", "#7a3e92", "#00657f", "#1c2430"),
    _rgb("#6a7788", "#a83a00", "#00694c", "#8a5300", "#0060a8", "#7a3e92", "#00657f", "#1c2430"),
)


# A terminal of 16 colours takes the nearest of them, which for ours are greys: there these stand for them, themselves
# among the 16 (bright on dark, full on light).
_16_ON_DARK = "#000000", "#ff5555", "#55ff55", "#ffff55", "#5555ff", "#ff55ff", "#55ffff", "#ffffff"
_16_GREY = "#aaaaaa"
_16_ON_LIGHT = "#000000", "#aa0000", "#00aa00", "#aa5500", "#0000aa", "#aa00aa", "#00aaaa", "#000000"
# Bright black, in which axes are drawn, is a grey that is seen on the ground.
ANSI_DARK_16 = TerminalTheme((0, 0, 0), (255, 255, 255), _rgb(*_16_ON_DARK), _rgb(_16_GREY, *_16_ON_DARK[1:]))
ANSI_LIGHT_16 = TerminalTheme((255, 255, 255), (0, 0, 0), _rgb(*_16_ON_LIGHT), _rgb("#555555", *_16_ON_LIGHT[1:]))


def of_16(one: Theme) -> Theme:
    """Return a theme with good, bad and doubtful in colours that a terminal of 16 colours has. On light, frames and
    chips take a grey of these: their own is the white of the ground. The cursor turns ink and ground round: on dark
    its own ground, which becomes the ink, is black and not grey."""
    _, red, green, yellow, *_ = _16_ON_DARK if one.dark else _16_ON_LIGHT
    turned = dict.fromkeys(("block-cursor-background", "block-cursor-blurred-background"), "#000000")
    chip = turned if one.dark else {"block-cursor-background": _16_GREY, "frame": _16_GREY}
    panel = one.panel if one.dark else _16_GREY
    return replace(one, success=green, error=red, warning=yellow, panel=panel, variables=one.variables | chip)


def asked_for() -> str:
    """Return the theme of `ACCEPT_THEME` (dark or light), dark without it."""
    return LIGHT if os.environ.get("ACCEPT_THEME", "").strip().lower() == "light" else DARK


class WithoutColour(Monochrome):
    """A filter that takes the colour off a line, for `NO_COLOR`. Cells without any style, which a table has beside its
    columns, stay as they are: the base class fails on them."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        return super().apply([Segment(s.text, s.style or Style.null(), s.control) for s in segments], background)


WITHOUT_COLOUR = WithoutColour()
