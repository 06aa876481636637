"""The row of keys at the foot of a screen."""

from typing import Any

from textual.screen import Screen
from textual.widgets import Footer


class KeyRow(Footer):
    """Composed anew only where its keys have changed. The library's footer does so whenever the focus moves or a screen
    asks for its keys, which styles and lays out the whole screen again: a quarter of the time from a key to its answer.
    """

    _keys: tuple[object, ...] | None = None

    def __init__(self) -> None:
        super().__init__(compact=True)

    def bindings_changed(self, screen: Screen[Any]) -> None:
        if not (self.is_attached and screen is self.screen and screen.app.app_focus):
            return super().bindings_changed(screen)
        active = screen.active_bindings.values()
        keys = tuple((each.binding, each.enabled, each.tooltip) for each in active if each.binding.show)
        if keys != self._keys:
            self._keys = keys
            super().bindings_changed(screen)
        return None
