"""The look of a verdict, once for every medium: distinguished by word, mark and colour."""

from dataclasses import dataclass
from enum import Enum

from accept.pictures.colours import GREEN, GREY, INK, ORANGE, VERMILION


class Tone(Enum):
    """(style of a terminal, colour on paper, the same for text on white)."""

    GOOD = "green", GREEN, "#00694c"
    DOUBT = "yellow", ORANGE, "#8a5f00"
    BAD = "bold red", VERMILION, "#b04a00"
    OPEN = "magenta", GREY, INK

    def __init__(self, style: str, fill: str, ink: str) -> None:
        self.style, self.fill, self.ink = style, fill, ink


@dataclass(frozen=True)
class Sign:
    """The look of a verdict. word: as it is read; mark: a terminal's character; print_mark: the certificate's."""

    word: str
    mark: str
    print_mark: str
    tone: Tone

    @property
    def bold(self) -> str:
        """Return style of a heading in a terminal."""
        return self.tone.style if self.tone.style.startswith("bold") else f"bold {self.tone.style}"


_GOOD, _DOUBT, _BAD, _OPEN = ("✓", "✔", Tone.GOOD), ("~", "!", Tone.DOUBT), ("✗", "✘", Tone.BAD), ("?", "?", Tone.OPEN)
FINDINGS = {
    "pass": Sign("pass", *_GOOD),
    "conditional": Sign("conditional", *_DOUBT),
    "fail": Sign("fail", *_BAD),
    "no_result": Sign("no result", *_OPEN),
}
UNITS = {
    "accepted": Sign("accepted", *_GOOD),
    "conditional": Sign("conditional", *_DOUBT),
    "rejected": Sign("rejected", *_BAD),
    "incomplete": Sign("incomplete", *_OPEN),
    "held": Sign("held", "!", "!", Tone.BAD),  # conditional, as quality assurance must decide about a nonconformance
    "held, incomplete": Sign("held, incomplete", "!", "!", Tone.BAD),
    "accepted by concession": Sign("accepted by concession", *_GOOD),  # quality assurance uses it as it is
}
GAP = {
    "no_missing_effect": Sign("no missing effect", *_GOOD),
    "explained": Sign("cause found", *_GOOD),
    "ambiguous": Sign("several possible causes", *_DOUBT),
    "partly_explained": Sign("partly explained", *_DOUBT),
    "unexplained": Sign("cause not found", *_OPEN),
    "refused": Sign("not analysed", *_OPEN),
}
