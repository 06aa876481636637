"""The units of this bench: renders its dialogue, passes on keys and executes effects; what they mean is decided
there."""

from collections.abc import Sequence
from datetime import datetime
from functools import partial
from typing import Any, ClassVar

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
from accept.workflow.dialogue import units as dialogue
from accept.workflow.dialogue.begin import Begun, LookForPassphrase, LookUp
from accept.workflow.dialogue.units import Do, Turn
from accept.workflow.effects.serve_begin import BeginService
from accept.workflow.steps.unit_list import KnownUnit, Queue

_COLUMNS = (("serial", 13), ("kind", 6), ("state", 23), ("who", 6), ("when", 9))  # 57: beside the queues at 80 columns
_GROWS, _GROWS_BY = "who", 12  # columns more, as far as the terminal has them


class Units(Working[tuple[KnownUnit, Queue | None] | None]):
    """Dismisses with the unit to open and the queue that it was chosen from, None for neither."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *MOVES,
        Binding("enter", "press('enter')", "Open", priority=True),
        Binding("tab", "press('tab')", "Next list", priority=True),
        Binding("shift+tab", "press('shift+tab')", show=False, priority=True),
        Binding("f6", "press('f6')", "Add a tray", priority=True),
        Binding("ctrl+z", "press('ctrl+z')", "Take off", priority=True),
        Binding("escape", "press('escape')", "Back", priority=True),
    ]

    press = staticmethod(dialogue.press)

    def __init__(self, service: BeginService, operator: str, kind: str) -> None:
        """Make the list. operator, kind: of units that are added."""
        super().__init__()
        self.service = service
        self._opening = dialogue.opening(service.kinds, operator, kind)
        self.dialogue: dialogue.UnitsDialogue = self._opening.state
        self._drawn: tuple[Sequence[Queue], Sequence[KnownUnit]] = (), ()

    def compose(self) -> ComposeResult:
        yield Label("accept · units", classes="title")
        with Horizontal(id="main"):
            yield DataTable(id="queues", cursor_type="row", show_header=False, cell_padding=0)
            with Vertical(id="pane"):
                with Horizontal(classes="line", id="scan"):
                    yield Label("Serial (scan or type)", classes="label")
                    yield TextEntry(id="serial")
                yield DataTable(id="known", cursor_type="row", cell_padding=0)
        yield Label(dialogue.SCAN, id="status")
        yield KeyRow()

    async def on_mount(self) -> None:
        if not self.alive:
            return
        self._rail.can_focus = self._table.can_focus = False
        self._rail.add_column("", key="queue", width=22)
        for title, width in self._widths.items():
            self._table.add_column(title, key=title, width=width)
        self.set_focus(self._entry)
        await self.follow(self._opening)

    @property
    def _rail(self) -> DataTable[Any]:
        return self.query_one("#queues", DataTable)

    @property
    def _table(self) -> DataTable[Any]:
        return self.query_one("#known", DataTable)

    @property
    def _entry(self) -> TextEntry:
        return self.query_one(TextEntry)

    @property
    def _widths(self) -> dict[str, int]:
        widths = dict(_COLUMNS)
        widths[_GROWS] += min(max(0, self.app.size.width - 80), _GROWS_BY)
        return widths

    def at_present(self) -> Turn:
        return dialogue.edited(self.dialogue, self._entry.value, self._table.cursor_row)

    async def draw(self) -> None:
        d = self.dialogue
        if self._entry.value != d.text:
            self._entry.value = d.text
        queues, units = self._drawn
        if d.queues != queues:
            self._rail.clear()
            for queue in d.queues:
                self._rail.add_row(Text(f"{queue.title:<19.19}{len(queue.units):>3}"))
        if d.queue is not None:
            self._rail.move_cursor(row=d.queues.index(d.queue))
        if d.shown != units:
            self._fill()
        self._table.move_cursor(row=d.row)
        self._drawn = d.queues, d.shown

    def _fill(self) -> None:
        self._table.clear()
        rooms = [width - 1 for width in self._widths.values()]  # a space between two
        rooms[-1] += 1
        for unit in self.dialogue.shown:
            style = HELD if unit.held and unit.signed <= 1 else ""
            cells = (unit.serial, unit.kind, unit.state, unit.last_by, when_words(unit.last_at))
            self._table.add_row(*(_cut(*each, style) for each in zip(cells, rooms, strict=True)), key=unit.serial)

    def on_resize(self) -> None:
        for column in self._table.ordered_columns:
            column.width = self._widths[str(column.key.value)]
        self._fill()
        self._table.move_cursor(row=self.dialogue.row)

    async def execute(self, effect: object) -> None:
        service = self.service
        match effect:
            case Do.LOOK:  # no clock: what was said stays at the foot
                self.hold(service.listed, lambda seen: self.answer(dialogue.listed, *seen), "")
            case LookForPassphrase(texts):
                await self.answer(dialogue.recognized, effect, await self.secret_among(texts))
            case LookUp(serial):
                look = partial(service.bench.known_one, serial)
                self.hold(look, partial(self.answer, dialogue.found, effect), f"looking for {serial}")
            case dialogue.Add(begun):
                self.hold(partial(service.add, begun), partial(self._is_added, begun), f"adding {begun.serial}")
            case dialogue.TakeOff(unit, operator):
                self.hold(
                    partial(service.bench.take_off, unit.serial, unit.kind, operator),
                    lambda _: self.answer(dialogue.taken_off, effect),
                    f"taking {unit.serial} off",
                )
            case dialogue.CloseList(unit, queue):
                self.leave(None if unit is None else (unit, queue))

    async def _is_added(self, begun: Begun, answer: bool | str) -> None:
        if isinstance(answer, str):
            confirmed = partial(self.answer, dialogue.confirmed, begun)
            self.app.push_screen(which_unit(answer), lambda given: confirmed(given and given[0]))
        else:
            await self.answer(dialogue.added, begun.serial, answer)

    async def on_input_changed(self) -> None:
        await self.answer(Turn)

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
