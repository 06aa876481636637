"""Choosing a record file: those that fit first, the newest on top, with time, size and content.

The folder is looked at again every second, so that a record that has just been written appears by itself; letters that
are typed leave the files whose name holds them.
"""

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.content import Content
from textual.events import Key
from textual.widgets import DataTable, Label, Static

from accept.tui.background.busy_screen import ENDS, MOVES, Working
from accept.workflow.entry.record_folder import LOOKED_INTO_MOST, Listing, age_words, look

LOOKS_AT_MOST_S = 5.0  # keys wait for the list of a slow folder no longer
REFUSED = "✗ "
_NONE_SUCH = "No file has these letters in its name. Backspace: less"
_HINT = "New files appear here. Letters filter, Enter: choose, Esc: cancel"


def content_words(path: Path, size: int) -> str:
    """Return what a file holds: its channels with their lengths, or why it cannot be read."""
    from checks.errors import RecordError
    from hw.records import list_channels  # readers load slowly: only when a file is looked into

    if size > LOOKED_INTO_MOST:
        return f"{size_words(size)}: too large to look into here"
    try:
        found = list_channels(path)
    except (RecordError, OSError) as e:
        return f"{REFUSED}{e}"
    vectors = {name: max(shape) for name, shape in found.items() if shape and max(shape) > 1}
    single = [name for name, shape in found.items() if name not in vectors]
    lengths = set(vectors.values())
    words = f"Channels: {', '.join(vectors)}" if vectors else "No channels"
    words += f"\n{lengths.pop()} samples each" if len(lengths) == 1 else ""
    return words + (f"; single values: {', '.join(single[:8])}" if single else "")


