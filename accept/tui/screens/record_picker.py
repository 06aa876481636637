"""Choosing a record file: the folder's newest first, looked at again every second, so that a record that has just been
written appears by itself."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.widgets import Label, OptionList
from textual.widgets.option_list import Option

from accept.tui.background.busy_screen import Working

SUFFIXES = {".mat", ".csv", ".uff", ".unv", ".tdms", ".txt"}
_MOST = 500  # of one folder


@dataclass(frozen=True)
class Listing:
    """One look at a folder: folders by name, files newest first."""

    folders: tuple[str, ...]
    files: tuple[str, ...]


def look(folder: Path) -> Listing:
    """Raises OSError."""
    with os.scandir(folder) as found:
        seen = [entry for entry in found if not entry.name.startswith(".")]
    folders = sorted(entry.name for entry in seen if entry.is_dir())
    files = [entry for entry in seen if entry.is_file() and Path(entry.name).suffix.lower() in SUFFIXES]
    files.sort(key=lambda entry: (-entry.stat().st_mtime_ns, entry.name))
    return Listing(tuple(folders[:_MOST]), tuple(entry.name for entry in files[:_MOST]))


class Pick(Working[Path | None]):
    """Dismisses with the file, None after Escape."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Back"),
        Binding("backspace", "up", "Folder above"),
    ]

    def __init__(self, what: str, folder: Path) -> None:
        super().__init__()
        self._what, self._folder = what, folder
        self._listing: Listing | None = None
        self._first: frozenset[str] = frozenset()

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog tall"):
            yield Label(f"File for: {self._what}", classes="title", markup=False)
            yield Label("", id="folder", markup=False)
            yield OptionList(id="files", markup=False)
            yield Label("New files appear here. Enter: choose, Esc: cancel", id="status")

    def on_mount(self) -> None:
        if not self.alive:
            return
        self._open(self._folder)
        self.set_interval(1.0, self._again)

    def _open(self, folder: Path) -> None:
        self._folder, self._listing = folder, None
        self.query_one("#folder", Label).update(str(folder))
        self._again()

    def _again(self) -> None:
        folder = self._folder
        self.aside(lambda: (folder, look(folder)), self._looked, "look")

    def _looked(self, seen: tuple[Path, Listing]) -> None:
        folder, listing = seen
        if folder != self._folder or listing == self._listing:
            return
        if self._listing is None:
            self._first = frozenset(listing.files)
        self._listing = listing
        self._fill(listing)

    def _fill(self, listing: Listing) -> None:
        shown = self.query_one(OptionList)
        before = shown.highlighted_option.id if shown.highlighted_option else None
        shown.clear_options()
        for name in listing.files:
            new = "  ← new" if name not in self._first else ""
            shown.add_option(Option(f"{name}{new}", id=f"f:{name}"))
        shown.add_options(Option(f"{name}/", id=f"d:{name}") for name in ("..", *listing.folders))
        ids = [f"f:{name}" for name in listing.files] + [f"d:{name}" for name in ("..", *listing.folders)]
        shown.highlighted = ids.index(before) if before in ids else 0

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        kind, _, name = str(event.option.id).partition(":")
        if kind == "f":
            self.leave(self._folder / name)
        elif name == "..":
            self.action_up()
        else:
            self._open(self._folder / name)

    def action_up(self) -> None:
        self._open(self._folder.parent)

    def action_leave(self) -> None:
        self.leave(None)
