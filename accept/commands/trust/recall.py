"""`accept recall`."""

import datetime
from typing import Annotated

from typer import Option

from accept.base.documents.listings import Recall, TouchListed
from accept.base.exit_codes import Exit
from accept.commands.answer import PLAIN, Answer, File, Remark, command, csv_of, refusal, table
from accept.commands.options import Csv, FirstDay, JsonAnswer, LastDay
from accept.fleet import goldens, not_counted
from accept.store import Store, StoreError, open_store, touched
from accept.store.payloads import GoldenMet, UnitJudged, payload_of

COLUMNS = ["unit", "time", "what", "event"]
TITLES = ("unit", "when (UTC)", "what", "event")


@command
def run(
    instrument: Annotated[
        str, Option(help="Serial number of the instrument; without: all that was judged at this bench.")
    ] = "",
    since: FirstDay = None,
    since_good: Annotated[
        bool, Option("--since-good", help="From the day on which this bench's golden units last were as they should.")
    ] = False,
    until: LastDay = None,
    csv: Csv = None,
    json: JsonAnswer = None,
) -> Answer:
    """List the units measured with an instrument or at this bench. From the event store."""
    if (since is None) != since_good:
        return refusal("recall: say from when on, either --since YYYY-MM-DD or --since-good")
    last_day = until.date() if until else datetime.date.max
    with open_store() as store:
        first_day = since.date() if since else _last_good_day(store)
        events = store.events() if instrument else store.events(what=UnitJudged.KIND)
        ever, named = touched(events, instrument, datetime.date.min, store.bench), goldens(store)
    by = f"touched by instrument {instrument}" if instrument else "judged at this bench"
    days = f"since {first_day}" if until is None else f"from {first_day} to {last_day}"
    within = [touch for touch in ever if first_day.isoformat() <= touch.time[:10] <= last_day.isoformat()]
    touches = [touch for touch in within if touch.unit not in named]
    golden = [touch.unit for touch in within if touch.unit in named and touch.how.startswith("judged")]
    units = sorted({touch.unit for touch in touches})
    listed = [TouchListed(touch.unit, touch.time, touch.how, touch.seq) for touch in touches]
    end = last_day.isoformat() if until else None
    recalled = Recall(instrument, first_day.isoformat(), bool(ever), tuple(units), tuple(listed), end)
    rows = [(touch.unit, touch.time[:19], touch.how, str(touch.seq)) for touch in touches]
    head = Remark(not_counted(len(golden), golden)), File(json, recalled), File(csv, lambda: csv_of(rows, COLUMNS))
    if instrument and not ever:
        words = f"no unit was ever touched by an instrument '{instrument}': is its serial number right?"
        return Answer(*head, Remark(words), exit=Exit.INCOMPLETE)
    if not touches:
        return Answer(*head, Remark(f"no unit was {by} {days}"))
    words = f"{len(units)} units {by} {days}: {', '.join(units)}"
    return Answer(*head, table(TITLES, rows, **PLAIN), Remark(words))


def _last_good_day(store: Store) -> datetime.date:
    """Return the day on which this bench's golden units last were right. Raises StoreError if they never were."""
    met = ((event.time, payload_of(event, GoldenMet)) for event in store.events())
    days = [time[:10] for time, good in met if isinstance(good, GoldenMet) and good.bench == store.bench]
    if not days:
        raise StoreError("no golden unit was ever compared and found right at this bench: name the day with --since")
    return datetime.date.fromisoformat(max(days))
