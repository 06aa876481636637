"""The units of a bench: a table of them, and the findings at the one under its cursor."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import TYPE_CHECKING

from rich.text import Text
from textual.events import Click
from textual.message import Message
from textual.widgets import DataTable

from accept.pictures.labels import label_of
from accept.pictures.words import pretty
from accept.tui.widgets.card import entitle
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.limit_bar import LimitBar, numbers

if TYPE_CHECKING:
    from accept.pictures.signs import Sign
    from accept.workflow.steps.unit_list import KnownUnit
    from checks.verdict import Finding

_RED = "bold red"  # of what quality assurance must decide
_FROM_ROOMY = 100  # columns: between two marks is a blank
_SINCE, _KIND, _WHO, _STATE = 9, 6, 10, 23  # columns; name and state share the columns of a wider table
_ENTRY, _FROM_ENTRY = "Last entry", 66  # columns of the state that leave room for one more
_VALUE, _BAR = 20, 30


def since_words(time: str, now: datetime) -> str:
    """Return how long ago a time of the store was: minutes, hours, the day of the week, then the date."""
    then = datetime.fromisoformat(time).astimezone()
    minutes = int((now - then).total_seconds() // 60)
    if minutes < 1:
        return "now"
    if minutes < 60:
        return f"{minutes} min"
    days = (now.date() - then.date()).days
    return f"{minutes // 60} h" if days == 0 else f"{then:%a}" if days < 7 else f"{then:%d %b %y}"


def when_words(time: str) -> str:
    """Return a time of the store as the bench's clock showed it."""
    return f"{datetime.fromisoformat(time).astimezone():%a %d %b %H:%M}"


class PointedTable(DataTable[Text]):
    """A table whose rows are pointed at; keys belong to the line beside it."""

    class Pointed(Message):
        """A row was clicked. twice: by two clicks."""

        def __init__(self, table: "PointedTable", row: int, twice: bool) -> None:
            super().__init__()
            self.table, self.row, self.twice = table, row, twice

    def __init__(self, *, id: str, show_header: bool = True) -> None:
        super().__init__(id=id, show_header=show_header, cursor_type="row", cell_padding=0)
        self.can_focus = False

    def on_click(self, event: Click) -> None:
        if (row := event.style.meta.get("row", -1)) >= 0:
            self.post_message(self.Pointed(self, row, event.chain > 1))


class UnitsTable(PointedTable):
    """A row per unit: serial, kind, a mark per step, state, who acted last and when; on a wide terminal also the last
    entry. The serial is never cut."""

    def __init__(self, id: str) -> None:
        super().__init__(id=id)
        self._units: Sequence[KnownUnit] = ()
        self._now = datetime.min

    def on_mount(self) -> None:
        for title in ("Serial", "Kind", "Steps", "State", _ENTRY, "Who", "Since"):
            self.add_column(title if title != "Since" else f"{title:>{_SINCE - 1}}", key=title)

    def show(self, units: "Sequence[KnownUnit]", row: int, now: datetime, *, anew: bool = False) -> None:
        """Show units with the cursor on one of them. anew: the time has gone on."""
        if units != self._units or anew:
            self._units, self._now = units, now
            self._fill()
        self.move_cursor(row=row)

    def on_resize(self) -> None:
        row = self.cursor_row
        self._fill()
        self.move_cursor(row=row)

    def _fill(self) -> None:
        widths = self._widths(self._units)
        for column in self.ordered_columns:
            column.auto_width, column.width = False, widths[str(column.key.value)]
        self.clear()
        for unit in self._units:
            self.add_row(*(_cut(text, max(widths[name] - 1, 0)) for name, text in self._cells(unit, self._now)))

    def _widths(self, units: "Sequence[KnownUnit]") -> Mapping[str, int]:
        def longest(texts: Sequence[str], least: int) -> int:
            return max([least, *(len(text) + 1 for text in texts)])

        steps = max((len(unit.marks) for unit in units), default=0)
        widths = {"Kind": longest([unit.kind for unit in units], _KIND), "Since": _SINCE}
        widths["Steps"] = max(len("Steps "), steps * (2 if self.app.size.width >= _FROM_ROOMY else 1) + 1)
        room = self.scrollable_content_region.width or self.app.size.width // 2  # before it is laid out
        left = room - sum(widths.values())
        widths["Serial"] = min(longest([unit.serial for unit in units], len("Serial ")), max(left - _WHO, 8))
        left -= widths["Serial"]
        who = longest([unit.last_by for unit in units], len("Who "))
        widths["Who"] = max(min(who, max(_WHO, left - _STATE), left), 1)
        left -= widths["Who"]
        entry = left - _FROM_ENTRY // 2 if left >= _FROM_ENTRY else 0
        return {**widths, _ENTRY: entry, "State": max(left - entry, 1)}

    def _cells(self, unit: "KnownUnit", now: datetime) -> Sequence[tuple[str, Text]]:
        held = _RED if unit.waits_for_qa else ""
        between = Text(" " if self.app.size.width >= _FROM_ROOMY else "")
        since = since_words(unit.last_at, now)
        return (
            ("Serial", Text(unit.serial, held or "bold")),
            ("Kind", Text(unit.kind, held or "dim")),
            ("Steps", between.join(Text(mark, style) for mark, style, _ in unit.marks)),
            ("State", state_words(unit)),
            (_ENTRY, Text(pretty(unit.last), "dim")),
            ("Who", Text(unit.last_by, held)),
            ("Since", Text(f"{since:>{_SINCE - 1}}", held or "dim")),
        )


