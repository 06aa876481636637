"""The drawing of a step with its connections, and the state of each line below it."""

import re

from rich.text import Text
from textual.geometry import Size

from accept.tui.widgets.fields import SAVED
from accept.tui.widgets.plot import has_room
from accept.workflow.dialogue.step_state import StepDialogue

_NOW = "bold blue"
_MOST = 6  # lines that are listed; of more the present one
_LINES = "─│┌┐└┘├┤┬┴┼═╪╧╤"
_RIGHT, _DOWN = "─┌└├┬┴┼═╪╧╤", "│┌┐├┤┬┼╪╤"  # that go on to the right and downwards
_WORDS = re.compile(rf"[^\s{_LINES}╱╲]+(?: (?=[^\s{_LINES}╱╲])[^\s{_LINES}╱╲]+)*")
_NUMBERS = re.compile(r"[\d.+ -]+(?: mm)?$")


def fitted(picture: str, size: Size) -> str:
    """Return a drawing, of twice its size on a large screen."""
    return enlarged(picture) if has_room(size) else picture


def drawing_text(d: StepDialogue, size: Size) -> Text:
    """Return the drawing in which the part of the present line is lit, and the state of every line. size: of the
    screen."""
    guide, here = d.step.guide, d.here
    picture = fitted(guide.picture, size)
    text = Text(picture)
    if here is not None:
        name, index = here.place.key
        for part in guide.lit.get(name, ()) if index is None else ():
            text.highlight_regex(re.escape(part).replace(r"\ ", "[ ─]+"), _NOW)
        if index is not None:
            text.highlight_regex(rf"(?<![\d.+-]){index + 1}(?![\d.])", _NOW)
    return text.append("\n\n").append_text(_states(d))


def enlarged(picture: str) -> str:
    """Return a drawing in twice as many rows and columns: its lines go on, its words stay together where they were."""
    rows = []
    for line in picture.split("\n"):
        wide, below = [" "] * (2 * len(line) + 1), [" "] * (2 * len(line) + 1)
        for n, sign in enumerate(line):
            if sign in _LINES:
                wide[2 * n : 2 * n + 2] = sign, ("═" if sign in "═╪╧╤" else "─") if sign in _RIGHT else " "
                below[2 * n] = "│" if sign in _DOWN else " "
            elif sign in "╱╲":
                (below if sign == "╱" else wide)[2 * n] = sign
                (wide if sign == "╱" else below)[2 * n + 1] = sign
        for run in _WORDS.finditer(line):
            for word in re.finditer(r"\S+" if _NUMBERS.match(run[0]) else ".+", run[0]):
                start, end = run.start() + word.start(), run.start() + word.end()
                left, right = line[:start].rstrip()[-1:], line[end:].lstrip()[:1]
                behind = 0 if not (right and right in _LINES) else 1 if left and left in _LINES else 2
                behind = 1 if _NUMBERS.match(word[0]) and not behind else behind
                at = 2 * start + behind * (end - start) // 2
                wide[at : at + end - start] = word[0]
        rows += ["".join(wide).rstrip(), "".join(below).rstrip()]
    return "\n".join(rows[:-1])


def _states(d: StepDialogue) -> Text:
    text = Text()
    for n, line in enumerate(d.lines):
        mark, style = ("▶", _NOW) if n == d.cursor else (SAVED, "green") if d.has(n) else ("·", "")
        if len(d.lines) <= _MOST or n == d.cursor:
            text.append(f"{mark} {line.place.name}\n", style)
    text.rstrip()
    return text
