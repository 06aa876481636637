"""`accept recall`."""

import datetime
from typing import Annotated

import typer
from rich import box
from rich.table import Table

from accept.base.console import clear_errors, say, stdout
from accept.base.exit_codes import Exit
from accept.store import open_store
from accept.store.instrument_recall import touched


@clear_errors
def run(
    instrument: Annotated[str, typer.Option(help="Serial number of the instrument.")],
    since: Annotated[
        datetime.datetime, typer.Option(formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="First day, UTC.")
    ],
) -> Exit:
    """List the units measured with an instrument. From the event store."""
    first_day = since.date()
    with open_store() as store:
        ever = touched(store.events(), instrument, datetime.date.min)
    touches = [touch for touch in ever if touch.time[:10] >= first_day.isoformat()]
    if not ever:
        say(f"no unit was ever touched by an instrument '{instrument}': is its serial number right?")
        return Exit.INCOMPLETE
    if not touches:
        say(f"no unit was touched by instrument {instrument} since {first_day}")
        return Exit.ACCEPTED
    table = Table("unit", "when (UTC)", "what", "event", box=box.SIMPLE_HEAD, padding=0, pad_edge=False)
    for touch in touches:
        table.add_row(touch.unit, touch.time[:19], touch.how, str(touch.seq))
    stdout.print(table)
    units = sorted({touch.unit for touch in touches})
    say(f"{len(units)} units touched by instrument {instrument} since {first_day}: {', '.join(units)}")
    return Exit.ACCEPTED