def state_words(unit: "KnownUnit") -> Text:
    """Return the state of a unit in its colour; of a held one also the reason."""
    if unit.waits_for_qa:
        return Text(f"HELD  {unit.held_by}" if not unit.verdict and unit.held_by else unit.state, _RED)
    if unit.verdict:
        return Text(unit.state, _sign(str(unit.verdict), of_unit=True).tone.style if unit.to_sign else "dim")
    return Text(unit.state, "cyan" if unit.is_begun else "dim")


class UnitCard(Hanging):
    """The unit under the cursor: what was found at it, as the store has it, and what was done last."""

    def __init__(self, id: str) -> None:
        super().__init__(id=id, classes="card")
        self._unit: KnownUnit | None = None
        self._words = ""

    def show(self, unit: "KnownUnit | None", words: str) -> None:
        """Show a unit, words in its place without one."""
        if (unit, words) != (self._unit, self._words):
            self._unit, self._words = unit, words
            self._draw()

    def _draw(self) -> None:
        unit = self._unit
        entitle(self, *(("Unit",) if unit is None else (unit.serial, f"attempt {unit.attempt}")))
        self.set_class(unit is not None and unit.waits_for_qa, "bad")
        self.hang(Text(self._words, "dim") if unit is None else unit_text(unit, *self.content_size))

    on_mount = on_resize = _draw


def unit_text(unit: "KnownUnit", width: int, height: int) -> Text:
    """Return the card of a unit: findings that are no pass first, as many as there is room for, then its state, the
    last entry and the last note."""
    below = [_standing(unit)]
    if unit.last:
        entered = f"{pretty(unit.last)}, {when_words(unit.entered)} by {unit.entered_by}"
        below.append(Text.assemble(("last  ", "dim"), entered))
    if unit.note:
        below.append(
            Text.assemble(
                (f"note{f', the last of {unit.notes}' if unit.notes > 1 else ''}  ", "dim"),
                (f"“{unit.note}”", _RED if unit.note == unit.held_by else ""),
            )
        )
    found = sorted(unit.findings, key=lambda finding: str(finding.verdict) == "pass")
    rows = max(height - len(below), 0)
    shown = found if len(found) <= rows else found[: max(rows - 1, 0)]
    room = min(max((len(label_of(finding.quantity)) for finding in shown), default=0), max(width // 3, 20))
    above = [finding_line(finding, room, width) for finding in shown]
    if len(shown) < len(found) and rows:
        above.append(Text(f"  and {len(found) - len(shown)} more; of all: {_counted(found)}", "dim"))
    if not found:
        above = [Text.assemble((f"{mark} ", style), title) for mark, style, title in unit.marks[:rows]]
    if 0 < len(above) < rows:
        above.append(Text())
    return Text("\n").join([_cut(line, width) for line in (*above, *below)])


def _standing(unit: "KnownUnit") -> Text:
    begun = f"begun by {unit.begun_by} {when_words(unit.begun)}" if unit.begun else ""
    where = state_words(unit)
    where.stylize("bold")
    nothing = "; nothing is judged yet" if unit.is_begun and not unit.findings else ""
    return Text.assemble(where, ("  ·  ", "dim"), (f"{begun}{nothing}", "dim"))


def _counted(findings: "Sequence[Finding]") -> str:
    """Return how many findings have each verdict: `5 pass, 1 fail`."""
    verdicts = [str(finding.verdict) for finding in findings]
    return ", ".join(f"{verdicts.count(each)} {_sign(each).word}" for each in sorted(set(verdicts), reverse=True))


def finding_line(finding: "Finding", name: int, width: int) -> Text:
    """Return one finding with its value inside its limits, as far as there is room. name: columns of its label."""
    sign = _sign(str(finding.verdict))
    done = finding.cause is None or finding.cause.cause.name != "NOT_MEASURED"  # its module comes with the physics
    mark, style = (sign.mark, sign.tone.style) if done else ("·", "dim")
    value = numbers(finding.value, finding.U, finding.unit) if done else "not done"
    text = Text.assemble((f"{mark} ", style), f"{label_of(finding.quantity)[:name]:<{name}}")
    text.append(f"{value[:_VALUE]:>{_VALUE}}", "bold")
    room = min(width - text.cell_len - 3, _BAR + max(width - 100, 0) // 2)
    if room >= 10 and (finding.lower, finding.upper) != (None, None):
        bar = LimitBar(finding.lower, finding.upper, room, finding.value)
        text.append("   ").append_text(bar.drawn(style, finding.U))
    return text


def _sign(verdict: str, *, of_unit: bool = False) -> "Sign":
    from accept.pictures.signs import FINDINGS, UNITS  # numpy comes with it: the first screen does not wait for that

    return (UNITS if of_unit else FINDINGS)[verdict]


def _cut(text: Text, room: int) -> Text:
    text.truncate(room, overflow="ellipsis")
    return text
