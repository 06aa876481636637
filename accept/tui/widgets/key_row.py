"""The row of keys at the foot of a screen: the main action as a chip, the others, and what every screen has. Keys for
which it has no room are in the palette, and it says how many."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rich.style import Style
from rich.text import Text
from textual.binding import ActiveBinding
from textual.events import Click
from textual.screen import Screen
from textual.widgets import Static


@dataclass(frozen=True)
class ShownKey:
    """One key as it is printed, with its effect. is_main: it is the next step; column: its first one."""

    key: str
    cap: str
    label: str
    enabled: bool = True
    is_main: bool = False
    column: int = 0

    @property
    def words(self) -> str:
        chip = " " if self.is_main else ""
        return f"{chip}{self.cap} {self.label}{chip}"

    @property
    def end(self) -> int:
        return self.column + len(self.words)


PALETTE = ShownKey("ctrl+p", "^P", "Commands")
AT_THE_RIGHT = ("f1", PALETTE.key, "ctrl+z")  # on every screen in the same place
_BACK = "escape"  # the way back always has room
_APART = 2  # columns between two keys


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
        self.placed: Sequence[ShownKey] = ()

    def on_mount(self) -> None:
        self.screen.bindings_updated_signal.subscribe(self, self.show)
        self.app.theme_changed_signal.subscribe(self, lambda _: self._draw())
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
        keys += (PALETTE,)
        if keys != self.keys:
            self.keys = keys
            self._draw()

    def _shown(self, each: ActiveBinding, main: str) -> ShownKey:
        own = each.binding
        return ShownKey(own.key, self.app.get_key_display(own), own.description, each.enabled, own.key == main)

    def _draw(self) -> None:
        self.placed = placed(self.keys, self.size.width or self.app.size.width - self.gutter.width)
        key, chip = self._role("footer-key-foreground"), self._role("block-cursor-background")
        of_chip = Style(color=self._role("block-cursor-foreground"), bgcolor=chip, bold=True)
        if self.app.has_class("-few-colours"):
            of_chip = Style(reverse=True, bold=True)
        text = Text(no_wrap=True)
        for shown in self.placed:
            text.append(" " * (shown.column - text.cell_len))
            if shown.is_main:
                text.append(shown.words, of_chip)
            else:
                text.append(shown.cap, Style(color=key, bold=True, dim=not shown.enabled))
                text.append(f" {shown.label}", Style(dim=not shown.enabled))
        self.update(text, layout=False)

    def _role(self, name: str) -> str:
        return self.app.theme_variables[name]

    def on_click(self, event: Click) -> None:
        for each in self.placed:
            if each.column <= event.x < each.end:
                self.app.simulate_key(each.key)


def placed(keys: Sequence[ShownKey], width: int) -> Sequence[ShownKey]:
    """Return where keys stand in so many columns: the main action first, those of every screen at the right. The last
    ones that have no room are left to the palette."""
    right = [each for each in keys if each.key in AT_THE_RIGHT and not each.is_main]
    right.sort(key=lambda each: AT_THE_RIGHT.index(each.key))
    left, count = [each for each in keys if each not in right], 0
    while _columns(left) + _APART + _columns(right) > width:
        leaves = next((each for each in reversed(left) if not each.is_main and each.key != _BACK), None)
        if leaves is None:
            break
        left.remove(leaves)
        count += 1
        right = [replace(each, label=f"{count} more") if each.key == PALETTE.key else each for each in right]
    return [*_beside(left, 0), *_beside(right, width - _columns(right))]


def _columns(keys: Sequence[ShownKey]) -> int:
    return sum(len(each.words) + _APART for each in keys) - _APART


def _beside(keys: Sequence[ShownKey], column: int) -> Iterator[ShownKey]:
    for each in keys:
        yield replace(each, column=column)
        column += len(each.words) + _APART
