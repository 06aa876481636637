"""`accept hw scan`: find ports and network instruments, and propose a bench file."""

from typing import Annotated

import typer

from accept.base.console import clear_errors, say, tell
from accept.base.documents.answers import check_answer, wants_text
from accept.base.documents.listings import PlaceSeen, PlacesSeen
from accept.base.exit_codes import Exit
from accept.commands.options import JsonAnswer
from hw.instruments import find_instruments

PY = "@py"


@clear_errors
def scan(
    resource: Annotated[
        list[str] | None, typer.Option(help="VISA name of an instrument to ask, too, or host:number of an IDS3010.")
    ] = None,
    library: Annotated[str, typer.Option(help="VISA library: @py (pyvisa-py), @ivi (of an adapter's maker).")] = PY,
    json: JsonAnswer = None,
) -> Exit:
    """Find ports and VISA instruments. Proposes a bench file; serial ports are only listened to."""
    check_answer(json)
    places = [PlaceSeen(*found) for found in find_instruments(resource or (), library, say)]
    for one in places:
        say(f"{one.place}: {one.found}")
    if not places:
        say("no serial port and no VISA instrument was found")
    if not wants_text(json, PlacesSeen(tuple(places))):
        return Exit.ACCEPTED
    entries = [one.entry for one in places if one.entry]
    tell("# Proposed by `accept hw scan`: name it, and say of each serial port what stands there.", 'name = "bench 1"')
    tell("", *(line for entry in entries for line in entry.splitlines()))
    return Exit.ACCEPTED
