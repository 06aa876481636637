"""`accept recall`."""

import datetime

from rich import box
from rich.table import Table

from accept.base.console import clear_errors, say, stdout
from accept.base.exit_codes import Exit
from accept.store import open_store
from accept.store.instrument_recall import touched


@clear_errors
def run(instrument: str, since: datetime.date) -> Exit:
    """List every unit that an instrument touched since a day."""
    with open_store() as store:
        ever = touched(store.events(), instrument, datetime.date.min)
    touches = [touch for touch in ever if touch.time[:10] >= since.isoformat()]
    if not ever:
        say(f"no unit was ever touched by an instrument '{instrument}': is its serial number right?")
        return Exit.INCOMPLETE
    if not touches:
        say(f"no unit was touched by instrument {instrument} since {since}")
        return Exit.ACCEPTED
    table = Table("unit", "when (UTC)", "what", "event", box=box.SIMPLE_HEAD, padding=0, pad_edge=False)
    for touch in touches:
        table.add_row(touch.unit, touch.time[:19], touch.how, str(touch.seq))
    stdout.print(table)
    units = sorted({touch.unit for touch in touches})
    say(f"{len(units)} units touched by instrument {instrument} since {since}: {', '.join(units)}")
    return Exit.ACCEPTED
