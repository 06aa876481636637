"""`accept hw scan`: find ports and network instruments, and propose a bench file."""

from typing import Annotated

from typer import Option

from accept.base.console import say
from accept.base.documents.listings import PlaceSeen, PlacesSeen
from accept.commands.answer import Answer, File, Remark, command
from accept.commands.options import JsonAnswer
from hw.instruments import find_instruments

PY = "@py"


@command
def scan(
    resource: Annotated[
        list[str] | None, Option(help="VISA name of an instrument to ask, too, or host:number of an IDS3010.")
    ] = None,
    library: Annotated[str, Option(help="VISA library: @py (pyvisa-py), @ivi (of an adapter's maker).")] = PY,
    json: JsonAnswer = None,
) -> Answer:
    """Find ports and VISA instruments. Proposes a bench file; serial ports are only listened to."""
    places = [PlaceSeen(*found) for found in find_instruments(resource or (), library, say)]
    return Answer(
        *(Remark(f"{one.place}: {one.found}") for one in places),
        Remark("" if places else "no serial port and no VISA instrument was found"),
        File(json, PlacesSeen(tuple(places))),
        "# Proposed by `accept hw scan`: name it, and say of each serial port what stands there.",
        'name = "bench 1"',
        "",
        *(line for one in places for line in (one.entry or "").splitlines()),
    )
