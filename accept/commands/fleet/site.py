"""`accept site`: a page of the fleet that opens from a file."""

from pathlib import Path
from typing import Annotated

from typer import Option

from accept.base.progress import busy
from accept.commands.answer import Answer, Remark, command
from accept.fleet.measurements import day
from accept.fleet.site.page_data import MOST, curves, document
from accept.fleet.site.write_site import write_site
from accept.store import open_store


@command
def run(
    out: Annotated[Path, Option(help="Folder for the page.")],
    last: Annotated[int, Option(min=1, help="How many judgements are shown, the last ones of the store.")] = MOST,
    since: Annotated[str | None, Option(help="First day (2026-10-05) or month (2026-10) of measuring, UTC.")] = None,
    until: Annotated[str | None, Option(help="Last day or month, UTC.")] = None,
    units: Annotated[list[Path] | None, Option(help="Unit folders whose curves are shown; repeat.")] = None,
) -> Answer:
    """Write a page of the fleet. Yield, causes, trends, what happened, and every unit's findings; opens offline."""
    panels = {}
    if units:
        from accept.commands.units.compare import measured  # loads the checks: only for curves

        panels = {result.serial: result.panels for result in measured(units, None)}
    with busy("writing the page"), open_store() as store:
        content = document(store, curves(panels), out.resolve(), last, day(since), day(until, last=True))
    write_site(out, content)
    shown, of = len(content["judgements"]), content["of"]
    last_ones = "" if since or until else "the last "
    count = f"{last_ones}{shown} of {of}" if shown < of else shown
    return Answer(Remark(f"{count} judgements: open {out / 'index.html'}"))
