"""The units of this bench: who has which in hand, what they wait for, and a tray of new ones by their serials."""

from datetime import datetime
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import DataTable, Label

from accept.tui.background.busy_screen import MOVES, Working
from accept.tui.screens.ask import which_unit
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.step_list import HELD
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.bench import Begun, Workbench
from accept.workflow.entry.shift import NOT_TAKEN
from accept.workflow.steps.unit_list import ALL, KnownUnit, Queue, queues

_COLUMNS = (("serial", 13), ("kind", 6), ("state", 23), ("who", 6), ("when", 9))  # 57: beside the queues at 80 columns
_GROWS, _GROWS_BY = "who", 12  # columns more, as far as the terminal has them
_SCAN = "Scan a unit: Enter opens it"


class Units(Working[tuple[KnownUnit, Queue | None] | None]):
    """Dismisses with the unit to open and the queue that it was chosen from, None for neither."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *MOVES,
        Binding("enter", "open", "Open", priority=True),
        Binding("tab", "turn(1)", "Next list", priority=True),
        Binding("shift+tab", "turn(-1)", show=False, priority=True),
        Binding("f6", "add", "Add a tray", priority=True),
        Binding("ctrl+z", "take_off", "Take off", priority=True),
        Binding("escape", "leave", "Back", priority=True),
    ]

    def __init__(self, bench: Workbench, operator: str, kind: str) -> None:
        """Make the list. operator, kind: of units that are added."""
        super().__init__()
        self._bench, self._operator, self._kind = bench, operator, kind
        self._units: list[KnownUnit] = []
        self._queues: list[Queue] = []
        self._at = ALL, ""  # name and kind of the queue that is shown
        self._adding = False
        self._added: set[str] = set()  # serials of the tray
        self._doubted = ""  # serial that Ctrl+Z was pressed at once

    def compose(self) -> ComposeResult:
        yield Label("accept · units", classes="title")
        with Horizontal(id="main"):
            yield DataTable(id="queues", cursor_type="row", show_header=False, cell_padding=0)
            with Vertical(id="pane"):
                with Horizontal(classes="line", id="scan"):
                    yield Label("Serial (scan or type)", classes="label")
                    yield TextEntry(id="serial")
                yield DataTable(id="known", cursor_type="row", cell_padding=0)
        yield Label(_SCAN, id="status")
        yield KeyRow()

    def on_mount(self) -> None:
        if not self.alive:
            return
        rail, known = self.query_one("#queues", DataTable), self.query_one("#known", DataTable)
        rail.can_focus = known.can_focus = False
        rail.add_column("", key="queue", width=22)
        for title, width in self._widths.items():
            known.add_column(title, key=title, width=width)
        self.set_focus(self.query_one(TextEntry))
        self._look()

    @property
    def _widths(self) -> dict[str, int]:
        widths = dict(_COLUMNS)
        widths[_GROWS] += min(max(0, self.app.size.width - 80), _GROWS_BY)
        return widths

    def on_resize(self) -> None:
        for column in self.query_one("#known", DataTable).ordered_columns:
            column.width = self._widths[str(column.key.value)]
        self._fill()

    def _look(self) -> None:
        self.hold(self._bench.known, self._show, "")  # no clock: what was said stays at the foot

    def _show(self, units: list[KnownUnit]) -> None:
        self._units, self._queues = units, queues(units, self._bench.specs)
        if self._queue is None:
            self._at = ALL, ""
        rail = self.query_one("#queues", DataTable)
        rail.clear()
        for queue in self._queues:
            rail.add_row(Text(f"{queue.title:<19.19}{len(queue.units):>3}"))
        self._fill()
        if not units and not self._adding:
            self.say("No units yet. F6: add the units of a tray")

    @property
    def _tray(self) -> str:
        other = ". Tab: other kind" if len(self._bench.specs) > 1 else ""
        return f"Adding units of kind {self._kind}{other}. Scan every unit of the tray. F6: that was all"

    @property
    def _queue(self) -> Queue | None:
        return next((queue for queue in self._queues if (queue.name, queue.kind) == self._at), None)

    def _fill(self) -> None:
        """Show the units of the queue whose serial holds what is typed."""
        table, part = self.query_one("#known", DataTable), self.query_one(TextEntry).value.strip().lower()
        queue = self._queue
        if queue is None:
            return
        self.query_one("#queues", DataTable).move_cursor(row=self._queues.index(queue))
        table.clear()
        rooms = [width - 1 for width in self._widths.values()]  # a space between two
        rooms[-1] += 1
        for unit in queue.units:
            if part in unit.serial.lower():
                style = HELD if unit.held and unit.signed <= 1 else ""
                cells = (unit.serial, unit.kind, unit.state, unit.last_by, when_words(unit.last_at))
                table.add_row(*(_cut(*each, style) for each in zip(cells, rooms, strict=True)), key=unit.serial)

    def on_input_changed(self) -> None:
        self._fill()

    def action_turn(self, way: int) -> None:
        """Show another queue; while a tray is added, take another kind."""
        queue, kinds = self._queue, list(self._bench.specs)
        if self._adding:
            self._kind = kinds[(kinds.index(self._kind) + way) % len(kinds)] if self._kind in kinds else kinds[0]
            self.say(self._tray)
        elif queue is not None:
            shown = self._queues[(self._queues.index(queue) + way) % len(self._queues)]
            self._at = shown.name, shown.kind
            self._fill()
            one_by_one = f"{shown.title}: Enter opens the marked one, then one unit after the other"
            self.say(_SCAN if shown.name == ALL else one_by_one)

    @property
    def _here(self) -> KnownUnit | None:
        """Return the unit under the cursor, None in an empty list."""
        table = self.query_one("#known", DataTable)
        if not table.row_count:
            return None
        serial = str(table.coordinate_to_cell_key(table.cursor_coordinate).row_key.value)
        return next((unit for unit in self._units if unit.serial == serial), None)

    def action_take_off(self) -> None:
        """Take the unit under the cursor off the list, when asked twice; the last one that was added stands on top."""
        unit = self._here
        if unit is None:
            self.say("No unit to take off the list", "bad")
        elif not self._operator:
            self.say("Enter your name on the first screen, then take units off", "bad")
        elif unit.last or unit.notes or unit.attempt > 1:
            self.say(f"{unit.serial} stays: something was done at it", "bad")
        elif self._doubted != unit.serial:
            self._doubted = unit.serial
            self.say(f"Ctrl+Z again: take {unit.serial} off the list, as if it had not been scanned", "doubt")
        else:
            self._doubted = ""
            bench, who = self._bench, self._operator
            self.hold(
                lambda: bench.take_off(unit.serial, unit.kind, who),
                lambda _: self._is_off(unit.serial),
                f"taking {unit.serial} off",
            )

    def _is_off(self, serial: str) -> None:
        self._added.discard(serial)
        self.say(f"{serial} is off the list. {self._tray if self._adding else _SCAN}", "saved")
        self._look()

    async def action_open(self) -> None:
        """Open the unit that was scanned, else the one under the cursor; while a tray is added, add it."""
        text = self.query_one(TextEntry).value.strip()
        exact = next((unit for unit in self._units if unit.serial == text), None)
        if exact is None and await self._is_refused(text):
            return
        if self._adding and text:
            self._add(text)
        elif self._adding:
            await self.action_add()
        elif exact is not None:
            self._choose(exact)
        elif text:
            self.hold(lambda: (text, self._bench.known_one(text)), self._found, f"looking for {text}")
        elif (here := self._here) is not None:
            self._choose(here)

    def _found(self, seen: tuple[str, KnownUnit | None]) -> None:
        serial, known = seen
        if known is not None:
            self._choose(known)
        else:
            self.say(f"{serial} is new here. F6: add it, and the others of its tray", "doubt")

    def _choose(self, unit: KnownUnit) -> None:
        if unit.kind not in self._bench.specs:
            self.say(f"{unit.serial} is of kind {unit.kind}, for which this bench has no spec", "bad")
            return
        queue = self._queue
        waits = queue is not None and queue.name != ALL and unit in queue.units
        self.leave((unit, queue if waits else None))

    async def _is_refused(self, text: str) -> bool:
        """Take a passphrase away that was typed for a serial. Returns whether it was one."""
        if refused := await self.is_secret(text):
            self.query_one(TextEntry).value = ""
            self.app.bell()
            self.say(NOT_TAKEN, "bad")
        return refused

    async def action_add(self) -> None:
        """Begin to add the units of a tray, or end it."""
        text = self.query_one(TextEntry).value.strip()
        if await self._is_refused(text):
            return
        if not self._operator:
            self.say("Enter your name on the first screen, then add units", "bad")
        elif text:
            self._begin_tray()
            self._add(text)
        elif not self._adding:
            self._begin_tray()
            self.say(self._tray)
        else:
            self._adding = False
            self.say(f"{len(self._added)} added. Tab: choose what to measure at one after the other", "good")

    def _begin_tray(self) -> None:
        """Take every scan as a unit of the tray, and show all units: the one that was added last stands on top."""
        self._adding, self._at = True, (ALL, "")
        self._fill()

    def _add(self, serial: str, confirmed: bool = False) -> None:
        """Begin a unit, unless it is known; scanned twice it is one unit. A serial that looks like a known one is asked
        about first."""
        line = self.query_one(TextEntry)
        line.value = ""
        if problem := self._bench.problem(serial, self._kind):
            line.value = serial
            line.select_all()
            self.app.bell()
            self.say(f"'{serial}': {problem}", "bad")
            return

        def add() -> tuple[str, str | None]:
            if self._bench.known_one(serial) is not None:
                return f"{serial} is here already", None
            doubt = None if confirmed else self._bench.doubt(serial)
            if doubt is None:
                self._bench.add(Begun(serial, self._kind, self._operator, confirmed=confirmed))
            return "", doubt

        def done(told: tuple[str, str | None]) -> None:
            why, doubt = told
            if doubt is None:
                self._is_added(serial, why)
            else:
                self.app.push_screen(which_unit(doubt), lambda answer: self._confirm(serial, answer))

        self.hold(add, done, f"adding {serial}")

    def _confirm(self, serial: str, answer: list[str] | None) -> None:
        """Add a unit whose serial was asked about if it was typed once more."""
        if answer is not None and answer[0].strip() == serial:
            self._add(serial, confirmed=True)
        else:
            self._is_added(serial, f"{serial} was not confirmed, and not added")

    def _is_added(self, serial: str, why: str) -> None:
        if not why:
            self._added.add(serial)
        self.say(f"{why or f'{serial} added ({len(self._added)})'}. {self._tray}", "doubt" if why else "saved")
        self._look()

    def action_leave(self) -> None:
        if self._adding:
            self._adding = False
            self.say(_SCAN)
        else:
            self.leave(None)

    def help_text(self) -> str:
        return (
            "On the left what the units wait for, on the right the units. Tab changes the list; Enter opens a unit. "
            "From the list of a step, of the rig or of signatures, Enter at the end goes on to the next unit. F6: scan "
            "the units of a tray, then choose the step to measure at all of them. Ctrl+Z twice takes a unit off the "
            "list at which nothing was done. Red: a nonconformance, quality assurance decides."
        )


def when_words(time: str) -> str:
    """Return a time of the store as the bench's clock showed it: the hour, with the day unless it is today."""
    then = datetime.fromisoformat(time).astimezone()
    days = (datetime.now().astimezone().date() - then.date()).days
    return f"{then:%H:%M}" if days == 0 else f"{then:%a %H:%M}" if days < 7 else f"{then:%d %b %y}"


def _cut(words: str, room: int, style: str) -> Text:
    text = Text(words, style)
    text.truncate(room, overflow="ellipsis")
    return text
