"""`accept recall`."""

import datetime
from typing import Annotated

from typer import Option

from accept.base.documents.listings import Recall, TouchListed
from accept.base.exit_codes import Exit
from accept.commands.answer import PLAIN, Answer, File, Remark, command, table
from accept.commands.options import JsonAnswer
from accept.fleet import goldens, not_counted
from accept.store import open_store, touched


@command
def run(
    instrument: Annotated[str, Option(help="Serial number of the instrument.")],
    since: Annotated[datetime.datetime, Option(formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="First day, UTC.")],
    json: JsonAnswer = None,
) -> Answer:
    """List the units measured with an instrument. From the event store."""
    first_day = since.date()
    with open_store() as store:
        ever, named = touched(store.events(), instrument, datetime.date.min), goldens(store)
    later = [touch for touch in ever if touch.time[:10] >= first_day.isoformat()]
    touches = [touch for touch in later if touch.unit not in named]
    golden = [touch.unit for touch in later if touch.unit in named and touch.how.startswith("judged")]
    units = sorted({touch.unit for touch in touches})
    listed = [TouchListed(touch.unit, touch.time, touch.how, touch.seq) for touch in touches]
    recalled = Recall(instrument, first_day.isoformat(), bool(ever), tuple(units), tuple(listed))
    head = Remark(not_counted(len(golden), golden)), File(json, recalled)
    if not ever:
        words = f"no unit was ever touched by an instrument '{instrument}': is its serial number right?"
        return Answer(*head, Remark(words), exit=Exit.INCOMPLETE)
    if not touches:
        return Answer(*head, Remark(f"no unit was touched by instrument {instrument} since {first_day}"))
    rows = ((touch.unit, touch.time[:19], touch.how, str(touch.seq)) for touch in touches)
    words = f"{len(units)} units touched by instrument {instrument} since {first_day}: {', '.join(units)}"
    return Answer(*head, table(("unit", "when (UTC)", "what", "event"), rows, **PLAIN), Remark(words))
