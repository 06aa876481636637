"""The line that is typed into."""

from collections.abc import Callable, Sequence

from textual.widgets import Input


class Entry(Input):
    """An input of one row whose cursor stands still: a blinking one is traffic on a slow line."""

    def __init__(self, value: str = "", *, placeholder: str = "", secret: bool = False, id: str | None = None) -> None:
        super().__init__(
            value, placeholder=placeholder, password=secret, compact=True, max_length=1000, select_on_focus=True, id=id
        )
        self.cursor_blink = False


def when_typed(fields: Sequence[Input], then: Callable[[], None]) -> None:
    """Call `then` when every key that was typed into these fields stands in them: each takes its keys in its own
    time."""
    if fields:
        fields[0].call_later(when_typed, fields[1:], then)
    else:
        then()
