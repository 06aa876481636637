"""The command lines of `accept verify` and `countersign`."""

from pathlib import Path
from typing import Annotated

import typer

from accept.commands.options import LargeRecords, QaPassphrase, TimeStamping


def countersign(
    certificate: Annotated[Path, typer.Argument(help="A certificate that the technician has signed.")],
    passphrase_file: QaPassphrase = None,
    records: LargeRecords = None,
    tsa: TimeStamping = None,
    disposition: Annotated[
        str,
        typer.Option(help="Of a unit that was not accepted: use-as-is, rework, measure-again, return or scrap."),
    ] = "",
    because: Annotated[str, typer.Option(help="Why: the reason of the disposition.")] = "",
) -> None:
    """Countersign a certificate as QA. It is verified first; a unit that was not accepted needs a disposition."""
    from accept.commands.trust import countersign as command

    options = command.CountersignOptions(passphrase_file, records, tsa, disposition, because)
    raise typer.Exit(command.run(certificate, options))


def verify(
    certificate: Annotated[Path, typer.Argument(help="The certificate to check.")],
    trust: Annotated[list[Path] | None, typer.Option(help="CA certificate to trust, not this bench's.")] = None,
    records: LargeRecords = None,
    require: Annotated[str, typer.Option(help="Also require: accepted,countersigned,serial=SERIAL.")] = "",
    spec: Annotated[str | None, typer.Option("--spec", help="The spec that it must have been judged by.")] = None,
    demo: Annotated[bool, typer.Option("--demo", help="A certificate of `accept demo`.")] = False,
    tsa_trust: Annotated[list[Path] | None, typer.Option(help="Root of a time stamping authority to trust.")] = None,
) -> None:
    """Verify a certificate from its own bytes. Signatures, coverage, roles, CA, and the verdict judged again."""
    from accept.commands.trust import verify as command

    required = [word.strip() for word in require.split(",") if word.strip()]
    options = command.VerifyOptions(trust or [], records, required, spec, demo, tsa_trust or [])
    raise typer.Exit(command.run(certificate, options))
