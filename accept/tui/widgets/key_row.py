"""The row of keys at the foot of a screen: the main action as a chip, the others, and what every screen has."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rich.style import Style
from rich.text import Text
from textual.binding import ActiveBinding
from textual.events import Click, Key
from textual.screen import Screen
from textual.widgets import Static

AT_THE_RIGHT = ("f1", "ctrl+p", "ctrl+z")  # on every screen in the same place
_APART = 2  # columns between two keys


@dataclass(frozen=True)
class ShownKey:
    """One key as it is printed, with what it does. is_main: it is what is done next here."""

    key: str
    cap: str
    label: str
    enabled: bool = True
    is_main: bool = False

    @property
    def words(self) -> str:
        chip = " " if self.is_main else ""
        return f"{chip}{self.cap} {self.label}{chip}"


@dataclass(frozen=True)
class PlacedKey:
    """Row and first column of a key."""

    shown: ShownKey
    row: int
    column: int

    @property
    def end(self) -> int:
        return self.column + len(self.shown.words)


def one_of_each(screen: Screen[Any]) -> list[ActiveBinding]:
    """Return the keys of a screen that have a description: of several keys for one action the first."""
    found = dict[tuple[str, str], ActiveBinding]()
    for each in screen.active_bindings.values():
        if each.binding.description:
            found.setdefault((each.binding.action, each.binding.description), each)
    return list(found.values())


class KeyRow(Static):
    """Drawn anew only where its keys have changed, as one text: a widget for each key would be styled and laid out
    again with every one. A screen names its main action in `main_key`."""

    def __init__(self) -> None:
        super().__init__("", markup=False)
        self.keys: tuple[ShownKey, ...] = ()
        self.placed: Sequence[PlacedKey] = ()

    def on_mount(self) -> None:
        self.screen.bindings_updated_signal.subscribe(self, self.show)
        self.call_after_refresh(self.show, self.screen)

    def on_resize(self) -> None:
        self._draw()

    def show(self, screen: Screen[Any]) -> None:
        """Show the keys that mean something on this screen now."""
        if not (self.is_attached and screen is self.screen):
            return
        main = getattr(screen, "main_key", "")
        active = (each for each in one_of_each(screen) if each.binding.show)
        keys = tuple(self._shown(each, main) for each in sorted(active, key=lambda each: each.binding.key != main))
        keys += (ShownKey("ctrl+p", "^P", "Commands"),)
        if keys != self.keys:
            self.keys = keys
            self._draw()

    def _shown(self, each: ActiveBinding, main: str) -> ShownKey:
        own = each.binding
        return ShownKey(own.key, self.app.get_key_display(own), own.description, each.enabled, own.key == main)

    def _draw(self) -> None:
        rows = self.placed[-1].row if self.placed else 0
        self.placed = placed(self.keys, self.size.width or self.app.size.width - self.gutter.width)
        more = self.placed[-1].row if self.placed else 0
        key, chip = self._role("footer-key-foreground"), self._role("block-cursor-background")
        on_chip = self._role("block-cursor-foreground")
        text, row, column = Text(no_wrap=True), 0, 0
        for each in self.placed:
            shown = each.shown
            text.append("\n" * (each.row - row))
            column = column if each.row == row else 0
            text.append(" " * (each.column - column))
            if shown.is_main:
                text.append(shown.words, Style(color=on_chip, bgcolor=chip, bold=True))
            else:
                text.append(shown.cap, Style(color=key, bold=True, dim=not shown.enabled))
                text.append(f" {shown.label}", Style(dim=not shown.enabled))
            row, column = each.row, each.end
        self.update(text, layout=rows != more)

    def _role(self, name: str) -> str:
        return self.app.theme_variables[name]

    def on_click(self, event: Click) -> None:
        """Press the key that was pointed at."""
        for each in self.placed:
            if each.row == event.y and each.column <= event.x < each.end:
                self.app.post_message(Key(each.shown.key, None))


def placed(keys: Sequence[ShownKey], width: int) -> Sequence[PlacedKey]:
    """Return where each key stands in so many columns: those of every screen at the right of the last row, unless that
    is full."""
    of_all = [each for each in keys if each.key in AT_THE_RIGHT and not each.is_main]
    of_all.sort(key=lambda each: AT_THE_RIGHT.index(each.key))
    found, row, column = list[PlacedKey](), 0, 0
    for each in (each for each in keys if each not in of_all):
        if column and column + len(each.words) > width:
            row, column = row + 1, 0
        found.append(PlacedKey(each, row, column))
        column = found[-1].end + _APART
    right = sum(len(each.words) + _APART for each in of_all) - _APART
    if column and column + right > width:
        row, column = row + 1, 0
    column = max(column, width - right)
    for each in of_all:
        if column + len(each.words) > width and column:
            row, column = row + 1, 0
        found.append(PlacedKey(each, row, column))
        column = found[-1].end + _APART
    return found
