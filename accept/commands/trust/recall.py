"""`accept recall`."""

import datetime
from typing import Annotated

import typer
from rich import box
from rich.table import Table

from accept.base.console import clear_errors, say, stdout
from accept.base.documents.answers import check_answer, wants_text
from accept.base.documents.listings import Recall, TouchListed
from accept.base.exit_codes import Exit
from accept.commands.options import JsonAnswer
from accept.judging.golden import goldens, not_counted
from accept.store import open_store
from accept.store.instrument_recall import touched


@clear_errors
def run(
    instrument: Annotated[str, typer.Option(help="Serial number of the instrument.")],
    since: Annotated[
        datetime.datetime, typer.Option(formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="First day, UTC.")
    ],
    json: JsonAnswer = None,
) -> Exit:
    """List the units measured with an instrument. From the event store."""
    check_answer(json)
    first_day = since.date()
    with open_store() as store:
        ever, named = touched(store.events(), instrument, datetime.date.min), goldens(store)
    later = [touch for touch in ever if touch.time[:10] >= first_day.isoformat()]
    touches = [touch for touch in later if touch.unit not in named]
    golden = [touch.unit for touch in later if touch.unit in named and touch.how.startswith("judged")]
    units = sorted({touch.unit for touch in touches})
    listed = [TouchListed(touch.unit, touch.time, touch.how, touch.seq) for touch in touches]
    recalled = Recall(instrument, first_day.isoformat(), bool(ever), tuple(units), tuple(listed))
    if words := not_counted(len(golden), golden):
        say(words)
    as_text = wants_text(json, recalled)
    if not ever:
        say(f"no unit was ever touched by an instrument '{instrument}': is its serial number right?")
        return Exit.INCOMPLETE
    if not touches:
        say(f"no unit was touched by instrument {instrument} since {first_day}")
        return Exit.ACCEPTED
    table = Table("unit", "when (UTC)", "what", "event", box=box.SIMPLE_HEAD, padding=0, pad_edge=False)
    for touch in touches:
        table.add_row(touch.unit, touch.time[:19], touch.how, str(touch.seq))
    if as_text:
        stdout.print(table)
    say(f"{len(units)} units touched by instrument {instrument} since {first_day}: {', '.join(units)}")
    return Exit.ACCEPTED
