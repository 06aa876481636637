"""Below a form: what the instrument of the present line shows, and where that lies inside its limits."""

from functools import partial

from rich.text import Text
from textual.message import Message
from textual.widgets import Static

from accept.tui.widgets.limit_bar import limit_bar, limits, numbers, usual_words
from accept.workflow.instruments.port import InstrumentPort, Look, Watch
from checks.declare import Measured
from specs.spec import Limit

_LINE = 24  # columns for value and instrument: it is never broken inside its name
_STRIP = 26  # columns of the drawn bar


class Gauge(Static):
    """Follows one instrument at a time, from a thread; the last fault stays beside the value until it is read away."""

    class Looked(Message):
        """What the thread saw."""

        def __init__(self, token: object, seen: Look) -> None:
            super().__init__()
            self.token, self.seen = token, seen

    def __init__(self) -> None:
        super().__init__(id="gauge", markup=False)
        self._watch: Watch | None = None
        self._token = object()  # of the line that is followed: a look at the one before comes late
        self._whose, self._unit = "", ""
        self._limit: Limit | None = None
        self._usual: float | None = None
        self._value: Measured | None = None
        self._fault = ""

    def follow(
        self,
        instrument: InstrumentPort | None,
        unit: str,
        limit: Limit | None,
        stored: Measured | None,
        usual: float | None = None,
    ) -> None:
        """Look at this instrument from now on; without one, show what is stored. The fault of an instrument stays if it
        is the same one: the cursor comes back to the line whose reading failed. usual: value of the units before."""
        self.leave()
        if instrument is None or instrument.short_name != self._whose:
            self._fault = ""
        self._whose, self._unit, self._limit, self._value, self._usual = "", unit, limit, stored, usual
        self._token = token = object()
        if instrument is not None:
            self._whose, self._value = instrument.short_name, None
            self._watch = Watch(instrument, unit, partial(self._tell, token))
        self._draw()

    def forget(self) -> None:
        """Forget the last fault: a value was saved since."""
        self._fault = ""

    def leave(self) -> None:
        """Look at nothing any more."""
        if self._watch is not None:
            self._watch.stop()
            self._watch = None

    on_unmount = leave

    def _tell(self, token: object, seen: Look) -> None:
        """Tell the screen, from the thread that looks."""
        self.post_message(self.Looked(token, seen))

    def on_gauge_looked(self, event: Looked) -> None:
        if event.token is not self._token or self._watch is None:
            return
        self._value = event.seen.measured
        self._fault = event.seen.error or self._fault
        self._draw()

    def _draw(self) -> None:
        text = gauge_text(self._whose, self._value, self._unit, self._limit, self._fault, self._usual)
        self.display = bool(text.plain)
        self.update(text)


def gauge_text(
    name: str, value: Measured | None, unit: str, limit: Limit | None, fault: str, usual: float | None = None
) -> Text:
    """Return what stands beside a value. name: of the instrument, "" for a stored value; fault: the last one, ""
    without; usual: value of the units before."""
    text = Text()
    if name:
        text.append("now ", "dim").append("…" if value is None else _number(value, unit), "bold")
        on = f"on {name}"
        text.append(f"{'  ' if len(text.plain) + 2 + len(on) <= _LINE else chr(10)}{on}\n", "dim")
    if limit is not None and value is not None:
        drawn = limit_bar(value.value, value.U, limit.lower, limit.upper, _STRIP, usual)
        inside = limit.bounds[0] <= value.value <= limit.bounds[1]
        text.append(drawn, "green" if inside else "bold red")
        text.append(f"  {limits(limit.lower, limit.upper)} {limit.unit}{usual_words(usual)}", "dim")
        text.append("\n" if inside else "  outside\n", "" if inside else "bold red")
    if fault:
        text.append(f"✗ {fault}" if value is None else f"✗ before: {fault}", "bold red" if value is None else "dim")
    text.rstrip()
    return text


def _number(value: Measured, unit: str) -> str:
    if value.U:
        return numbers(value.value, value.U, unit)
    return f"{value.value + 0.0:.5g} {unit}"  # no "-0"
