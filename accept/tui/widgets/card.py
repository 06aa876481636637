"""A region with a title in its border; how it stands is said behind the title."""

from rich.text import Text
from textual.containers import Vertical
from textual.content import Content
from textual.geometry import Region
from textual.widget import Widget


def entitle(card: Widget, title: str, state: Text | str = "") -> None:
    """Set title and state of a card. Nothing in them is a style."""
    shown = Content.from_rich_text(state) if isinstance(state, Text) else Content.styled(state, "not bold")
    content = Content.assemble(title, "  ", shown) if state else Content(title)
    if card.border_title != content.markup:
        setattr(card, "_border_title", content)  # noqa: B010 - the library's own setter draws the whole card anew
        left, top = card.content_offset
        card.refresh(Region(-left, -top, card.outer_size.width, 1))


class Card(Vertical):
    """Such a region around other parts."""

    def __init__(self, *parts: Widget, title: str, id: str) -> None:
        super().__init__(*parts, id=id, classes="card")
        self.border_title = title
