"""`accept evidence`."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.base.progress import busy
from accept.certificate.evidence import write_evidence
from accept.commands.answer import Answer, Remark, command, csv_of
from accept.commands.trust.store import event_line
from accept.store import open_store
from accept.store.payloads import CertificateSigned


@command
def run(
    out: Annotated[Path, Argument(help="Folder to write, which must not be there.")],
    units: Annotated[
        list[str] | None,
        Option("--units", help="Serial, or file with one on each line; repeat. Default: all that have a certificate."),
    ] = None,
) -> Answer:
    """Write all that an auditor needs into one folder. `accept verify FOLDER` checks it with what lies there."""
    with open_store() as store, busy("writing the evidence"):
        certified = (event.subject for event in store.last_of_each(CertificateSigned.KIND))
        serials = dict.fromkeys(_serials(units) if units else certified)
        made = write_evidence(store, out, serials, home(), event_line, csv_of)
    return Answer(
        *made.missing,
        f"{len(made.files)} files about {len(made.units)} units in {out}",
        Remark(f"`accept verify {out}` checks them"),
        exit=Exit.INCOMPLETE if made.missing else Exit.ACCEPTED,
    )


def _serials(given: Sequence[str]) -> Iterator[str]:
    from accept.fleet import serials_in  # loads pandas

    for each in given:
        yield from sorted(serials_in(Path(each))) if Path(each).is_file() else (each,)
