"""What stands around the units of a bench, as text: who works where with which instruments, what waits, the week."""

from collections.abc import Mapping
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from rich.text import Text

from accept.tui.widgets.sparkline import share, sparkline

if TYPE_CHECKING:
    from accept.workflow.steps.overview import Drift, Overview, Week
    from accept.workflow.steps.unit_list import Queue

WIDTH = 26  # columns in the cards on the left
_TITLE, _BAR = 19, 4  # columns of a queue's row; the count has what is left
_WORKDAYS = 5  # the others are shown if something was done there
_ANSWERS = {True: ("●", "green"), False: ("●", "bold red"), None: ("○", "dim")}


def bench_line(bench: str, operator: str, answering: Mapping[str, bool | None], now: datetime, width: int) -> Text:
    """Return the head line: program, bench, operator and clock on the left, the instruments on the right, as many as
    have room. A full dot has answered when it was asked last, an empty one was not asked yet."""
    left = Text(" ◆ accept", "bold yellow")
    left.append(f"  bench {bench}" if bench else "", "default not bold")
    left.append(f"   {operator}" if operator else "", "bold default")
    left.append(f"   {now:%a %d %b %H:%M}", "dim not bold default")
    right = Text()
    for name, answers in answering.items():
        dot = Text.assemble("  ", _ANSWERS[answers], f" {name}")
        if left.cell_len + right.cell_len + dot.cell_len + 2 <= width:
            right.append_text(dot)
    gap = width - left.cell_len - right.cell_len - 1
    line = left.append(" " * max(gap, 0)).append_text(right)
    line.no_wrap, line.overflow = True, "ellipsis"
    return line


def queue_row(queue: "Queue", most: int) -> Text:
    """Return the title of a queue, a bar beside those of the others, and how many wait. most: in one queue."""
    count = len(queue.units)
    bar = "▪" * max(1 if count else 0, round(_BAR * count / most) if most else 0)
    row = Text(f"{queue.title[:_TITLE]:<{_TITLE}}")
    return row.append(f"{bar:<{_BAR}}", "cyan").append(f"{count:>{WIDTH - _TITLE - _BAR}}", "bold")


def counts_line(overview: "Overview", shown: "Queue | None", width: int) -> Text:
    """Return the queues in one line, for a terminal without room for the cards on the left. The shown one stands out;
    those before it give way."""
    place = next((n for n, queue in enumerate(overview.queues) if queue == shown), 0)
    words = [f"{queue.title} {len(queue.units)}" for queue in overview.queues]
    first = next((n for n in range(place) if len("  ".join(words[n : place + 1])) < width - 1), place)
    line = Text(" ")
    for n, each in enumerate(words[first:], first):
        line.append(each, "reverse bold" if n == place else "").append("  ")
    line.no_wrap, line.overflow = True, "ellipsis"
    return line


def week_text(week: "Week") -> Text:
    """Return what became of the units that were begun in this week; what nothing is known of is left out."""
    if not week.begun:
        return Text("Nothing begun this week yet.\nScan a serial to begin.", "dim")
    done, left = share(week.judged, week.begun, WIDTH)
    text = Text.assemble((done, "green"), (left, "dim"), "\n")
    others = week.begun - week.accepted - week.rejected - week.held
    counts = (("accepted", week.accepted, "green"), ("rejected", week.rejected, "bold red"))
    for name, count, style in (*counts, ("held", week.held, "bold yellow"), ("open", others, "dim")):
        text.append(f"{name:<{WIDTH - 6}}").append(f"{count:>6}\n", style if count else "dim")
    if any(week.by_day):
        days = _WORKDAYS if not any(week.by_day[_WORKDAYS:]) else len(week.by_day)
        wide = 3 if days == _WORKDAYS else 2
        monday = datetime(2024, 1, 1)  # whichever
        names = (f"{monday + timedelta(days=day):%a}"[:wide] for day in range(days))
        bars = (bar * wide for bar in sparkline(week.by_day[:days], zero=True))
        text.append(f"\n{' '.join(names)}\n", "dim").append(f"{' '.join(bars)}\n", "blue")
    if week.minutes:
        last = week.minutes[-14:]
        text.append("\ntime per unit\n", "dim").append(sparkline(last, zero=True), "cyan")
        text.append(f"  {_minutes(week.usual_minutes)}\n")
    if week.drift is not None:
        text.append("\n").append_text(drift_text(week.drift))
    text.rstrip()
    return text


def week_title(week: "Week") -> str:
    """Return how many of the units that were begun have a verdict."""
    return f"{week.judged} of {week.begun}{'' if week.whole else '+'}" if week.begun else ""


def _minutes(minutes: float) -> str:
    if minutes < 1:
        return "<1 min"
    hours = minutes / 60
    return f"{minutes:.0f} min" if hours < 2 else f"{hours:.0f} h" if hours < 48 else f"{hours / 24:.0f} d"


def drift_text(drift: "Drift") -> Text:
    """Return the quantity whose trend is the clearest, and what to do about it."""
    from accept.pictures.labels import label_of  # loads the checks, which are there when something was judged

    words = {1: "drifts up: check gauge", -1: "drifts down: check gauge", 0: "steady"}
    label = f"{label_of(drift.quantity)}, last {len(drift.values)}"
    text = Text(f"{label[:WIDTH]}\n", "dim")
    style = "yellow" if drift.way else "cyan"
    return text.append(f"{sparkline(drift.values)}\n", style).append(
        words[drift.way], f"bold {style}" if drift.way else "dim"
    )
