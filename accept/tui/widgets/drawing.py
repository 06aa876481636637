"""The drawing of a step with its connections, and the state of each line below it."""

from rich.text import Text

from accept.tui.widgets.fields import SAVED
from accept.workflow.dialogue.step_state import StepDialogue

_NOW = "bold blue"
_MOST = 6  # lines that are listed; of more the present one


def drawing_text(d: StepDialogue) -> Text:
    """Return the drawing in which the part of the present line is lit, and the state of every line."""
    guide, here = d.step.guide, d.here
    text = Text(guide.picture)
    if here is not None:
        name, index = here.place.key
        for part in guide.lit.get(name, ()) if index is None else ():
            start = guide.picture.find(part)
            text.stylize(_NOW, start, start + len(part)) if start >= 0 else None
        if index is not None:
            text.highlight_regex(rf"(?<![\d.+-]){index + 1}(?![\d.])", _NOW)
    return text.append("\n\n").append_text(_states(d))


def _states(d: StepDialogue) -> Text:
    text = Text()
    for n, line in enumerate(d.lines):
        mark, style = ("▶", _NOW) if n == d.cursor else (SAVED, "green") if d.has(n) else ("·", "")
        if len(d.lines) <= _MOST or n == d.cursor:
            text.append(f"{mark} {line.place.name}\n", style)
    text.rstrip()
    return text
