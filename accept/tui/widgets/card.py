"""A region with a title in its border; how it stands is said behind the title."""

from collections.abc import Callable, Sequence

from rich.style import Style
from rich.text import Text
from textual.containers import Vertical
from textual.content import Content
from textual.geometry import Region
from textual.widget import Widget
from textual.widgets import Static

# Styles of text that is drawn, as those of the theme: a title is styled by the library, and quiet by itself.
_OF_THEME = {"green": "$success", "red": "$error", "yellow": "$warning", "cyan": "$primary", "magenta": "$secondary"}


def entitle(card: Widget, title: str, state: Sequence[tuple[str, str]] | str = "") -> None:
    """Set title and state of a card; the state as words or styled pieces. Nothing in them is a style."""
    pieces = [(state, "not bold")] if isinstance(state, str) else state
    styled = (
        (words, " ".join(_OF_THEME.get(part, part) for part in style.split() if part != "dim"))
        for words, style in pieces
    )
    content = Content.assemble(title, "  ", *styled) if state else Content(title)
    if card.border_title != content.markup:
        setattr(card, "_border_title", content)  # noqa: B010 - the library's own setter draws the whole card anew
        left, top = card.content_offset
        card.refresh(Region(-left, -top, card.outer_size.width, 1))


def chip(cap: str, key: str, style: str = "reverse bold") -> Text:
    """Return a key as it stands in a card, which a click presses."""
    pressed = Style.parse(style) + Style.from_meta({"@click": f"app.simulate_key('{key}')"})
    return Text.assemble((f" {cap} ", pressed))


class Card(Vertical):
    """Such a region around other parts. fit: what is done when it has another size, behind a question too."""

    def __init__(self, *parts: Widget, title: str, id: str, fit: Callable[[], None] | None = None) -> None:
        super().__init__(*parts, id=id, classes="card")
        self.border_title, self._fit = title, fit

    def on_resize(self) -> None:
        self.refresh()  # the library keeps rows that were drawn for another height, and with them no lower border
        if self._fit is not None:
            self._fit()


def put(shown: Static, content: Text | str) -> None:
    """Show a text, if it is another: what is updated is laid out and sent anew."""
    if shown.content != content:
        shown.update(content)
