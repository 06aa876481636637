"""`accept recall`."""

import datetime
from typing import Annotated

from typer import Option

from accept.base.documents.listings import Recall, TouchListed
from accept.base.exit_codes import Exit
from accept.commands.answer import PLAIN, Answer, File, Remark, command, csv_of, table
from accept.commands.options import Csv, FirstDay, JsonAnswer, LastDay
from accept.judging.golden import goldens, not_counted
from accept.store import Store, StoreError, open_store, touched
from accept.store.payloads import GoldenMet, payload_of

TITLES = ("unit", "when (UTC)", "what", "event")


@command
def run(
    instrument: Annotated[str, Option(help="Serial number of the instrument.")],
    since: FirstDay = None,
    since_good: Annotated[
        bool, Option("--since-good", help="From the day on which this bench's golden units last were as they should.")
    ] = False,
    until: LastDay = None,
    csv: Csv = None,
    json: JsonAnswer = None,
) -> Answer:
    """List the units measured with an instrument. From the event store."""
    last_day = until.date() if until else datetime.date.max
    with open_store() as store:
        first_day = _first_day(store, since, since_good)
        ever, named = touched(store.events(), instrument, datetime.date.min), goldens(store)
    days = f"since {first_day}" if until is None else f"from {first_day} to {last_day}"
    within = [touch for touch in ever if first_day.isoformat() <= touch.time[:10] <= last_day.isoformat()]
    touches = [touch for touch in within if touch.unit not in named]
    golden = [touch.unit for touch in within if touch.unit in named and touch.how.startswith("judged")]
    units = sorted({touch.unit for touch in touches})
    listed = [TouchListed(touch.unit, touch.time, touch.how, touch.seq) for touch in touches]
    recalled = Recall(
        instrument,
        first_day.isoformat(),
        bool(ever),
        tuple(units),
        tuple(listed),
        last_day.isoformat() if until else None,
    )
    rows = [(touch.unit, touch.time[:19], touch.how, str(touch.seq)) for touch in touches]
    head = Remark(not_counted(len(golden), golden)), File(json, recalled), File(csv, lambda: _csv(rows))
    if not ever:
        words = f"no unit was ever touched by an instrument '{instrument}': is its serial number right?"
        return Answer(*head, Remark(words), exit=Exit.INCOMPLETE)
    if not touches:
        return Answer(*head, Remark(f"no unit was touched by instrument {instrument} {days}"))
    words = f"{len(units)} units touched by instrument {instrument} {days}: {', '.join(units)}"
    return Answer(*head, table(TITLES, rows, **PLAIN), Remark(words))


def _first_day(store: Store, since: datetime.datetime | None, since_good: bool) -> datetime.date:
    """Return the day that was asked for. Raises StoreError if none or two were, or if no golden unit was ever right."""
    if (since is None) != since_good:
        raise StoreError("recall: say from when on, either --since YYYY-MM-DD or --since-good")
    if since is not None:
        return since.date()
    met = ((event.time, payload_of(event, GoldenMet)) for event in store.events())
    days = [time[:10] for time, good in met if isinstance(good, GoldenMet) and good.bench == store.bench]
    if not days:
        raise StoreError("no golden unit was ever compared and found right at this bench: name the day with --since")
    return datetime.date.fromisoformat(max(days))


def _csv(rows: list[tuple[str, str, str, str]]) -> bytes:
    import pandas as pd  # loaded where a table is written

    return csv_of(pd.DataFrame(rows, columns=["unit", "time", "what", "event"]))
