"""The cards around the units of a bench, as text: who works where with which instruments, what waits, the week."""

from collections.abc import Mapping
from datetime import datetime
from typing import TYPE_CHECKING

from rich.text import Text

from accept.pictures.labels import label_of
from accept.tui.widgets.limit_bar import blocks, share_bar

if TYPE_CHECKING:
    from accept.workflow.steps.overview import Drift, Overview, Week
    from accept.workflow.steps.unit_list import Queue

WIDTH = 26  # columns in the cards on the left
_TITLE, _BAR = 19, 4  # columns of a queue's row; the other columns are for the count
_BARS = 14  # units whose time is drawn
_DAYS = ("Mo", "Tu", "We", "Th", "Fr", "Sa", "Su")
_ANSWERS = {True: ("●", "green"), False: ("●", "bold red"), None: ("○", "dim")}


def bench_line(bench: str, operator: str, answering: Mapping[str, bool | None], now: datetime, width: int) -> Text:
    """Return the head line: program, bench, operator and clock on the left, the instruments on the right, as many as
    have room. A full dot has answered when it was asked last, an empty one was not asked yet."""
    left = Text.assemble((" ◆ accept", "bold yellow"), no_wrap=True, overflow="ellipsis")
    left.append(f"  bench {bench}" if bench else "", "default not bold")
    left.append(f"   {operator}" if operator else "", "bold default")
    left.append(f"   {now:%a %d %b %H:%M}", "dim not bold default")
    right = Text()
    for name, answers in answering.items():
        dot = Text.assemble("  ", _ANSWERS[answers], f" {name}")
        if left.cell_len + right.cell_len + dot.cell_len + 2 <= width:
            right.append_text(dot)
    gap = width - left.cell_len - right.cell_len - 1
    return left.append(" " * max(gap, 0)).append_text(right)


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
    line = Text(" ", no_wrap=True, overflow="ellipsis")
    for n, each in enumerate(words[first:], first):
        line.append(each, "reverse bold" if n == place else "").append("  ")
    return line


def week_text(week: "Week") -> Text:
    """Return what became of the units that were begun in this week; what nothing is known of is left out."""
    if not week.begun:
        return Text("Nothing begun this week yet.\nScan a serial to begin.", "dim")
    others = week.begun - week.accepted - week.rejected - week.held - week.undecided
    counts = [("accepted", week.accepted, "green"), ("rejected", week.rejected, "bold red")]
    counts += [("undecided", week.undecided, "yellow")] * bool(week.undecided)
    counts.append(("held", week.held, "bold yellow"))
    text = share_bar([(count, style) for _, count, style in counts], week.begun, WIDTH).append("\n")
    for name, count, style in (*counts, ("open", others, "dim")):
        text.append(f"{name:<{WIDTH - 6}}").append(f"{count:>6}\n", style if count else "dim")
    if any(week.by_day):
        bars = (2 * bar for bar in blocks(week.by_day, len(_DAYS), empty=True))
        text.append(f"\n{' '.join(_DAYS)}\n", "dim").append(f"{' '.join(bars)}\n", "blue")
    if week.minutes:
        usual = week.usual_minutes
        words = "<1 min" if usual < 1 else f"{usual:.0f} min" if usual < 120 else f"{usual / 60:.0f} h"
        text.append("\ntime per unit\n", "dim")
        text.append(blocks(week.minutes[-_BARS:], _BARS, empty=True), "cyan").append(f"  {words}\n")
    if week.drift is not None:
        text.append("\n").append_text(drift_text(week.drift))
    text.rstrip()
    return text


def drift_text(drift: "Drift") -> Text:
    """Return the quantity whose trend is the clearest, and what to do about it."""
    style = "yellow" if drift.way else "cyan"
    text = Text(f"{label_of(drift.quantity)}, last {len(drift.values)}"[:WIDTH], "dim")
    text.append(f"\n{blocks(drift.values, len(drift.values))}\n", f"not dim {style}")
    words = {1: "drifts up: check gauge", -1: "drifts down: check gauge", 0: "steady"}
    return text.append(words[drift.way], f"not dim bold {style}" if drift.way else "")
