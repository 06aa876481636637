"""`accept hw transcript`: every byte that went over an instrument's line, as it was kept."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from accept.commands.answer import Answer, command, refusal
from accept.store import open_store
from specs.files import json_of, read_bounded

Entry = list[Any]  # [time, way, text], as hw.link.Traffic writes it
MAX_BYTES = 50_000_000  # of a file with a transcript


@command
def run(
    source: Annotated[str, typer.Argument(help="Serial of a unit in the store, or a commissioning record.")],
    instrument: Annotated[str | None, typer.Option(help="Only this instrument of the bench file.")] = None,
) -> Answer:
    """Print the bytes that an instrument sent and received. A line each: time (UTC), direction, bytes."""
    try:
        found = [(f"# {head}", *map(_line, entries)) for head, entries in _transcripts(source, instrument)]
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as e:
        return refusal(f"{source}: holds no transcript ({type(e).__name__}: {e})")
    if not found:
        return refusal(f"{source}: no transcript of {instrument or 'an instrument'} is kept")
    return Answer(*(line for lines in found for line in lines))


def _transcripts(source: str, instrument: str | None) -> Iterator[tuple[str, list[Entry]]]:
    """Yield (title, entries) of each transcript in a commissioning record or in all events of a unit."""
    if Path(source).is_file():
        record = json_of(read_bounded(Path(source), MAX_BYTES))["record"]
        if instrument in (None, record["instrument"]):
            yield f"{record['instrument']}, commissioning on {record['on']}", record["transcript"]
        return
    with open_store() as store:
        for event in store.events(source):
            evidence = event.data.get("evidence") or event.data
            name, entries = evidence.get("instrument"), evidence.get("transcript")
            if entries and instrument in (None, name):
                yield f"{event.time[:19]} {event.what} {name or ''}, event {event.seq}", entries


def _line(entry: Entry) -> str:
    t, way, text = entry
    when = datetime.fromtimestamp(t, UTC).strftime("%Y-%m-%dT%H:%M:%S.%f")[:-3]
    shown = text if way == "note" else repr(text.encode("latin-1"))[1:]
    return f"{when} {way:7s} {shown}"
