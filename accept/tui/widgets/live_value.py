"""The live value of the present line's instrument: the value in digits that are seen from afar, where it lies inside
its limits and among the units before, and how it has moved."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from statistics import median

from rich.segment import Segment
from rich.style import Style
from rich.text import Text
from textual.message import Message
from textual.renderables.digits import Digits

from accept.tui.widgets.card import chip, entitle
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.limit_bar import (
    USUAL,
    VALUE,
    LimitBar,
    after_number,
    alike,
    blocks,
    limits,
    numbers,
    usual_words,
)
from accept.tui.widgets.step_list import WIDE_FROM
from accept.workflow.instruments.port import EVERY_S, InstrumentPort, Look, Watch
from checks.declare import Measured
from checks.rounding import with_U
from specs.spec import Limit

_STRIP, _LEAST_STRIP = 26, 10  # columns of the drawn bar on a small terminal
_ROOM = 80  # columns before the first layout
_SHOWN_S = 30  # of what was seen, one column for each second
_LEAST_ROWS = 30  # of a terminal with room for large digits


@dataclass(frozen=True)
class Followed:
    """A line whose value is shown. name: of the instrument, "" for a stored value; label: of the line; earlier: values
    of the last units."""

    name: str = ""
    label: str = ""
    unit: str = ""
    limit: Limit | None = None
    earlier: Sequence[float] = ()

    @property
    def usual(self) -> float | None:
        return median(self.earlier) if self.earlier else None


class Gauge(Hanging):
    """Follows one instrument at a time, from a thread; the last fault stays beside the value until it is read away.
    As long as a line is followed it has as many rows."""

    class Looked(Message):
        """The reading of an instrument, from the thread that reads it."""

        def __init__(self, token: object, seen: Look) -> None:
            super().__init__()
            self.token, self.seen = token, seen

    def __init__(self) -> None:
        super().__init__(id="gauge", classes="card")
        self._watch: Watch | None = None
        self._token = object()  # of the line that is followed: a look at the one before comes late
        self._about = Followed()
        self._value: Measured | None = None
        self._seen = deque[float](maxlen=round(_SHOWN_S / EVERY_S))
        self._fault, self._told = "", False

    def follow(self, instrument: InstrumentPort | None, about: Followed, stored: Measured | None) -> None:
        """Look at this instrument from now on; without one, show what is stored. The fault of an instrument stays if it
        is the same one: the cursor comes back to the line whose reading failed."""
        self.leave()
        if instrument is None or instrument.short_name != self._about.name:
            self._fault = ""
        self._about, self._value = about, stored
        self._seen.clear()
        self._token = token = object()
        if instrument is not None:
            self._value = None
            self._watch = Watch(instrument, about.unit, partial(self._tell, token))
        self._draw()

    def forget(self) -> None:
        """Forget the last fault: a value was saved since."""
        self._fault = ""

    def leave_to_field(self, told: bool) -> None:
        """Say no more of a fault than that there is one, as long as its field tells it."""
        if told != self._told:
            self._told = told
            self._draw()

    def leave(self) -> None:
        """Look at nothing any more."""
        if self._watch is not None:
            self._watch.stop()
            self._watch = None

    on_unmount = leave

    def _tell(self, token: object, seen: Look) -> None:
        self.post_message(self.Looked(token, seen))

    def on_gauge_looked(self, event: Looked) -> None:
        if event.token is self._token and self._watch is not None:
            self.show(event.seen)

    def show(self, seen: Look) -> None:
        self._value = seen.measured
        if self._value is not None:
            self._seen.append(self._value.value)
        self._fault = seen.error or self._fault
        self._draw()

    def on_resize(self) -> None:
        self._draw()  # with another layout on a small terminal

    def _draw(self) -> None:
        about, size = self._about, self.app.size
        self.display = bool(about.name or (about.limit is not None and self._value is not None))
        title = about.label[:1].upper() + about.label[1:]
        entitle(self, f"Live · {title}" if about.name else f"Saved · {title}", "●" if about.name else "")
        self.set_class(bool(about.name), "live")
        is_large = about.name and size.width >= WIDE_FROM and size.height >= _LEAST_ROWS
        text_of = large_text if is_large else gauge_text
        here = "no reading" if self._value is None else ""
        fault = here if self._told and self._fault else self._fault
        self.hang(text_of(about, self._value, fault, tuple(self._seen), self.size.width or _ROOM))


def gauge_text(
    about: Followed, value: Measured | None, fault: str, seen: Sequence[float] = (), room: int = _ROOM
) -> Text:
    """Return a value in its limits in three rows, fewer of a stored one. fault: the last one, "" without; seen: the
    values of the last half minute; room: columns."""
    text, limit = Text(), about.limit
    if about.name:
        text.append("now ", "dim").append("…" if value is None else _number(value, about.unit, seen), "bold")
        text.append(f"  on {about.name}\n", "dim")
    if limit is not None:
        bounds = f"  {limits(limit.lower, limit.upper, limit.unit)}"
        beside = "" if _inside(value, limit) else "  outside"
        width = max(_LEAST_STRIP, min(_STRIP, room - len(bounds) - len("  outside")))
        text.append_text(_drawn(about, value, width)[1]).append(bounds, "dim").append(beside, "bold red")
        more = usual_words(about.usual)
        text.append(more if width + len(bounds) + len(beside) + len(more) <= room else "", "dim").append("\n")
    return text.append_text(_fault_line(value, fault, room)) if about.name else text


def large_text(about: Followed, value: Measured | None, fault: str, seen: Sequence[float], columns: int) -> Text:
    """Return what is live in rows that stay where they are. seen: the values of the last half minute."""
    text, limit = Text(), about.limit
    colour, width = _colour(value, limit), max(_STRIP, columns)
    number = "-" if value is None else _digits(value, seen)
    state = "" if limit is None or value is None else "inside" if _inside(value, limit) else "outside"
    of = f" {after_number(about.unit)}{f'   ± {value.U:.2g}' if value is not None and value.U else ''}"
    for row, drawn in enumerate(_large(number)):
        text.append(f"  {drawn}", colour)
        if row == 2:
            text.append(of, "bold")
            text.append(state.rjust(width - 2 - len(drawn) - len(of)), colour)
        text.append("\n")
    text.append(f"\nlast {_SHOWN_S} s  ", "dim").append(f"{blocks(seen, min(_SHOWN_S, width - 11))}\n", "cyan")
    if limit is not None:
        text.append_text(Text("\n").join([*_drawn(about, value, width), Text()]))
        text.append(f"{VALUE} now", colour).append(f"   {limits(limit.lower, limit.upper, limit.unit)}")
        text.append(_earlier_words(about) + "\n", "dim")
    text.append_text(chip("F3 Take", "f3")).append(
        " …" if value is None else f" {_number(value, about.unit, seen)}", "bold"
    )
    text.append(f"\nfrom {about.name}\n", "dim")
    return text.append_text(_fault_line(value, fault, width))


def _earlier_words(about: Followed) -> str:
    if not about.earlier:
        return ""
    lo, hi = min(about.earlier), max(about.earlier)
    return f"   {USUAL} usual {about.usual:.3g}: the last {len(about.earlier)} units, {lo:.3g} to {hi:.3g}"


def _drawn(about: Followed, value: Measured | None, width: int) -> tuple[Text, Text, Text]:
    """Return the value inside its limits in three rows: the units before, the bar, the numbers of the limits."""
    limit, (at, U) = about.limit, (None, None) if value is None else (value.value, value.U)
    bar = LimitBar(*(None, None) if limit is None else (limit.lower, limit.upper), width, at)
    return bar.spread_above(about.earlier), bar.drawn(_colour(value, limit), U, about.usual), bar.numbers_below()


def _inside(value: Measured | None, limit: Limit) -> bool:
    return value is None or limit.bounds[0] <= value.value <= limit.bounds[1]


def _colour(value: Measured | None, limit: Limit | None) -> str:
    return "bold" if value is None or limit is None else "bold green" if _inside(value, limit) else "bold red"


def _fault_line(value: Measured | None, fault: str, room: int) -> Text:
    """Return the last fault in one row, without its remedy if that leaves no room for the cause."""
    if len(fault) + len("✗ before: ") > room:
        fault = fault.partition(". ")[0]
    text = Text(f"✗ {fault}", "bold red") if value is None else Text(f"✗ before: {fault}", "dim")
    text.truncate(room, overflow="ellipsis")
    return text if fault else Text(" ")


def _large(number: str) -> list[str]:
    """Return a number three rows high."""
    parts = Digits(number).render(Style(bold=True))
    return "".join(part.text for part in parts if isinstance(part, Segment)).splitlines()


def _digits(value: Measured, seen: Sequence[float]) -> str:
    """Return a value with as many decimals as those seen before, so that its point stands still."""
    return with_U(value.value, value.U).partition(" ")[0] if value.U else alike(value.value, seen, 5)


def _number(value: Measured, unit: str, seen: Sequence[float]) -> str:
    return numbers(value.value, value.U, unit) if value.U else f"{_digits(value, seen)}{after_number(unit)}"