def size_words(size: int) -> str:
    """Return bytes in the largest unit that leaves a number above one."""
    for unit in ("B", "kB", "MB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000  # type: ignore[assignment]
    return f"{size:.3g} GB"


class Pick(Working[Path | None]):
    """Dismisses with the file, None after Escape."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *MOVES,
        *ENDS,
        Binding("enter", "choose", show=False, priority=True),
        Binding("escape", "leave", "Back"),
        Binding("backspace", "shorten", "Folder above", priority=True),
    ]

    def __init__(
        self,
        what: str,
        folder: Path,
        lacks: Callable[[Path], Sequence[str]] = lambda _: (),
        named: Callable[[str], tuple[int, str]] = lambda _: (0, ""),
        first: str = "",
    ) -> None:
        """Make the list. lacks: what a file lacks of what is wanted; named: how far its name speaks for that, and for
        which step instead; both are asked in a thread. first: the file that is proposed."""
        super().__init__()
        self._what, self._folder = what, folder
        self._lacks, self._named, self._proposed = lacks, named, first
        self._placed = 0  # row on which the cursor was put
        self._typed = ""  # letters that the name must hold
        self._listing: Listing | None = None
        self._first: frozenset[str] = frozenset()

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog tall") as dialog:
            dialog.border_title = Content(f"File for: {self._what}")
            yield Label("", id="folder", markup=False)
            yield DataTable(id="files", cursor_type="row")
            yield Static("", id="preview", markup=False)
            yield Label(_HINT, id="status")

    def on_mount(self) -> None:
        if not self.alive:
            return
        table = self.query_one(DataTable)
        for title in ("file", "fits", "written", "size"):
            table.add_column(title, key=title, width=len(title))
        self.set_focus(table)
        self._open(self._folder)
        self.set_interval(1.0, lambda: self._again() if self.ready.is_set() else None)

    def _open(self, folder: Path) -> None:
        self._folder, self._listing = folder, None
        self.ready.clear()  # keys that follow wait for the list: they choose from it
        self.set_timer(LOOKS_AT_MOST_S, self.ready.set)
        self.query_one("#folder", Label).update(str(folder))
        self._again()

    def _again(self) -> None:
        folder = self._folder
        self.aside(
            lambda: (folder, look(folder, lambda path: not self._lacks(path), self._named, self._proposed)),
            self._looked,
            "look",
            lambda _: self.ready.set(),
        )

    def _looked(self, seen: tuple[Path, Listing]) -> None:
        folder, listing = seen
        self.ready.set()
        if folder != self._folder or listing == self._listing:
            return
        if self._listing is None:
            self._first = frozenset(entry.name for entry in listing.files)
        self._listing = listing
        self._fill(listing)

    def _fill(self, listing: Listing) -> None:
        table, now = self.query_one(DataTable), datetime.now().timestamp()
        before = self._here() if self._moved else ""
        table.clear()
        part = self._typed.lower()
        files = [entry for entry in listing.files if part in entry.name.lower()]
        names = [f"{entry.name}{'' if entry.name in self._first else '  ← new'}" for entry in files]
        folders = [f"{name}/" for name in ("..", *listing.folders) if part in name.lower()]
        rows = [
            (name, entry.other or "yes" if entry.fits else "no", age_words(entry.mtime, now), size_words(entry.size))
            for name, entry in zip(names, files, strict=True)
        ]
        rows += [(folder, "folder", "", "") for folder in folders]
        for n, column in enumerate(table.ordered_columns):  # left to itself it is cut until there is nothing to do
            column.width = max(len(str(column.label)), *(len(row[n]) for row in rows), 0)
        clear = [entry.fits and not entry.other for entry in files] + [True] * len(folders)
        keys = [*(f"f:{entry.name}" for entry in files), *(f"d:{folder[:-1]}" for folder in folders)]
        for row, is_clear, key in zip(rows, clear, keys, strict=True):
            table.add_row(Text(row[0], "" if is_clear else "dim"), *(Text(cell, "dim") for cell in row[1:]), key=key)
        table.move_cursor(row=keys.index(before) if before in keys else 0)
        self._placed = table.cursor_row

    @property
    def _moved(self) -> bool:
        """Return whether the cursor was moved by hand: else it stays on top, where a new record that fits appears."""
        return self.query_one(DataTable).cursor_row != self._placed

    def _here(self) -> str:
        """Return key of the row under the cursor, "" without any."""
        table = self.query_one(DataTable)
        if not table.row_count:
            return ""
        return str(table.coordinate_to_cell_key(table.cursor_coordinate).row_key.value)

    def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        kind, _, name = str(event.row_key.value).partition(":")
        self.query_one("#preview", Static).update("…" if kind == "f" else "")
        sizes = {entry.name: entry.size for entry in self._listing.files} if self._listing else {}
        if kind == "f" and name in sizes:
            path, size = self._folder / name, sizes[name]
            self.aside(lambda: (name, self._words_of(path, size)), self._previewed, "preview")

    def _words_of(self, path: Path, size: int) -> str:
        """Return what a file holds, and what it lacks; in a thread."""
        words = content_words(path, size)
        lacking = [] if words.startswith(REFUSED) or size > LOOKED_INTO_MOST else self._lacks(path)
        return f"{words}\nDoes not fit, lacks: {', '.join(lacking)}" if lacking else words

    def _previewed(self, seen: tuple[str, str]) -> None:
        name, words = seen
        if self._here() == f"f:{name}":
            self.query_one("#preview", Static).update(words)

    def action_choose(self) -> None:
        """Take what is under the cursor."""
        kind, _, name = self._here().partition(":")
        if not kind:
            self.say(_NONE_SUCH if self._typed else "No files", "bad")
        elif kind == "f":
            self.leave(self._folder / name)
        elif name == "..":
            self.action_up()
        elif kind == "d":
            self._open(self._folder / name)

    def on_key(self, event: Key) -> None:
        """Take a letter into the filter."""
        if event.character is not None and event.is_printable:
            event.stop()
            self._filter(self._typed + event.character)

    def _filter(self, text: str) -> None:
        """Show the files whose name holds a text. A text that no name holds is not shown: F2 signs elsewhere, and what
        follows it there is a passphrase."""
        self._typed = text
        if self._listing is not None:
            self._fill(self._listing)
        held = f"Files with '{text}' in the name. Backspace: less" if self._here() else _NONE_SUCH
        self.say(held if text else _HINT)

    def action_shorten(self) -> None:
        """Take back a letter of the filter; without one, go to the folder above."""
        if self._typed:
            self._filter(self._typed[:-1])
        else:
            self.action_up()

    def action_up(self) -> None:
        self._filter("")
        self._open(self._folder.parent)

    def action_leave(self) -> None:
        self.leave(None)
